"""The variables D of a running machine, its triggers F and updates U. Pure bookkeeping: no clock, no messages."""

from __future__ import annotations

from dataclasses import dataclass, field

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.machines.declare import Edge, Machine, Row, State


@dataclass
class Variables:
    """D of the 8-tuple while the machine runs.

    Attributes:
        machine: whose variables they are.
        succeeded: b, states whose action has succeeded at least once.
        failures: c of a state: attempts that failed since it last succeeded, whatever their limit.
        counts: the limited counters, by state and signal, inner first.
        escalated: states that gave up and left their work to a person; a success ends that.

    """

    machine: Machine
    succeeded: set[str] = field(default_factory=set)
    failures: dict[str, int] = field(default_factory=dict)
    counts: dict[tuple[str, str], list[int]] = field(default_factory=dict)
    escalated: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        self._look_up()

    def trigger(self, state: str, signal: str) -> int:
        """F: number of the edge that a program's signal becomes under the present counts.

        Raises:
            BadInput: the program returned what the machine does not know.

        """
        row = self._rows.get((state, signal))
        event = signal
        if row is not None:
            place = self._open(state, row)
            event = row.failed if place is None else row.counters[place].event
        found = self.machine.net.number(state, event)
        if found is None:
            raise BadInput((_unknown_signal(self.machine, state, signal),))
        return found

    def update(self, edge: Edge, signal: str = "") -> None:
        """U: what taking an outcome changes. ``signal`` is empty if a person forced it: then no attempt is counted."""
        state = edge.state
        row = self._rows.get((state, signal))
        if row is not None:
            self._count(state, row)
        if edge.kind == "done":
            self._succeed(state)
        elif edge.kind in ("retry", "failed") and signal:
            self.failures[state] = self.failures.get(state, 0) + 1
        if edge.kind == "failed" and edge.next_state in self._manual:
            self.escalated.add(state)

    def mode(self, state: str) -> str:
        """Mode in which a visit to the state begins: ``normal``, ``auto`` or ``manual``."""
        if state in self._manual or state in self.escalated:
            return "manual"
        return "auto" if self.failures.get(state, 0) else "normal"

    def is_manual(self, state: str) -> bool:
        """Does the state wait for a person?"""
        return state in self._manual

    def renew(self, machine: Machine) -> None:
        """Go on with a changed machine: what is gone is forgotten, what is new begins at zero."""
        self.machine = machine
        self._look_up()
        known = set(machine.state_names)
        self.succeeded &= known
        self.escalated &= known
        self.failures = {path: n for path, n in self.failures.items() if path in known}
        self.counts = {
            key: filled for key, filled in self.counts.items() if len(filled) == len(self._counters.get(key, ()))
        }

    def _look_up(self) -> None:
        leaves = {n.path: n.element for n in self.machine.net.nodes if isinstance(n.element, State)}
        self._manual = frozenset(path for path, state in leaves.items() if state.manual)
        self._rows = {(path, row.signal): row for path, state in leaves.items() for row in state.rows}
        self._counters = {key: row.counters for key, row in self._rows.items()}
        self._rows_of = {path: state.rows for path, state in leaves.items()}

    def _filled(self, state: str, row: Row) -> list[int]:
        return self.counts.setdefault((state, row.signal), [0] * len(row.counters))

    def _open(self, state: str, row: Row) -> int | None:
        """Place of the first counter that is not full."""
        filled = self._filled(state, row)
        return next((k for k, c in enumerate(row.counters) if filled[k] < c.limit), None)

    def _count(self, state: str, row: Row) -> None:
        filled, place = self._filled(state, row), self._open(state, row)
        passed_over = len(row.counters) if place is None else place
        for k in range(passed_over):
            if row.counters[k].clears:
                filled[k] = 0
        if place is not None:
            filled[place] += 1

    def _succeed(self, state: str) -> None:
        self.succeeded.add(state)
        self.failures[state] = 0
        self.escalated.discard(state)
        for row in self._rows_of.get(state, ()):
            filled = self._filled(state, row)
            filled[:] = [n if c.kept else 0 for n, c in zip(filled, row.counters, strict=True)]


def _unknown_signal(machine: Machine, state: str, signal: str) -> Problem:
    known = [e.event for e in machine.outcomes_of(state)] + [r.signal for r in machine.leaf(state).rows]
    what = f"its program returned {signal!r}, which the machine does not know"
    return Problem(f"machine {machine.name}: {state}", what, f"Known: {', '.join(dict.fromkeys(known))}.")
