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
from dataclasses import astuple, dataclass, fields
from functools import cache
from importlib.resources import files
from io import StringIO
from typing import TYPE_CHECKING

from teleop_sim.core.records import Record
from teleop_sim.reports.shares import SHARES, where_time_went
from teleop_sim.reports.visits import StateRow, Visit, state_rows, visits, worst

if TYPE_CHECKING:
    from rich.table import Table

__all__ = [
    "NOTE",
    "PaperRow",
    "StateRow",
    "TableRow",
    "csv_text",
    "markdown_text",
    "paper_rows",
    "rich_shares",
    "rich_table",
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


HEADINGS = ("State", "NE %", "AR %", "MR %", "#AR", "time s", "paper NE %", "AR %", "MR %", "#AR", "time s")
OURS = 6
"""How many of the headings are not the paper's."""

NARROW = (0, 4, 5, 10)
NARROW_NOTE = "#AR: retries. A wider terminal and the report's files have all columns."


def _cells(row: TableRow) -> tuple[str, ...]:
    def shown(of: TableRow | PaperRow) -> tuple[str, ...]:
        shares = (f"{p:.0f}" if p else "-" for p in (of.normal_pct, of.auto_pct, of.manual_pct))
        return (*shares, str(of.retries), f"{of.time_s:.1f}")

    return (row.name, *shown(row), *(shown(row.paper) if row.paper else ("",) * 5))


def _total(rows: Sequence[TableRow]) -> tuple[str, ...]:
    ours, paper = sum(r.time_s for r in rows), sum(r.paper.time_s for r in rows if r.paper)
    retries = sum(r.paper.retries for r in rows if r.paper)
    theirs = (str(retries), f"{paper:.1f}") if paper else ("", "")
    return ("Sum", "", "", "", str(sum(r.retries for r in rows)), f"{ours:.1f}", "", "", "", *theirs)


def rich_table(rows: Sequence[TableRow], narrow: bool = False) -> Table:
    """The table for a terminal; ``narrow``: only retries and times, for one of 40 columns."""
    from rich.table import Table

    runs = max((r.runs for r in rows), default=0)
    title = f"Per state, {runs} run{'s' if runs != 1 else ''}; right: the WPI paper's Table II, task 1, 10 runs"
    caption = NARROW_NOTE if narrow else NOTE
    table = Table(title=title, caption=caption, caption_justify="left", show_footer=True)
    headings = {**dict(enumerate(HEADINGS)), **({10: "paper"} if narrow else {})}
    total = _total(rows)
    columns = NARROW if narrow else tuple(range(len(HEADINGS)))
    for i in columns:
        style = "dim" if i > 5 else None
        table.add_column(headings[i], total[i], justify="right" if i else "left", no_wrap=True, style=style)
    for row in rows:
        cells = _cells(row)
        table.add_row(*(cells[i] for i in columns))
    return table


def rich_shares(shares: Mapping[str, float]) -> Table:
    """Where the time went, for a terminal; takes what ``where_time_went`` gives."""
    from rich.table import Table

    total_s = shares["total_s"]
    table = Table(title="Where the time went", show_footer=True)
    table.add_column("", "Sum")
    table.add_column("time s", f"{total_s:.1f}", justify="right")
    table.add_column("share %", "100" if total_s else "-", justify="right")
    for key, words in SHARES.items():
        table.add_row(words, f"{shares[key]:.1f}", f"{100.0 * shares[key] / total_s:.0f}" if total_s else "-")
    return table


def csv_text(rows: Sequence[TableRow]) -> str:
    """The table as CSV with full precision; the paper's columns are empty where it has no such row."""
    out = StringIO()
    writer = csv.writer(out, lineterminator="\n")
    figures = [f.name for f in fields(PaperRow)]
    writer.writerow(["state", *figures, *(f"paper_{name}" for name in figures)])
    for row in rows:
        ours = [row.name, *(getattr(row, name) for name in figures)]
        writer.writerow([*ours, *(astuple(row.paper) if row.paper else ("",) * len(figures))])
    return out.getvalue()


def markdown_text(rows: Sequence[TableRow]) -> str:
    """The table as Markdown; the paper's columns are left out where no state is one of its machine."""
    known = {name for state, (row, _) in paper_rows().items() for name in (state, row)}
    theirs = not rows or any(row.name in known for row in rows)
    shown = len(HEADINGS) if theirs else OURS
    lines = ["| " + " | ".join(HEADINGS[:shown]) + " |", "|---|" + "---:|" * (shown - 1)]
    lines += ["| " + " | ".join(cells[:shown]) + " |" for cells in (*map(_cells, rows), _total(rows))]
    return "\n".join([*lines, "", NOTE if theirs else SHORT_NOTE, ""])
