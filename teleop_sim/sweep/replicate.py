"""One replicate of a sweep, in one process: all its cells, one after the other, sharing what the robot does.

The replicate is the unit of work that a worker gets. Under common random numbers its cells ask the physics mostly for
the same episodes, so they share one memo. Nothing that a worker keeps changes a byte of what it writes.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import astuple, dataclass
from functools import partial
from hashlib import blake2b
from pathlib import Path
from typing import Any

from teleop_sim.core.errors import BadInput
from teleop_sim.core.records import Emit, PlantNames, PlantSample, Record
from teleop_sim.core.streams import stream
from teleop_sim.core.views import Show
from teleop_sim.log.writer import LogWriter
from teleop_sim.operators.memo import EyeMemo, FreshEyes
from teleop_sim.reports.drc_show import is_drc
from teleop_sim.reports.drc_times import drc_times
from teleop_sim.reports.figures import refused_figures, run_figures
from teleop_sim.reports.state_counts import plain, state_counts
from teleop_sim.robot.memo import Fresh, Memo
from teleop_sim.run import simulate
from teleop_sim.scenarios.links import link_plan
from teleop_sim.sweep.folder import STATES, TIMES, Row, SweepFolder, append
from teleop_sim.sweep.plan import Plan


@dataclass(frozen=True)
class Job:
    """Work for one process.

    Attributes:
        plan: of the sweep.
        folder: of the sweep, as this worker reaches it.
        replicate: which.
        cells: those wanted; what is finished already is not run again.
        memo: whether runs share what they compute.
        parent: process without which there is no sense in going on; 0: none.

    """

    plan: Plan
    folder: Path
    replicate: int
    cells: tuple[int, ...]
    memo: bool = True
    parent: int = 0


@dataclass(frozen=True)
class JobDone:
    """What a job came to; times are thread CPU time [s] and say nothing about the results.

    ``computed`` runs stepped the physics at least once, the others found all they asked for. ``found`` and ``made``:
    episodes.
    """

    replicate: int
    runs: int
    computed: int
    computed_s: float
    remembered_s: float
    found: int
    made: int


def run_job(job: Job, clock: Callable[[], float] = time.thread_time) -> JobDone:
    """Carry out a job: run what is missing, and journal each run when its log is in place."""
    folder = SweepFolder(job.folder)
    memo, eyes = (Memo(), EyeMemo()) if job.memo else (Fresh(), FreshEyes())
    runs = computed = 0
    spent_s = {True: 0.0, False: 0.0}
    with folder.journalling(job.replicate) as journal:
        finished = folder.whole(job.replicate)
        for cell in job.cells:
            if cell in finished:
                continue
            if job.parent and os.getppid() != job.parent:
                raise Orphaned(job.replicate)
            before, started_s = _made(memo), clock()
            append(journal, run_cell(job.plan, folder, cell, job.replicate, memo, eyes))
            fresh = not job.memo or _made(memo) > before
            spent_s[fresh] += clock() - started_s
            computed += fresh
            runs += 1
    tally = memo.tally() if isinstance(memo, Memo) else None
    found, made = (tally.episodes_found, tally.episodes_made) if tally else (0, 0)
    return JobDone(job.replicate, runs, computed, spent_s[True], spent_s[False], found, made)


class Orphaned(RuntimeError):
    """The process that gave the work is gone; whoever resumes will give it again."""


def run_cell(
    plan: Plan, folder: SweepFolder, cell: int, replicate: int, memo: Fresh, eyes: FreshEyes | None = None
) -> Row:
    """One run: its log in place, its row for the index."""
    head: Row = {"cell": cell, "replicate": replicate}
    head |= {factor.name: value for factor, value in zip(plan.factors, plan.cells[cell], strict=True)}
    scenario = plan.scenario_of(cell)
    tail: Row = {"limit_s": scenario.time_limit_s, "log": "", "log_bytes": 0, "log_digest": ""}
    try:
        link_plan(scenario, partial(stream, plan.seed, replicate))
    except BadInput as error:
        return head | _plain(refused_figures(str(error).split("\n", maxsplit=1)[0])) | tail | {STATES: []}
    path = folder.log(cell, replicate)
    with _log(plan, path) as (emit, show):
        records = simulate(scenario, plan.seed, replicate, emit, memo=memo, eyes=eyes, show=show).records
    if plan.detail != "summary":
        data = path.read_bytes()
        tail |= {"log": path.relative_to(folder.path).as_posix(), "log_bytes": len(data), "log_digest": _digest(data)}
    return head | _plain(run_figures(records)) | tail | _tables(records)


def _tables(records: Sequence[Record]) -> Row:
    """What tables over all runs need, and no index: each state, and of door and valve the columns of Table 2."""
    made: Row = {STATES: plain(state_counts(records))}
    return made | {TIMES: [None if x != x else x for x in astuple(drc_times(records))]} if is_drc(records) else made


@contextmanager
def _log(plan: Plan, path: Path) -> Iterator[tuple[Emit, Show | None]]:
    """Where the records and views of a run go, by the level of detail."""
    if plan.detail == "summary":
        yield _nowhere, None
        return
    with LogWriter(path, durable=False) as write:
        yield (write, write.show) if plan.detail == "full" else (partial(_events, write), None)


def _nowhere(_record: Record) -> None:
    pass


def _events(write: Emit, record: Record) -> None:
    if not isinstance(record, PlantSample | PlantNames):
        write(record)


def _plain(figures: dict[str, Any]) -> Row:
    """For JSON, which has no NaN."""
    return {key: None if value != value else value for key, value in figures.items()}


def _digest(data: bytes) -> str:
    return blake2b(data, digest_size=16).hexdigest()


def _made(memo: Fresh) -> int:
    return memo.tally().episodes_made if isinstance(memo, Memo) else 0
