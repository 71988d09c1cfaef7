"""The per-state table of the WPI paper (Table II), for one run or the mean of several, beside the paper's own figures.

A table row's mode is the worst that a run needed there; NE, AR and MR are shares of the runs that came there. ``#AR``
counts retries in all runs together, time is the mean of those runs' totals. Looking again after a lost grip
(``STATE_REDETECT_HANDLE``) has no row in the paper: it is counted as one retry of the state that it interrupted, with
its time. The paper's constant 13.3 s for Grasp Pitch suggests that it counts the next grasp there, too; this table
counts each grasp as a grasp.

Source: Jagtap, Agarwal, Nirmal et al. (WPI), Extended State Machines for Robust Robot Performance in Complex Tasks,
Table II; ``wpi_task1_paper.csv`` beside this file.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from teleop_sim.core.records import Record
from teleop_sim.reports.shares import where_time_went
from teleop_sim.reports.visits import StateRow, Visit, state_rows, visits, worst

__all__ = [
    "NOTE",
    "PaperRow",
    "StateRow",
    "TableRow",
    "paper_rows",
    "state_rows",
    "state_table",
    "where_time_went",
]

INTERRUPTED = "(interrupted)"
SHORT_NOTE = (
    "NE, AR, MR: share of runs that needed at worst normal execution, autonomous recovery, manual recovery; "
    "#AR: retries in all runs."
)
NOTE = SHORT_NOTE + " Redetection after a lost grip counts in the row that it interrupted (inferred)."


@dataclass(frozen=True)
class PaperRow:
    """The paper's figures for one row: shares of its runs [%], retries in all of them, mean time a run [s]."""

    runs: int
    normal_pct: float
    auto_pct: float
    manual_pct: float
    retries: int
    time_s: float


@dataclass(frozen=True)
class TableRow:
    """One row of the table: ``PaperRow``'s figures measured here, and the paper's, None where it has no such row."""

    name: str
    runs: int
    normal_pct: float
    auto_pct: float
    manual_pct: float
    retries: int
    time_s: float
    paper: PaperRow | None


@cache
def paper_rows() -> Mapping[str, tuple[str, PaperRow | None]]:
    """State to its row's name in the paper and the figures there (None: the paper has no such row)."""
    text = files("teleop_sim.reports").joinpath("wpi_task1_paper.csv").read_text(encoding="utf-8")
    lines = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return {line["state"]: (line["row"], _paper_row(line) if line["runs"] else None) for line in lines}


def _paper_row(line: Mapping[str, str]) -> PaperRow:
    normal, auto, manual = (float(line[name]) for name in ("normal_pct", "auto_pct", "manual_pct"))
    return PaperRow(int(line["runs"]), normal, auto, manual, int(line["retries"]), float(line["time_s"]))


def state_table(runs: Sequence[Iterable[Record]]) -> list[TableRow]:
    """The table for one run or several, rows in the order of the paper, other states where they were first visited."""
    return table_of([_by_row(visits(records)) for records in runs])


def table_of(per_run: Sequence[Mapping[str, Entry]]) -> list[TableRow]:
    """The table from what each run did in each row."""
    order = {name: i for i, (name, paper) in enumerate(paper_rows().values()) if paper}
    names = list(dict.fromkeys(name for run in per_run for name in run))
    return [_table_row(name, [run[name] for run in per_run if name in run]) for name in _merged(names, order)]


@dataclass(frozen=True)
class Entry:
    """One row of one run, or one visit on the way to it: worst mode, retries, time [s]."""

    mode: str
    retries: int
    time_s: float


def row_name(state: str) -> str:
    """The table's row of a state: the paper's name for it, else its own."""
    name = paper_rows().get(state, ("", None))[0] or state
    return state if name == INTERRUPTED else name


def _by_row(run: Sequence[Visit]) -> dict[str, Entry]:
    found: dict[str, Entry] = {}
    last = ""
    for i, visit in enumerate(run):
        interrupts = paper_rows().get(visit.state, ("", None))[0] == INTERRUPTED and bool(last)
        name = last if interrupts else row_name(visit.state)
        interrupted = i + 1 < len(run) and paper_rows().get(run[i + 1].state, ("", None))[0] == INTERRUPTED
        entry = Entry(
            worst((visit.mode, "auto" if interrupts else "normal")),
            0 if interrupts else max(visit.retries, int(interrupted)),
            visit.time_s,
        )
        so_far = found.get(name, Entry("normal", 0, 0.0))
        found[name] = Entry(
            worst((so_far.mode, entry.mode)), so_far.retries + entry.retries, so_far.time_s + entry.time_s
        )
        last = name
    return found


def _merged(names: Sequence[str], order: Mapping[str, int]) -> list[str]:
    """The paper's rows in its order; each other row stays behind the row that it came after."""
    place: dict[str, tuple[int, int]] = {}
    behind = -1
    for i, name in enumerate(names):
        behind = order.get(name, behind)
        place[name] = (behind, -1 if name in order else i)
    return sorted(names, key=lambda name: place[name])


def _table_row(name: str, entries: Sequence[Entry]) -> TableRow:
    paper = {row: figures for row, figures in paper_rows().values() if figures}.get(name)
    share = 100.0 / len(entries)
    return TableRow(
        name,
        len(entries),
        share * sum(e.mode == "normal" for e in entries),
        share * sum(e.mode == "auto" for e in entries),
        share * sum(e.mode in ("manual", "not_recoverable") for e in entries),
        sum(e.retries for e in entries),
        sum(e.time_s for e in entries) / len(entries),
        paper,
    )
