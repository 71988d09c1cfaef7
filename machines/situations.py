"""Situations of a machine whose programs and people answer from a table, and what may follow each. Nothing is drawn.

A situation is all that the future depends on: active states, what is open or at work there, and the counters of D.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.machines.chances import CONFIRM, REJECT, Alternative, Alternatives, Chances
from teleop_sim.machines.declare import FELL, Machine
from teleop_sim.machines.elements import Group, State
from teleop_sim.machines.net import Configuration
from teleop_sim.machines.remembered import NOTHING, Memory

WORK = "work"
"""Kind of a task that is no request: a program runs."""


class Task(NamedTuple):
    """What goes on in one active state.

    Attributes:
        node: the state.
        kind: ``work``, or that of the request that is open.
        edge, signal: what is suggested and the signal that it came of.
        drawn: place of the alternative that will come; -1: still open. Only concurrent tasks are drawn beforehand.
        left_ns: time until it comes; whole nanoseconds, so that equal times are equal.

    """

    node: int
    kind: str
    edge: int = -1
    signal: str = ""
    drawn: int = -1
    left_ns: int = 0


class Situation(NamedTuple):
    """All that the future depends on."""

    configuration: Configuration
    tasks: tuple[Task, ...]
    memory: Memory = NOTHING


class End(NamedTuple):
    """How it may end: with a state or outcome of the machine, or with what has no way on; ``completed`` as executed."""

    name: str
    completed: bool


FALLEN = End("not recoverable", False)
UNANSWERED = End("nobody answers", False)
NEVER = End("goes on for ever", False)


class Option(NamedTuple):
    """Where a branch leads: next, by which edges, and whether the mode is manual on the way or there."""

    target: Situation | End
    edges: tuple[int, ...]
    manual: bool


class Branch(NamedTuple):
    """One thing that may happen next.

    Attributes:
        chance: of it.
        mean_s, square_s2: mean of the time until then and of its square.
        nodes: states that are at work until then.
        waits: only people are waited for.
        options: where it leads; several only where counters are not followed.

    """

    chance: float
    mean_s: float
    square_s2: float
    nodes: tuple[int, ...]
    waits: bool
    options: tuple[Option, ...]


class Counting(Protocol):
    """How counters are followed, or not."""

    def edges(self, memory: Memory, node: int, signal: str, /) -> tuple[int, ...]:
        """F: edges that a signal may become."""

    def after(self, memory: Memory, edge: int, signal: str, /) -> Memory:
        """U: the counters when an edge has been taken."""

    def manual(self, memory: Memory, node: int, /) -> bool:
        """Is the mode manual there?"""


@dataclass(frozen=True)
class Ways:
    """What may follow a situation at an autonomy level.

    Attributes:
        machine: checked.
        chances: checked against the machine (``refuse_bad_chances``).
        level: 0 to 3; it does not change.
        counting: of D.

    Concurrent tasks race: of those that come at the same nanosecond, the one declared first. Their times must be fixed.
    People answer each request as if it were the only one. While a container of priority is active, answers to requests
    outside it wait, and programs outside it are stopped and begin anew afterwards.

    """

    machine: Machine
    chances: Chances
    level: int
    counting: Counting

    def begin(self) -> Situation:
        """Where the machine begins."""
        start = self.machine.net.begin()
        return Situation(start, self._tasks(start, (), start.active))

    def missing(self, now: Situation) -> tuple[str, ...]:
        """States at work whose programs the table does not know."""
        paths = (self._path(t.node) for t in now.tasks if t.kind == WORK and not self._alternatives(t))
        return tuple(paths)

    def branches(self, now: Situation) -> tuple[Branch, ...]:
        """What may happen next.

        Raises:
            BadInput: times of concurrent tasks vary.

        """
        running = self._running(now)
        if not running:
            return (Branch(1.0, 0.0, 0.0, (), True, (Option(UNANSWERED, (), False),)),)
        if len(running) == 1 and running[0].drawn < 0:
            task = running[0]
            return tuple(
                Branch(
                    a.chance, a.mean_s, a.square_s2, (task.node,), task.kind != WORK, self._come(now, task, a.what)
                )
                for a in self._alternatives(task)
                if a.chance > 0.0
            )  # fmt: skip
        undrawn = next((task for task in running if task.drawn < 0), None)
        return (self._first(now, running),) if undrawn is None else self._drawn(now, undrawn)

    def _running(self, now: Situation) -> tuple[Task, ...]:
        """Tasks of which something can come now."""
        priorities = self._priorities(now.configuration)
        return tuple(t for t in now.tasks if self._alternatives(t) and not self._suspended(t.node, priorities))

    def _priorities(self, now: Configuration) -> frozenset[int]:
        """Active containers of priority."""
        net = self.machine.net
        if not net.has_priority:
            return frozenset()
        around = (c for n in now.active for c in (n, *net.containers(n)))
        return frozenset(c for c in around if isinstance(e := net.nodes[c].element, Group) and e.priority)

    def _suspended(self, node: int, priorities: frozenset[int]) -> bool:
        return any(not self.machine.net.inside(node, p) for p in priorities)

    def _alternatives(self, task: Task) -> Alternatives:
        path = self._path(task.node)
        if task.kind != WORK:
            return self.chances.answers_to(task.kind, path)
        leaf = self.machine.net.nodes[task.node].element
        if isinstance(leaf, State) and leaf.decides:
            return (Alternative(leaf.suggests, 1.0),)
        return self.chances.programs.get(path, ())

    def _drawn(self, now: Situation, task: Task) -> tuple[Branch, ...]:
        """What will come of a concurrent task, and when."""
        found = []
        for place, a in enumerate(self._alternatives(task)):
            if a.sd_s:
                where = f"chances of machine {self.machine.name}: {self._path(task.node)}: {a.what}"
                what = "its time varies, and it races with a concurrent state"
                raise BadInput((Problem(where, what, "Give it a fixed time (sd_s = 0), or several fixed ones."),))
            if a.chance > 0.0:
                drawn = task._replace(drawn=place, left_ns=round(a.mean_s * 1e9))
                target = now._replace(tasks=_swapped(now.tasks, task, drawn))
                found.append(Branch(a.chance, 0.0, 0.0, (), False, (Option(target, (), False),)))
        return tuple(found)

    def _first(self, now: Situation, running: tuple[Task, ...]) -> Branch:
        """The concurrent task of which something comes first."""
        first = min(running, key=lambda task: (task.left_ns, task.node))
        passed_s = first.left_ns * 1e-9
        tasks = tuple(t._replace(left_ns=t.left_ns - first.left_ns) if t in running else t for t in now.tasks)
        task = first._replace(left_ns=0)
        what = self._alternatives(first)[first.drawn].what
        options = self._come(now._replace(tasks=tasks), task, what)
        waits = all(t.kind != WORK for t in running)
        return Branch(1.0, passed_s, passed_s**2, tuple(t.node for t in running), waits, options)

    def _come(self, now: Situation, task: Task, what: str) -> tuple[Option, ...]:
        """Where it leads when that comes of a task."""
        if task.kind == WORK:
            if what == FELL:
                return (Option(FALLEN, (), False),)
            if task.edge >= 0:
                return (self._take(now, task.edge, "", Option(now, (), False)),)
            edges = self.counting.edges(now.memory, task.node, what)
            return tuple(self._raised(now, edge, what, Option(now, (), False)) for edge in edges)
        if what in (CONFIRM, REJECT) and task.edge < 0:
            where = f"chances of machine {self.machine.name}: answers to {task.kind} {self._path(task.node)}"
            raise BadInput((Problem(where, f"{what}, but nothing is suggested", "Name events."),))
        if what == CONFIRM:
            return (self._take(now, task.edge, task.signal, Option(now, (), False)),)
        if what == REJECT:
            return (Option(self._again(now, task.node), (), False),)
        edge = self.machine.edge_index(self._path(task.node), what)
        return (self._take(now, edge, "", Option(now, (), True)),)

    def _again(self, now: Situation, node: int) -> Situation:
        move = self.machine.net.again(now.configuration, node)
        rest = (task for task in now.tasks if task.node != node)
        return Situation(move.configuration, self._tasks(move.configuration, rest, move.entered), now.memory)

    def _raised(self, now: Situation, edge: int, signal: str, so_far: Option) -> Option:
        """An outcome that has come: it passes, or it is suggested."""
        if self.machine.net.edges[edge].passes(self.level):
            return self._take(now, edge, signal, so_far)
        node = self.machine.net.source[edge]
        asked = Task(node, "confirm", edge, signal)
        tasks = tuple(sorted((*(t for t in now.tasks if t.node != node), asked)))
        return so_far._replace(target=now._replace(tasks=tasks))

    def _take(self, now: Situation, edge: int, signal: str, so_far: Option) -> Option:
        net, memory = self.machine.net, self.counting.after(now.memory, edge, signal)
        move = net.move(now.configuration, edge)
        edges = (*so_far.edges, edge)
        end = self._end(move.configuration, net.edges[edge].kind == "command")
        if end is not None:
            return Option(end, edges, so_far.manual)
        rest = (task for task in now.tasks if task.node not in move.left)
        then = Situation(move.configuration, self._tasks(move.configuration, rest, move.entered), memory)
        begun = move.entered if move.raised < 0 else (net.source[move.raised],)
        manual = so_far.manual or any(self.counting.manual(memory, node) for node in begun)
        option = Option(then, edges, manual)
        return self._raised(then, move.raised, "", option) if move.raised >= 0 else option

    def _end(self, configuration: Configuration, command: bool) -> End | None:
        outcome = configuration.outcome
        if outcome:
            return End(outcome, outcome in self.machine.goals)
        found = (self._path(node) for node in configuration.active)
        name = next((path for path in found if path in self.machine.ends), None)
        return None if name is None else End(name, not command)

    def _tasks(self, now: Configuration, rest: Iterable[Task], entered: Iterable[int]) -> tuple[Task, ...]:
        """What goes on, with states that are entered; programs that are suspended have yet to begin."""
        priorities = self._priorities(now)
        rest = (
            t._replace(drawn=-1, left_ns=0) if t.kind == WORK and self._suspended(t.node, priorities) else t
            for t in rest
        )
        return tuple(sorted((*rest, *(Task(node, *self._kind(node)) for node in entered))))

    def _kind(self, node: int) -> tuple[str, int]:
        leaf, net = self.machine.net.nodes[node].element, self.machine.net
        assert isinstance(leaf, State)
        if leaf.manual:
            return "manual", -1
        if not leaf.decides:
            return WORK, -1
        edge = net.number(net.nodes[node].path, leaf.suggests)
        passes = edge is not None and net.edges[edge].passes(self.level)
        return (WORK if passes else "decide"), -1 if edge is None else edge

    def _path(self, node: int) -> str:
        return self.machine.net.nodes[node].path


def _swapped(tasks: tuple[Task, ...], old: Task, new: Task) -> tuple[Task, ...]:
    return tuple(new if task == old else task for task in tasks)
