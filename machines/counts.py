"""The variables D of a running machine, its triggers F and updates U. Pure bookkeeping: no clock, no messages."""

from __future__ import annotations

from dataclasses import dataclass, field

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.machines.declare import Edge, Machine, Row


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

    def trigger(self, state: str, signal: str) -> Edge:
        """F: the outcome that a program's signal becomes under the present counts.

        Raises:
            BadInput: the program returned what the machine does not know.

        """
        row = self._row(state, signal)
        event = signal
        if row is not None:
            place = self._open(state, row)
            event = row.failed if place is None else row.counters[place].event
        if not self.machine.has_edge(state, event):
            raise BadInput((_unknown_signal(self.machine, state, signal),))
        return self.machine.edge(state, event)

    def update(self, edge: Edge, signal: str = "") -> None:
        """U: what taking an outcome changes. ``signal`` is empty if a person forced it: then no attempt is counted."""
        state = edge.state
        row = self._row(state, signal) if signal else None
        if row is not None:
            self._count(state, row)
        if edge.kind == "done":
            self._succeed(state)
        elif edge.kind in ("retry", "failed") and signal:
            self.failures[state] = self.failures.get(state, 0) + 1
        if edge.kind == "failed" and self.machine.state(edge.next_state).manual:
            self.escalated.add(state)

    def mode(self, state: str) -> str:
        """Mode in which a visit to the state begins: ``normal``, ``auto`` or ``manual``."""
        if self.machine.state(state).manual or state in self.escalated:
            return "manual"
        return "auto" if self.failures.get(state, 0) else "normal"

    def _row(self, state: str, signal: str) -> Row | None:
        return next((r for r in self.machine.state(state).rows if r.signal == signal), None)

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
        for row in self.machine.state(state).rows:
            filled = self._filled(state, row)
            filled[:] = [n if c.kept else 0 for n, c in zip(filled, row.counters, strict=True)]


def _unknown_signal(machine: Machine, state: str, signal: str) -> Problem:
    known = [e.event for e in machine.outcomes(state)] + [r.signal for r in machine.state(state).rows]
    what = f"its program returned {signal!r}, which the machine does not know"
    return Problem(f"machine {machine.name}: {state}", what, f"Known: {', '.join(dict.fromkeys(known))}.")
