"""A run's states as a few numbers each: what a sweep keeps of every run, and what makes Table II of many. Pure.

These are the rows of ``visits.state_rows``, told apart by the state that a visit interrupted, so that the per-state
table of a sweep (``table.py``) is made from them exactly as it is from the records.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass

from teleop_sim.core.records import Record
from teleop_sim.reports.table import INTERRUPTED, Entry, TableRow, paper_rows, row_name, table_of
from teleop_sim.reports.visits import Visit, visits, worst


@dataclass
class StateCount:
    """One state of one run.

    Attributes:
        state: its name.
        during: the state that it interrupted, whose row of Table II it counts in; empty as a rule.
        visits: how often it was entered from another state.
        normal, auto, manual: visits by their worst mode; not recoverable counts as manual.
        retries: failures of attempts in it.
        interrupted: visits without a failure of their own that were interrupted: Table II counts a retry each.
        time_s: in it.

    """

    state: str
    during: str = ""
    visits: int = 0
    normal: int = 0
    auto: int = 0
    manual: int = 0
    retries: int = 0
    interrupted: int = 0
    time_s: float = 0.0


COLUMNS: Mapping[str, str] = {
    "state": "of the machine",
    "during": "the state that it interrupted; empty as a rule",
    "visits": "how often it was entered from another state",
    "normal": "visits in normal mode",
    "auto": "visits that needed autonomous recovery",
    "manual": "visits that needed manual recovery, or the robot was not recoverable",
    "retries": "failures of attempts in it",
    "interrupted": "visits without a failure of their own that were interrupted",
    "time_s": "in it",
}
"""Field of a ``StateCount`` to what it says."""


def state_counts(records: Iterable[Record]) -> list[StateCount]:
    """The states of a run in the order of first visits."""
    made: dict[tuple[str, str], StateCount] = {}
    run = visits(records)
    last = ""
    for n, visit in enumerate(run):
        during = last if _interrupts(visit.state) else ""
        count = made.setdefault((visit.state, during), StateCount(visit.state, during))
        _add(count, visit, cut=n + 1 < len(run) and _interrupts(run[n + 1].state))
        last = during or visit.state
    return list(made.values())


def _interrupts(state: str) -> bool:
    return paper_rows().get(state, ("", None))[0] == INTERRUPTED


def _add(count: StateCount, visit: Visit, cut: bool) -> None:
    count.visits += 1
    count.normal += visit.mode == "normal"
    count.auto += visit.mode == "auto"
    count.manual += visit.mode in ("manual", "not_recoverable")
    count.retries += visit.retries
    count.interrupted += cut and not visit.retries
    count.time_s += visit.time_s


def plain(counts: Iterable[StateCount]) -> list[list[str | int | float]]:
    """For JSON: the fields in their order."""
    return [list(astuple(count)) for count in counts]


def table_of_counts(runs: Sequence[Sequence[StateCount]]) -> list[TableRow]:
    """Table II of several runs: equals ``table.state_table`` of their records."""
    return table_of([entries(run) for run in runs])


def entries(run: Sequence[StateCount]) -> dict[str, Entry]:
    """Row of Table II to what one run did there."""
    found: dict[str, Entry] = {}
    for count in run:
        name = row_name(count.during or count.state)
        mode = worst([*(m for m in ("auto", "manual") if getattr(count, m)), "auto" if count.during else "normal"])
        retries = 0 if count.during else count.retries + count.interrupted
        so_far = found.get(name, Entry("normal", 0, 0.0))
        found[name] = Entry(worst((so_far.mode, mode)), so_far.retries + retries, so_far.time_s + count.time_s)
    return found
