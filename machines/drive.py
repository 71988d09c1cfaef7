"""Runs a machine without a clock: the bare engine, with times added up.

It is for the many runs of event-only studies: 10^5 runs of the dish machine take minutes.
"""

from __future__ import annotations

from dataclasses import dataclass
from heapq import heappop, heappush
from typing import Literal

from teleop_sim.machines.chances import CONFIRM, REJECT
from teleop_sim.machines.declare import FELL, Machine
from teleop_sim.machines.elements import State
from teleop_sim.machines.engine import Engine
from teleop_sim.machines.stub import Crew, Robot


@dataclass(frozen=True, slots=True)
class Driven:
    """How a run without a clock went.

    Attributes:
        end: ``completed``, ``failed`` (with another outcome, by a person's command, or the robot fell), ``waits`` (for
            an answer that nobody gives) or ``cut`` (too many transitions).
        state: where it ended: paths joined by `` + ``, or the machine's outcome.
        time_s: when [s].
        taken: edges by number, in order.
        answers: requests that were answered.
        unanswered: paths of the states and containers that wait for an answer that nobody gives.

    """

    end: Literal["completed", "failed", "waits", "cut"]
    state: str
    time_s: float
    taken: tuple[int, ...]
    answers: int
    unanswered: tuple[str, ...] = ()


def drive(machine: Machine, level: int, robot: Robot, crew: Crew, most: int = 100_000) -> Driven:
    """Run a machine until it ends or nobody answers.

    States at work at the same time work beside each other; what is due at one instant comes in the order in which it
    was begun. The level stays as it is. Not modelled: keys, locks, pauses, priority containers that suspend others.

    Args:
        machine: what to run.
        level: autonomy level, 0 to 3.
        robot: asked at the beginning of each attempt.
        crew: asked when a request arises.
        most: transitions, after which the run is cut.

    Raises:
        BadInput: the level is none, or the robot answers what the machine does not know.
        UnknownName: the crew forces an event that the state does not have.

    """
    run = _Drive(machine, level, robot, crew)
    return run.go(most)


@dataclass(frozen=True, slots=True)
class _Due:
    """What comes of a visit: a program's signal, or a person's answer to the edge that was suggested (-1: none)."""

    node: int
    visit: int
    what: str
    answer: bool = False
    edge: int = -1
    signal: str = ""


class _Drive:
    """A run under way. A visit is the number under which a node was entered last; what is due for another is void."""

    def __init__(self, machine: Machine, level: int, robot: Robot, crew: Crew) -> None:
        self._engine, self._robot, self._crew = Engine(machine, level), robot, crew
        self._agenda: list[tuple[float, int, _Due]] = []
        self._visits: dict[int, int] = {}
        self._alone: dict[int, int] = {}
        self._count = self._answers = 0
        self._now_s = 0.0
        self._taken: list[int] = []
        self._fell = False

    def go(self, most: int) -> Driven:
        engine = self._engine
        for node in engine.configuration.active:
            self._begin(node)
        while self._agenda and len(self._taken) < most and not (self._fell or engine.over()):
            due_s, _, due = heappop(self._agenda)
            if self._visits.get(due.node) == due.visit:
                self._now_s = due_s
                self._come(due)
        now = engine.configuration
        state = " + ".join(engine.net.nodes[n].path for n in now.active) or now.outcome
        unanswered = tuple(engine.net.nodes[n].path for n, visit in self._alone.items() if self._visits.get(n) == visit)
        return Driven(self._end(), state, self._now_s, tuple(self._taken), self._answers, unanswered)

    def _end(self) -> Literal["completed", "failed", "waits", "cut"]:
        engine, machine = self._engine, self._engine.machine
        if self._fell:
            return "failed"
        if not engine.over():
            return "cut" if self._agenda else "waits"
        outcome = engine.configuration.outcome
        by_command = bool(self._taken) and engine.net.edges[self._taken[-1]].kind == "command"
        if outcome:
            return "completed" if outcome in machine.goals else "failed"
        return "failed" if by_command else "completed"

    def _push(
        self, node: int, after_s: float, what: str, answer: bool = False, edge: int = -1, signal: str = ""
    ) -> None:
        self._count += 1
        due = _Due(node, self._visits[node], what, answer, edge, signal)
        heappush(self._agenda, (self._now_s + after_s, self._count, due))

    def _begin(self, node: int) -> None:
        self._count += 1
        self._visits[node] = self._count
        here = self._engine.net.nodes[node]
        if here.path in self._engine.machine.ends:
            return
        state = here.element
        assert isinstance(state, State)
        if state.decides:
            edge = self._engine.net.number(here.path, state.suggests)
            self._guard(node, -1 if edge is None else edge, state.suggests, "decide")
        elif state.program:
            reply = self._robot(here.path, state.program)
            self._push(node, reply.time_s, reply.what)
        else:
            self._ask(node, "manual", -1, "")

    def _come(self, due: _Due) -> None:
        path = self._engine.net.nodes[due.node].path
        if not due.answer:
            if due.what == FELL:
                self._fell = True
            elif due.edge >= 0:
                self._take(due.edge, due.signal)
            else:
                self._guard(due.node, self._engine.trigger(path, due.what), due.what, "confirm")
            return
        self._answers += 1
        if due.what == CONFIRM and due.edge >= 0:
            self._take(due.edge, due.signal)
        elif due.what == REJECT:
            self._again(due.node)
        else:
            self._take(self._engine.machine.edge_index(path, due.what), "")

    def _guard(self, node: int, edge: int, signal: str, kind: str) -> None:
        """Let an outcome pass at once, or ask."""
        if edge >= 0 and self._engine.passes(edge):
            self._push(node, 0.0, signal, edge=edge, signal=signal)
        else:
            self._ask(node, kind, edge, signal)

    def _ask(self, node: int, kind: str, edge: int, signal: str) -> None:
        net = self._engine.net
        event = net.edges[edge].event if edge >= 0 else ""
        reply = self._crew(kind, net.nodes[node].path, event)
        if reply is None:
            self._alone[node] = self._visits[node]
        else:
            self._push(node, reply.time_s, reply.what, answer=True, edge=edge, signal=signal)

    def _again(self, node: int) -> None:
        """What was suggested is refused: the state, or all that is in the container, begins anew."""
        entered: tuple[int, ...] = (node,)
        if not isinstance(self._engine.net.nodes[node].element, State):
            del self._visits[node]
            entered = self._engine.again(node).entered
        for begun in entered:
            self._begin(begun)

    def _take(self, edge: int, signal: str) -> None:
        self._taken.append(edge)
        move = self._engine.take(edge, signal)
        for node in move.left:
            self._visits.pop(node, None)
        if self._engine.over():
            return
        if move.raised >= 0:
            node = self._engine.net.source[move.raised]
            self._count += 1
            self._visits[node] = self._count
            self._guard(node, move.raised, "", "confirm")
        for node in move.entered:
            self._begin(node)
