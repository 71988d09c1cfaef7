"""What keeps outcomes from being taken and programs from running: locks, a pause, a container of priority."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import simpy

from teleop_sim.machines.elements import Group
from teleop_sim.machines.engine import Engine
from teleop_sim.machines.visits import Answer, Outcome, Visit


class Holds:
    """Locks and pauses of a running machine.

    Attributes:
        paused: nothing works and nothing passes.
        locks: paths of locked states.

    """

    def __init__(self, engine: Engine, visits: dict[str, Visit]) -> None:
        """``visits`` are those of the running machine, by path; it adds and removes them."""
        self._engine, self._visits = engine, visits
        self.paused = False
        self.locks: frozenset[str] = frozenset()

    def blocked(self, visit: Visit, outcome: Outcome) -> bool:
        """May the outcome not be taken now?"""
        return self.paused or self.suspended(visit) or self.lock_on(self._number(outcome)) is not None

    def lock_on(self, edge: int) -> str | None:
        """A lock on the state whose outcome it is, or on something else that is left with it; None: no lock."""
        net, before = self._engine.net, self._engine.configuration
        after = net.move(before, edge).configuration if self.locks else before
        for path in sorted(self.locks):
            node = net.by_path[path]
            if node == net.source[edge] or (net.on_path(before, node) and not net.on_path(after, node)):
                return path
        return None

    def refusal(self, path: str, event: str = "") -> str | None:
        """Why nothing may be done to a state now; None if it may. Without an event: a lock on the state itself."""
        if self.paused:
            return "the machine is paused"
        locked = path if path in self.locks else None
        if event:
            locked = self.lock_on(self._engine.machine.edge_index(path, event))
        if locked is not None:
            return f"{locked} is locked"
        net = self._engine.net
        node = net.by_path[path]
        if any(not net.inside(node, p) and not net.inside(p, node) for p in self._priorities()):
            return "suspended by a container of priority"
        return None

    def suspended(self, visit: Visit) -> bool:
        """Is a container of priority active that the state is not in?"""
        return any(not self._engine.net.inside(visit.node, p) for p in self._priorities())

    def until_free(self, visit: Visit) -> Generator[simpy.Event, Any, None]:
        """Process part: wait until the state may work, and everything that it suspends is at rest."""
        env = visit.called.env
        while not visit.over and (self.paused or self.suspended(visit)):
            visit.called = env.event()
            yield visit.called
            visit.answer = visit.answer if visit.over else None
        while not visit.over and (busy := [v.program for v in self._visits.values() if v.busy and self.suspended(v)]):
            yield simpy.AllOf(env, [p for p in busy if p is not None])

    def suspend(self) -> None:
        """Bring programs to rest that may not work any more."""
        for visit in tuple(self._visits.values()):
            if visit.busy and (self.paused or self.suspended(visit)):
                visit.wake(Answer("suspended", note="suspended"))

    def release(self) -> None:
        """Wake what was held up and may go on; let suggestions pass that the level lets pass now."""
        for visit in tuple(self._visits.values()):
            if visit.answer is None and not (self.paused or self.suspended(visit)):
                self._release(visit)

    def _release(self, visit: Visit) -> None:
        pending = visit.pending
        if pending is None and not visit.busy and not visit.called.triggered:
            visit.called.succeed()
        elif pending is not None and pending.event:
            outcome = Outcome(pending.path, pending.event, "autonomous")
            edge = self._engine.machine.edge(outcome.path, outcome.event)
            if edge.passes(self._engine.level) and not self.blocked(visit, outcome):
                visit.wake(Answer("autonomous"))

    def _priorities(self) -> set[int]:
        """Active containers of priority."""
        net = self._engine.net
        if not net.has_priority:
            return set()
        around = (c for n in self._engine.configuration.active for c in (n, *net.containers(n)))
        return {c for c in around if isinstance(e := net.nodes[c].element, Group) and e.priority}

    def _number(self, outcome: Outcome) -> int:
        return self._engine.machine.edge_index(outcome.path, outcome.event)
