"""The ViGIR paper's Table 2 over many runs: means and spreads beside the paper's figures, and what they must meet.

Means are of completed runs; the others are counted. Pure functions; figures of a run come from ``drc_times.py``.
"""

from __future__ import annotations

import csv
import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from io import StringIO
from itertools import pairwise

from teleop_sim.reports.drc_times import COLUMNS, PaperRow, Times, paper_rows

DOOR = ("drc-door-lab-operator", "drc-door-lab-behaviour")
VALVE = ("drc-valve-lab-operator", "drc-valve-lab-behaviour")
CALIBRATED = (DOOR[0], VALVE[0])
"""The rows that a figure was fitted to: deliberation per command. All others are predictions."""
RATIO_TOLERANCE = 0.4
ALIGNMENT_S, ALIGNMENT_TOLERANCE_S = 52.0, 14.0
"""Mean and standard deviation of the paper's five full alignments: 51, 45, 72, 36 and 57 s."""
NOTE = (
    "Mean ± standard deviation of completed runs [s]; in brackets the paper's one run. "
    "Calibrated on the two operator-only lab rows (*); all other rows are predictions."
)


RUN_NOTE = (
    "Columns of the ViGIR paper's Table 2, from when the robot had stopped walking. They overlap, and leave out what "
    "people only look at: they do not add up."
)


@dataclass(frozen=True)
class DrcRun:
    """One run: its scenario and seed, how it ended, and its times."""

    scenario: str
    seed: int
    outcome: str
    cause: str
    times: Times


@dataclass(frozen=True)
class DrcRow:
    """One row: runs, how many completed, mean and standard deviation of their times (NaN: too few), the paper's row."""

    scenario: str
    runs: int
    completed: int
    mean: Times
    sd: Times
    paper: PaperRow | None


@dataclass(frozen=True)
class Check:
    """Something the table must meet: in words, what was measured, what it should be, and whether it is."""

    what: str
    measured: str
    wanted: str
    holds: bool


def drc_rows(runs: Sequence[DrcRun]) -> list[DrcRow]:
    """One row a scenario: the paper's in its order, then the others as they came."""
    order = [name for name in paper_rows() if any(r.scenario == name for r in runs)]
    names = dict.fromkeys([*order, *(r.scenario for r in runs)])
    return [_row(name, [r for r in runs if r.scenario == name]) for name in names]


def _row(scenario: str, runs: Sequence[DrcRun]) -> DrcRow:
    done = [astuple(r.times) for r in runs if r.outcome == "completed"]
    columns = list(zip(*done, strict=True)) if done else [()] * len(fields(Times))
    mean = Times(*(statistics.fmean(c) if c else math.nan for c in columns))
    sd = Times(*(statistics.stdev(c) if len(c) > 1 else math.nan for c in columns))
    return DrcRow(scenario, len(runs), len(done), mean, sd, paper_rows().get(scenario))


def checks(rows: Sequence[DrcRow]) -> list[Check]:
    """The order of the overall times, the two ratios and the alignment; only what the rows suffice for."""
    by_name = {row.scenario: row for row in rows if row.paper is not None}
    made = [_order(list(by_name.values()))] if len(by_name) > 1 else []
    for task, (by_people, by_behaviour) in (("door", DOOR), ("valve", VALVE)):
        if by_people in by_name and by_behaviour in by_name:
            made.append(_ratio(task, by_name[by_people], by_name[by_behaviour]))
    aligned = [row for row in by_name.values() if row.paper and row.paper.first_alignment]
    return [*made, *([_alignment(aligned)] if aligned else [])]


def _order(rows: Sequence[DrcRow]) -> Check:
    ours = sorted(rows, key=lambda row: -row.mean.overall_s)
    wanted = [row.scenario for row in sorted(rows, key=lambda row: -_paper_s(row))]
    measured = " > ".join(f"{row.scenario} {row.mean.overall_s:.0f}" for row in ours)
    known = all(row.completed for row in rows)
    holds = known and [row.scenario for row in ours] == wanted
    return Check("order of the overall times", measured, " > ".join(wanted), holds)


