"""The papers' tables for one run: states beside the WPI paper's Table II, times beside the ViGIR paper's Table 2."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, fields

from teleop_sim.core.records import Layer, Record, RunStarted
from teleop_sim.reports.drc_marks import MARKS, counts
from teleop_sim.reports.drc_show import is_drc
from teleop_sim.reports.drc_table import RUN_NOTE
from teleop_sim.reports.drc_times import COLUMNS, Times, completed, drc_times
from teleop_sim.reports.drc_times import paper_rows as table2
from teleop_sim.reports.parts import Cell, Column, Sheet
from teleop_sim.reports.run_view import Run
from teleop_sim.reports.table import NOTE, SHORT_NOTE, PaperRow, TableRow, paper_rows, state_table
from teleop_sim.reports.verification import verification

FIGURES = (
    Column("runs", "runs", help="that came there"),
    Column("normal_pct", "NE [%]", 0, help="share of them that needed normal execution only"),
    Column("auto_pct", "AR [%]", 0, help="share that needed autonomous recovery at worst"),
    Column("manual_pct", "MR [%]", 0, help="share that needed manual recovery"),
    Column("retries", "#AR", help="retries in all of them"),
    Column("time_s", "time [s]", 1, help="mean of a run"),
)
"""Fields of ``PaperRow`` as columns."""


def states_sheet(run: Run) -> Sheet | None:
    """A row a state, beside the paper's where its machine has it; None where no state was entered."""
    rows = state_table([run.records])
    return state_sheet(rows) if rows else None


def state_sheet(rows: Sequence[TableRow]) -> Sheet:
    """Table II of one run or several. The paper's columns are there only where one of its states is."""
    known = {name for state, (row, _) in paper_rows().items() for name in (state, row)}
    theirs = any(row.name in known for row in rows)
    several = any(row.runs > 1 for row in rows)
    ours = [c for c in FIGURES if several or c.name != "runs"]
    paper = [Column(f"paper_{c.name}", c.words, c.decimals, "WPI paper, 10 runs", c.help) for c in FIGURES]
    columns = (Column("state", "state"), *(_grouped(c, "here") for c in ours), *(paper if theirs else ()))

    def cells(row: TableRow | PaperRow, shown: list[Column]) -> tuple[Cell, ...]:
        return tuple(getattr(row, c.name) for c in shown)

    nothing = (None,) * len(FIGURES)
    made = tuple(
        (
            row.name,
            *cells(row, ours),
            *((cells(row.paper, list(FIGURES)) if row.paper else nothing) if theirs else ()),
        )
        for row in rows
    )
    sums = {name: sum(getattr(row, name) for row in rows) for name in ("retries", "time_s")}
    paper_sums = {name: sum(getattr(r.paper, name) for r in rows if r.paper) for name in ("retries", "time_s")}
    total = (
        "Sum",
        *(sums.get(c.name) for c in ours),
        *((paper_sums.get(c.name) for c in FIGURES) if theirs else ()),
    )
    return Sheet(columns, made, total, NOTE if theirs else SHORT_NOTE)


def _grouped(column: Column, group: str) -> Column:
    return Column(column.name, column.words, column.decimals, group, column.help)


def times_sheet(run: Run) -> Sheet | None:
    """One run's row of Table 2, beside the paper's where it is one of its rows; None for other tasks."""
    if not (is_drc(run.records) or any(isinstance(r, Layer) for r in run.records)):
        return None
    rows = times_of(run.records, paper="ViGIR paper")
    columns = (
        Column("row", ""),
        *(Column(f.name, f"{COLUMNS[f.name]} [s]", 1) for f in fields(Times)),
    )
    return Sheet(
        columns, tuple((name, *map(float, astuple(times))) for name, times in rows.items()), (), RUN_NOTE + _RESET
    )


def times_of(records: Sequence[Record], paper: str) -> dict[str, Times]:
    """A run's columns of Table 2, and the paper's where it is one of its rows, under their names."""
    started = next((r for r in records if isinstance(r, RunStarted)), None)
    theirs = table2().get(started.scenario if started else "")
    ours = "this run" if completed(records) else "this run, not completed"
    return {ours: drc_times(records), **({f"{paper}, {theirs.name}": theirs.times} if theirs else {})}


_RESET = " An empty cell: the template was laid in a pause of the contest, and the paper has no time for it."


def marks_sheet(run: Run) -> Sheet | None:
    """What the crew did besides confirming, counted; None if nothing."""
    found = {kind: n for kind, n in counts(run.records).items() if n}
    if not found:
        return None
    rows = tuple((MARKS[kind], n) for kind, n in found.items())
    return Sheet((Column("what", "what the crew did"), Column("times", "times")), rows)


def verification_sheet(run: Run) -> Sheet | None:
    """A row an event that people judged; None where nobody judged anything that can be checked."""
    rows = verification(run.records)
    if not rows:
        return None
    names = {
        "event": "event",
        "hits": "hits",
        "misses": "misses",
        "false_alarms": "false alarms",
        "correct_rejections": "correct rejections",
        "unseen": "unseen",
    }
    rates = (
        Column("hit_rate", "hit rate", 2, help="share of the wrong claims that were rejected"),
        Column("false_alarm_rate", "false-alarm rate", 2, help="share of the right claims that were rejected"),
    )
    columns = (*(Column(name, words) for name, words in names.items()), *rates)
    made = tuple(tuple(getattr(row, c.name) for c in columns) for row in rows)
    note = "A hit is a wrong claim of the robot's that was rejected, a false alarm a right one that was."
    return Sheet(columns, made, (), note)
