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
        edge = self._engine.machine.edge_index(outcome.path, outcome.event)
        return self.stopped(visit) or self.lock_on(edge, self.locks) is not None

    def stopped(self, visit: Visit) -> bool:
        """Is the machine paused, or the state suspended by a container of priority?"""
        return self.paused or self._suspended(visit.node)

    def lock_on(self, edge: int, locks: frozenset[str]) -> str | None:
        """Which of the locks is on the state whose outcome it is, or on something else that is left with it."""
        net, before = self._engine.net, self._engine.configuration
        after = net.move(before, edge).configuration if locks else before
        for path in sorted(locks):
            node = net.by_path[path]
            if node == net.source[edge] or (net.on_path(before, node) and not net.on_path(after, node)):
                return path
        return None

    def refusal(self, path: str, event: str = "") -> str | None:
        """Why nothing may be done to a state now, or, with an event, why that may not be taken; None if it may."""
        if self.paused:
            return "the machine is paused"
        if event:
            locked = self.lock_on(self._engine.machine.edge_index(path, event), self.locks)
            if locked is not None:
                return f"{locked} is locked"
        if self._suspended(self._engine.net.by_path[path]):
            return "suspended by a container of priority"
        return None

    def too_late(self, path: str) -> str | None:
        """What has been decided already and leaves a state that is to be locked; None if nothing does."""
        for visit in self._visits.values():
            event = visit.chosen()
            if event:
                edge = self._engine.machine.edge_index(visit.path, event)
                if self.lock_on(edge, frozenset({path})) is not None:
                    return f"{visit.path} {event}"
        return None

    def left_with(self, visit: Visit, outcome: Outcome) -> list[Visit]:
        """Everything else that is left if a visit comes to an outcome now."""
        engine = self._engine
        net, number = engine.net, engine.machine.edge_index(outcome.path, outcome.event)
        move, source = net.move(engine.configuration, number), net.source[number]
        # All in a container is left when it ends, else only what has come to the outcome. A visit to that container
        # itself, which a person forces to be left, leaves more than this one.
        ends = move.raised >= 0 or bool(move.configuration.outcome)
        whole = net.nodes[source].parent if ends else source
        inside = (v for v in self._visits.values() if v is not visit and net.inside(v.node, whole))
        return [v for v in inside if not ends or v.node != whole]

    def leaving(self, path: str) -> bool:
        """Is everything in this container being left already?"""
        net = self._engine.net
        return all(v.over for v in self._visits.values() if net.inside(v.node, net.by_path[path]))

    def until_free(self, visit: Visit) -> Generator[simpy.Event, Any, None]:
        """Process part: wait until the state may work, and everything that it suspends is at rest."""
        while not visit.over:
            if self.stopped(visit):
                yield visit.wait()
                continue
            others = (v for v in self._visits.values() if v is not visit and self._suspended(v.node))
            busy = [v.program for v in others if v.program is not None and v.busy]
            if not busy:
                return
            yield simpy.AllOf(visit.called.env, busy)

    def suspend(self) -> None:
        """Bring programs to rest that may not work any more."""
        for visit in tuple(self._visits.values()):
            if visit.busy and self.stopped(visit):
                visit.wake(Answer("suspended", note="suspended"))

    def release(self) -> None:
        """Something may go on, or pass, that could not before: let everything look again that waits."""
        for visit in tuple(self._visits.values()):
            if not visit.busy:
                visit.nudge()

    def passes(self, visit: Visit) -> bool:
        """May what the visit suggests pass by itself now?"""
        pending = visit.pending
        if pending is None or not pending.event:
            return False
        outcome = Outcome(pending.path, pending.event, "autonomous")
        edge = self._engine.machine.edge(outcome.path, outcome.event)
        return edge.passes(self._engine.level) and not self.blocked(visit, outcome)

    def _suspended(self, node: int) -> bool:
        """Is a container of priority active that is apart from it?"""
        net = self._engine.net
        return any(not net.inside(node, p) and not net.inside(p, node) for p in self._priorities())

    def _priorities(self) -> list[int]:
        """Active containers of priority; of two that are apart, entered at once, the one that is declared first."""
        net, found = self._engine.net, list[int]()
        if not net.has_priority:
            return found
        around = {c for n in self._engine.configuration.active for c in (n, *net.containers(n))}
        for node in sorted(around):
            element = net.nodes[node].element
            if isinstance(element, Group) and element.priority and all(net.inside(node, p) for p in found):
                found.append(node)
        return found