def _ratio(task: str, people: DrcRow, behaviour: DrcRow) -> Check:
    """Ratio of mean overall times; its standard error by the delta method for independent means."""
    ratio = people.mean.overall_s / behaviour.mean.overall_s
    relative = math.hypot(*(row.sd.overall_s / row.mean.overall_s / math.sqrt(row.completed or 1) for row in
                            (people, behaviour)))  # fmt: skip
    wanted = _paper_s(people) / _paper_s(behaviour)
    return Check(
        f"operator only over behaviour, {task}",
        f"{ratio:.2f} ± {ratio * relative:.2f} (standard error)",
        f"{wanted:.2f} ± {RATIO_TOLERANCE}",
        abs(ratio - wanted) <= RATIO_TOLERANCE,
    )


def _alignment(rows: Sequence[DrcRow]) -> Check:
    mean_s = statistics.fmean(row.mean.alignment_s for row in rows)
    each = ", ".join(f"{row.mean.alignment_s:.0f}" for row in rows)
    return Check(
        "template alignment, mean of the rows where it was not laid in a pause",
        f"{mean_s:.1f} s ({each})",
        f"{ALIGNMENT_S:.0f} ± {ALIGNMENT_TOLERANCE_S:.0f} s",
        abs(mean_s - ALIGNMENT_S) <= ALIGNMENT_TOLERANCE_S,
    )


def _paper_s(row: DrcRow) -> float:
    assert row.paper is not None
    return row.paper.times.overall_s


def gaps(rows: Sequence[DrcRow]) -> list[str]:
    """How sure the order is: each row of the paper against the next, difference of means and its standard error."""
    known = [row for row in rows if row.paper is not None]
    lines = []
    for one, two in pairwise(known):
        error_s = math.hypot(*(row.sd.overall_s / math.sqrt(row.completed or 1) for row in (one, two)))
        gap_s, paper_s = one.mean.overall_s - two.mean.overall_s, _paper_s(one) - _paper_s(two)
        lines.append(f"{one.scenario} - {two.scenario}: {gap_s:.0f} ± {error_s:.0f} s (paper {paper_s:.0f} s)")
    return lines


def drc_markdown(rows: Sequence[DrcRow]) -> str:
    """The table as Markdown."""
    head = ["row", "completed", *(f"{words} s" for words in COLUMNS.values())]
    lines = ["| " + " | ".join(head) + " |", "|---|" + "---:|" * (len(head) - 1)]
    lines += ["| " + " | ".join(_cells(row)) + " |" for row in rows]
    return "\n".join([*lines, "", NOTE, ""])


def _cells(row: DrcRow) -> list[str]:
    paper = astuple(row.paper.times) if row.paper else (math.nan,) * len(COLUMNS)
    star = " *" if row.scenario in CALIBRATED else ""
    name = f"{row.paper.name}{star}" if row.paper else row.scenario
    cells = zip(astuple(row.mean), astuple(row.sd), paper, strict=True)
    return [name, f"{row.completed} of {row.runs}", *(_cell(*cell, row.paper is not None) for cell in cells)]


def _cell(mean: float, sd: float, paper: float, known: bool) -> str:
    """Such as ``231 ± 18 [232]``."""
    ours = "-" if math.isnan(mean) else f"{mean:.0f}" + ("" if math.isnan(sd) else f" ± {sd:.0f}")
    theirs = "in reset" if math.isnan(paper) else f"{paper:.0f}"
    return f"{ours} [{theirs}]" if known else ours


def runs_csv(runs: Sequence[DrcRun]) -> str:
    """One line a run, with full precision."""
    out = StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["scenario", "seed", "outcome", "cause", *COLUMNS])
    writer.writerows([r.scenario, r.seed, r.outcome, r.cause, *astuple(r.times)] for r in runs)
    return out.getvalue()


def read_runs(text: str) -> list[DrcRun]:
    """Inverse of ``runs_csv``."""
    return [_read(line) for line in csv.DictReader(StringIO(text))]


def _read(line: Mapping[str, str]) -> DrcRun:
    times = Times(*(float(line[name]) for name in COLUMNS))
    return DrcRun(line["scenario"], int(line["seed"]), line["outcome"], line["cause"], times)
