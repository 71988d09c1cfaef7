"""The machine's visits to its states, put together from a run's transitions. Pure functions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypedDict

from teleop_sim.core.records import ModeChanged, Record, TransitionTaken

MODES = ("normal", "auto", "manual", "not_recoverable")
"""From best to worst."""


@dataclass(frozen=True)
class Attempt:
    """A stretch of a visit that ended with a transition or with the log: from, to [s] and the mode at its end."""

    start_s: float
    end_s: float
    mode: str


@dataclass(frozen=True)
class Visit:
    """A stay in one state: entered from another state, left to another state. Self-loops (retries) belong to it.

    Attributes:
        state: its name.
        attempts: one a transition, in order; at least one.
        retries: failures in it: by how much c of the 8-tuple grew.
        left: false where the log ends in this state.

    """

    state: str
    attempts: tuple[Attempt, ...]
    retries: int
    left: bool

    @property
    def start_s(self) -> float:
        """When the state was entered."""
        return self.attempts[0].start_s

    @property
    def end_s(self) -> float:
        """When it was left, or the end of the log."""
        return self.attempts[-1].end_s

    @property
    def time_s(self) -> float:
        """How long it took, over all attempts."""
        return sum(a.end_s - a.start_s for a in self.attempts)

    @property
    def mode(self) -> str:
        """The worst mode of its attempts."""
        return worst(a.mode for a in self.attempts)


class StateRow(TypedDict):
    """One state of one run, for ``run --json``: visits by their worst mode, retries, time in it [s]."""

    state: str
    visits: int
    normal: int
    auto: int
    manual: int
    retries: int
    time_s: float


def worst(modes: Iterable[str]) -> str:
    """The worst of some modes; an unknown name counts as normal."""
    return max(modes, key=lambda mode: MODES.index(mode) if mode in MODES else 0, default="normal")


def visits(records: Iterable[Record]) -> list[Visit]:
    """All visits of a run in order; the last is the state in which the log ends.

    A transition's stretch begins where the one before ended, or at its ``entered_s`` if that is later.
    """
    records = list(records)
    rows: list[list[TransitionTaken]] = []
    for taken in (r for r in records if isinstance(r, TransitionTaken)):
        if rows and rows[-1][-1].next_state == rows[-1][-1].state == taken.state:
            rows[-1].append(taken)
        else:
            rows.append([taken])
    made: list[Visit] = []
    failures: dict[str, int] = {}
    for row in rows:
        made.append(_left(row, made[-1].end_s if made else 0.0, failures))
    return _with_open_end(made, rows, records)


def state_rows(records: Iterable[Record]) -> list[StateRow]:
    """One row a state of the machine that was visited, in the order of first visits.

    A visit is entering the state from another one; its mode is the worst of its transitions. A manual visit counts as
    manual also where the robot turned out not to be recoverable.
    """
    rows: dict[str, StateRow] = {}
    for visit in visits(records):
        row = rows.setdefault(
            visit.state,
            StateRow(state=visit.state, visits=0, normal=0, auto=0, manual=0, retries=0, time_s=0.0),
        )
        row["visits"] += 1
        row["normal"] += visit.mode == "normal"
        row["auto"] += visit.mode == "auto"
        row["manual"] += visit.mode in ("manual", "not_recoverable")
        row["retries"] += visit.retries
        row["time_s"] += visit.time_s
    return list(rows.values())


def _left(row: Sequence[TransitionTaken], before_s: float, failures: dict[str, int]) -> Visit:
    """One visit; ``failures`` keeps c of each state from one visit to the next."""
    attempts, retries = [], 0
    for taken in row:
        start_s = min(max(before_s, taken.entered_s), taken.t_s)
        attempts.append(Attempt(start_s, taken.t_s, taken.mode))
        before_s = taken.t_s
        c = failures.get(taken.state, 0)
        # c grows with a failure and stays in the record of the success that clears it.
        retries += taken.retries - c if taken.retries >= c else taken.retries
        succeeded = taken.retries == c and taken.next_state != taken.state and taken.how != "forced"
        failures[taken.state] = 0 if succeeded else taken.retries
    return Visit(row[0].state, tuple(attempts), retries, left=True)


def _with_open_end(made: list[Visit], rows: list[list[TransitionTaken]], records: Sequence[Record]) -> list[Visit]:
    """Add the stay that the log's end cut, or the final state."""
    last = rows[-1][-1] if rows else None
    state = last.next_state if last else next((str(s) for r in records if (s := getattr(r, "state", ""))), "")
    if not state:
        return made
    since_s = last.t_s if last else min(float(getattr(r, "start_s", r.t_s)) for r in records if hasattr(r, "state"))
    modes = [r.mode for r in records if isinstance(r, ModeChanged)]
    stretch = Attempt(since_s, max(r.t_s for r in records), modes[-1] if modes else "normal")
    if last and last.state == state:
        cut = made[-1]
        return [*made[:-1], Visit(state, (*cut.attempts, stretch), cut.retries, left=False)]
    return [*made, Visit(state, (stretch,), 0, left=False)]
