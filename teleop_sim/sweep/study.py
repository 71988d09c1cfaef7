"""A sweep from plan to index: what is missing is run, cell by cell until each has enough."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from teleop_sim.stats.stopping import looks, progress
from teleop_sim.sweep.folder import STATES, TIMES, Row, SweepBroken, SweepFolder
from teleop_sim.sweep.index import frame, write_index
from teleop_sim.sweep.plan import Plan
from teleop_sim.sweep.replicate import Job, JobDone
from teleop_sim.sweep.versions import versions
from teleop_sim.sweep.workers import Crew, JobLost, Processes


@dataclass
class SweepProgress:
    """How far a sweep is.

    Attributes:
        runs: that there will be, as far as is known; a stopping rule may spare some.
        done: finished, those of earlier calls too.
        resumed: finished before this call.
        bad: finished ones that did not complete: failed, refused or out of time.
        found, made: episodes of this call that the memo knew, and that were computed.
        computed, computed_s: runs of this call with physics in them, and their CPU time.
        remembered, remembered_s: those without.
        lost: jobs that could not be done.

    """

    runs: int
    done: int = 0
    resumed: int = 0
    bad: int = 0
    found: int = 0
    made: int = 0
    computed: int = 0
    computed_s: float = 0.0
    remembered: int = 0
    remembered_s: float = 0.0
    lost: list[JobLost] = field(default_factory=list)


Watch = Callable[[SweepProgress], None]


def _unwatched(_progress: SweepProgress) -> None:
    pass


def run_sweep(
    plan: Plan, directory: Path | str, crew: Crew | None = None, memo: bool = True, watch: Watch = _unwatched
) -> SweepProgress:
    """Run what a directory lacks of a plan, and write its index.

    Args:
        plan: of a new sweep, or that of the directory (``resumed_plan``).
        directory: made if missing.
        crew: who computes; two processes by default.
        memo: whether the cells of a replicate share what the robot does. Results do not depend on it.
        watch: called about twice a second.

    Raises:
        BadInput: a cell that does not fit the scenario, or a sweep is under way in the directory.
        KeyboardInterrupt: passed on; what was finished is kept.

    """
    crew = Processes(2) if crew is None else crew
    folder = SweepFolder(Path(directory).absolute())
    refuse_bad_cells(plan)
    with folder.alone():
        if not folder.manifest.exists():
            folder.create(plan)
        study = _Study(plan, folder, crew, memo, watch)
        study.run()
        if not study.at.lost:
            write_index(folder, plan, folder.rows(plan.replicates))
    return study.at


def refuse_bad_cells(plan: Plan) -> None:
    """Make every cell's scenario once, so that a sweep ends before it begins.

    Raises:
        BadInput: the problems of the first cell that has any; the others will have the same.

    """
    for cell in range(len(plan.cells)):
        plan.scenario_of(cell)


def resumed_plan(directory: Path | str, scenario: Callable[[str], str | None], force: bool = False) -> Plan:
    """The plan of a directory, if what it depends on is as it was.

    Args:
        directory: of the sweep.
        scenario: gives the canonical text of the scenario by the name or path that the sweep was begun with; None if
            there is none any more.
        force: go on with another version; the manifest then names the present one. The scenario stays that of the
            manifest.

    Raises:
        SweepBroken: no sweep, or scenario or versions have changed and ``force`` is not given.

    """
    folder = SweepFolder(Path(directory))
    plan, before = folder.read()
    if force:
        folder.write_manifest(plan)
        return plan
    now, hint = versions(), "Go on all the same with --force, or begin anew elsewhere: results would be of two kinds."
    changed = [
        f"{name} was {before.get(name, 'none')}, is {now[name]}" for name in now if before.get(name) != now[name]
    ]
    if changed:
        raise SweepBroken(str(folder.path), f"was begun with other versions: {'; '.join(changed)}", hint)
    text = scenario(plan.source)
    if text is not None and text != plan.scenario:
        raise SweepBroken(str(folder.path), f"the scenario {plan.source} has changed since", hint)
    return plan


class _Study:
    """One call: rounds of jobs, and what they have come to."""

    def __init__(self, plan: Plan, folder: SweepFolder, crew: Crew, memo: bool, watch: Watch) -> None:
        self._plan, self._folder, self._crew, self._memo, self._watch = plan, folder, crew, memo, watch
        self._rows = {n: _lean(folder.whole(n)) for n in range(plan.replicates)}
        done = sum(map(len, self._rows.values()))
        self.at = SweepProgress(plan.runs, done, done, sum(map(_bad, self._all_rows())))
        self._under_way: dict[int, tuple[int, ...]] = {}

    def run(self) -> None:
        """All rounds. Which cells go on is asked of the first replicates alone, so it does not matter who was fast."""
        for first, last, cells in self._rounds():
            jobs = [job for n in range(first, last) if (job := self._job(n, cells)) is not None]
            if jobs:
                self._folder.index.unlink(missing_ok=True)
                self._under_way = {job.replicate: job.cells for job in jobs}
                self._crew.carry_out(jobs, self._tell, self._tick)
            if self.at.lost:
                return
        self._watch(self.at)

    def _rounds(self) -> Iterator[tuple[int, int, tuple[int, ...]]]:
        """From, to which replicate, and which cells."""
        every, until = tuple(range(len(self._plan.cells))), self._plan.until
        if until is None:
            yield 0, self._plan.replicates, every
            return
        first, cells = 0, every
        for last in looks(until.within(self._plan.replicates)):
            yield first, last, cells
            cells = tuple(cell for cell in cells if not self._enough(cell, last))
            self.at.runs = sum(map(len, self._rows.values())) + len(cells) * (self._plan.replicates - last)
            if not cells:
                return
            first = last

    def _enough(self, cell: int, replicates: int) -> bool:
        until = self._plan.until
        assert until is not None
        rows = [row for n in range(replicates) if (row := self._rows[n].get(cell)) is not None]
        return progress(frame(self._plan, rows), until.measure, until.within(self._plan.replicates)).stop

    def _job(self, replicate: int, cells: tuple[int, ...]) -> Job | None:
        missing = tuple(cell for cell in cells if cell not in self._rows[replicate])
        return Job(self._plan, self._folder.path, replicate, missing, self._memo) if missing else None

    def _tell(self, done: JobDone | JobLost) -> None:
        if isinstance(done, JobLost):
            self.at.lost.append(done)
        else:
            self.at.found, self.at.made = self.at.found + done.found, self.at.made + done.made
            self.at.computed, self.at.computed_s = (
                self.at.computed + done.computed,
                self.at.computed_s + done.computed_s,
            )
            self.at.remembered += done.runs - done.computed
            self.at.remembered_s += done.remembered_s
        self._under_way.pop(done.replicate, None)
        self._rows[done.replicate] = _lean(self._folder.finished(done.replicate))
        self._count()

    def _tick(self) -> None:
        self._count()

    def _count(self) -> None:
        under_way = sum(self._folder.count(n) for n in self._under_way)
        settled = sum(len(rows) for n, rows in self._rows.items() if n not in self._under_way)
        self.at.done, self.at.bad = settled + under_way, sum(map(_bad, self._all_rows()))
        self._watch(self.at)

    def _all_rows(self) -> Iterator[Row]:
        return (row for rows in self._rows.values() for row in rows.values())


def _lean(rows: Mapping[int, Row]) -> dict[int, Row]:
    """Without what only the tables over all runs need: it is most of a row."""
    return {cell: {k: v for k, v in row.items() if k not in (STATES, TIMES)} for cell, row in rows.items()}


def _bad(row: Row) -> bool:
    return bool(row["outcome"] != "completed")
