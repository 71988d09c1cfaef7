"""A run's tables for a terminal: as the report's, with fewer columns and shorter headings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple, fields
from typing import TYPE_CHECKING

from teleop_sim.core.records import Record
from teleop_sim.reports.drc_times import COLUMNS, Times
from teleop_sim.reports.ledger import ALL, LedgerRow
from teleop_sim.reports.parts import Cell, Column, Sheet
from teleop_sim.reports.rich_sheet import rich_sheet
from teleop_sim.reports.run_ledger import MESSAGES_NOTE, NOTE, rows_sheet
from teleop_sim.reports.run_tables import state_sheet, times_of
from teleop_sim.reports.shares import SHARES
from teleop_sim.reports.table import TableRow

if TYPE_CHECKING:
    from rich.table import Table

_STATES = {
    "state": "State",
    "normal_pct": "NE %",
    "auto_pct": "AR %",
    "manual_pct": "MR %",
    "retries": "#AR",
    "time_s": "time s",
    "paper_normal_pct": "paper NE %",
    "paper_auto_pct": "AR %",
    "paper_manual_pct": "MR %",
    "paper_retries": "#AR",
    "paper_time_s": "time s",
}
_NARROW_STATES = {"state": "State", "retries": "#AR", "time_s": "time s", "paper_time_s": "paper"}
_PERCENT = tuple(name for name in _STATES if name.endswith("_pct"))
NARROW_NOTE = "#AR: retries. A wider terminal and the report's files have all columns."
_TIMES = {"alignment_s": "alignment", "motion_s": "motion"}
"""Shorter than the paper's."""
TIMES_NOTE = "From when the robot had stopped walking. Columns overlap, and leave out what people only look at."
_LEDGER = {"direction": "Link", "topic": "Topic", "offered": "offered", "delivered": "arrived", "reasons": "dropped"}
_WAITS = {
    "mean_queue_s": "queue s",
    "mean_blackout_s": "dark s",
    "mean_serialisation_s": "sending s",
    "mean_retransmission_s": "again s",
    "mean_propagation_s": "in air s",
}


def rich_table(rows: Sequence[TableRow], narrow: bool = False) -> Table:
    """The states of one run or several; ``narrow``: only retries and times, for a terminal of 40 columns."""
    runs = max((r.runs for r in rows), default=0)
    title = f"Per state, {runs} run{'s' if runs != 1 else ''}"
    headings = _NARROW_STATES if narrow else _STATES
    if any(row.paper for row in rows) or not rows:
        title += "; right: the WPI paper's Table II, task 1, 10 runs"
    else:
        headings = {name: words for name, words in headings.items() if not name.startswith("paper_")}
    caption = NARROW_NOTE if narrow else None
    return rich_sheet(state_sheet(rows), title, headings, caption, dashes=_PERCENT, dim="paper_")


def rich_shares(shares: Mapping[str, float]) -> Table:
    """Where the time went; takes what ``where_time_went`` gives."""
    total_s = shares["total_s"]
    columns = (Column("cause", ""), Column("time_s", "", 1), Column("share_pct", "", 0))

    def percent(time_s: float) -> float | None:
        return 100.0 * time_s / total_s if total_s else None

    rows = tuple((words, float(shares[key]), percent(shares[key])) for key, words in SHARES.items())
    sheet = Sheet(columns, rows, ("Sum", total_s, percent(total_s)))
    headings = {"cause": "", "time_s": "time s", "share_pct": "share %"}
    return rich_sheet(sheet, "Where the time went", headings, fold=True)


def rich_times(records: Sequence[Record], narrow: bool = False) -> Table:
    """The columns of Table 2; ``narrow``: a row a column, for a terminal of 40 columns."""
    found = times_of(records, paper="paper")
    title = "Columns of the ViGIR paper's Table 2 [s]"
    names = [field.name for field in fields(Times)]
    if narrow:
        columns = (Column("column", ""), *(Column(row, "", 1) for row in found))
        rows = tuple((COLUMNS[name], *_seconds(found.values(), name)) for name in names)
        headings = {"column": "", **{row: row for row in found}}
        return rich_sheet(Sheet(columns, rows), title, headings, TIMES_NOTE, unknown=_IN_RESET, fold=True)
    columns = (Column("row", ""), *(Column(name, "", 1) for name in names))
    rows = tuple((row, *map(float, astuple(t))) for row, t in found.items())
    headings = {"row": "", **{name: _TIMES.get(name, COLUMNS[name]) for name in names}}
    return rich_sheet(Sheet(columns, rows), title, headings, TIMES_NOTE, unknown=_IN_RESET)


def _seconds(found: Iterable[Times], name: str) -> tuple[Cell, ...]:
    return tuple(float(getattr(times, name)) for times in found)


_IN_RESET = "in reset"


def rich_ledger(rows: Sequence[LedgerRow], narrow: bool = False, messages: bool = False) -> Table:
    """A ledger; ``narrow``: counts only; ``messages``: it is that of the messages."""
    title, note = ("Messages by topic", MESSAGES_NOTE) if messages else ("Packets by topic", NOTE)
    headings = _LEDGER if narrow else {**_LEDGER, **_WAITS}
    sheet = rows_sheet(rows, "", "", note)
    return rich_sheet(sheet, title, headings, dashes=("reasons",), ends=lambda row: row[1] == ALL)
