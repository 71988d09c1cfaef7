"""A machine flattened: nodes and edges by number, and what taking an edge does to the active states. No clock.

Both sites use this: the executive to run a machine, the mirror to follow it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from teleop_sim.machines.elements import PARKED, Concurrence, Edge, Element, Group, State

TOP = 0
_MEMO_MOST = 65536
"""Moves that are remembered; more than any machine here has."""


@dataclass(frozen=True, slots=True)
class Node:
    """A state or container.

    Attributes:
        number: its place among the nodes.
        path: empty for the top.
        parent: number of the container around; -1 for the top.
        end: one past the last number inside it.
        element: what is declared.
        entry: numbers of the states that are entered with it.

    """

    number: int
    path: str
    parent: int
    end: int
    element: Element
    entry: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Configuration:
    """Where a machine is.

    Attributes:
        active: numbers of the states at work, ascending; a container among them has ended inside and waits to be left.
        parked: numbers of the edges with which children of active concurrences have ended, ascending.
        outcome: of the whole machine, when it has ended with one.

    """

    active: tuple[int, ...]
    parked: tuple[int, ...] = ()
    outcome: str = ""


@dataclass(frozen=True, slots=True)
class Move:
    """What taking an edge does.

    Attributes:
        configuration: afterwards.
        left, entered: numbers of states, ascending.
        raised: number of the edge that a container has come to by it, else -1.

    """

    configuration: Configuration
    left: tuple[int, ...]
    entered: tuple[int, ...]
    raised: int = -1


@dataclass(frozen=True)
class Net:
    """Numbers for everything.

    Attributes:
        nodes: the top, then in the order of declaration, a container before what is in it.
        edges: with paths; those of a container together, an outer container's before an inner's.
        source: by edge, number of the node that it belongs to.
        target: by edge, number of the node that it enters, or -1.
        leads_to: by edge, the outcome of the container that it leads to; empty if it enters a node or parks.
        by_path: numbers of nodes.
        by_event: numbers of edges by (path, event).

    """

    nodes: tuple[Node, ...]
    edges: tuple[Edge, ...]
    source: tuple[int, ...]
    target: tuple[int, ...]
    leads_to: tuple[str, ...]
    by_path: Mapping[str, int]
    by_event: Mapping[tuple[str, str], int]
    # Moves are pure: remembering them changes nothing but the time.
    _moves: dict[tuple[Configuration, int], Move] = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def has_priority(self) -> bool:
        """Is any container one of priority?"""
        return any(isinstance(node.element, Group) and node.element.priority for node in self.nodes)

    def number(self, path: str, event: str) -> int | None:
        """Number of an edge; None if there is none."""
        return self.by_event.get((path, event))

    def begin(self) -> Configuration:
        """Where a machine begins."""
        return Configuration(self.nodes[TOP].entry)

    def inside(self, node: int, container: int) -> bool:
        """Is the node the container or in it?"""
        return container <= node < self.nodes[container].end

    def on_path(self, configuration: Configuration, node: int) -> bool:
        """Is the node active, or something in it?"""
        return node in configuration.active or any(self.inside(active, node) for active in configuration.active)

    def containers(self, node: int) -> Iterator[int]:
        """The containers around a node, inner first, without the top."""
        while (node := self.nodes[node].parent) > TOP:
            yield node

    def move(self, configuration: Configuration, edge: int) -> Move:
        """What taking an edge does. Its node must be on the active path."""
        found = self._moves.get((configuration, edge))
        if found is None:
            if len(self._moves) >= _MEMO_MOST:
                self._moves.clear()
            found = self._moves[configuration, edge] = self._move(configuration, edge)
        return found

    def again(self, configuration: Configuration, node: int) -> Move:
        """Enter a container anew that has ended inside."""
        rest = tuple(n for n in configuration.active if n != node)
        entered = self.nodes[node].entry
        return Move(replace(configuration, active=_merged(rest, entered)), (node,), entered)

    def _move(self, before: Configuration, edge: int) -> Move:
        source = self.source[edge]
        left, now = self._without(before, source)
        if self.target[edge] >= 0:
            entered = self.nodes[self.target[edge]].entry
            return Move(replace(now, active=_merged(now.active, entered)), left, entered)
        container, outcome = self.nodes[source].parent, self.leads_to[edge]
        if not outcome:
            now = replace(now, parked=_merged(now.parked, (edge,)))
            outcome = self._finished(container, now.parked)
            if not outcome:
                return Move(now, left, ())
        more, now = self._without(now, container)
        if container == TOP:
            return Move(replace(now, outcome=outcome), _merged(left, more), ())
        raised = self.by_event[self.nodes[container].path, outcome]
        return Move(replace(now, active=_merged(now.active, (container,))), _merged(left, more), (), raised)

    def _without(self, now: Configuration, node: int) -> tuple[tuple[int, ...], Configuration]:
        """What is left with a node, and what is then."""
        end = self.nodes[node].end
        left = tuple(n for n in now.active if node <= n < end)
        active = tuple(n for n in now.active if not node <= n < end)
        parked = tuple(e for e in now.parked if not node <= self.source[e] < end)
        return left, replace(now, active=active, parked=parked)

    def _finished(self, container: int, parked: tuple[int, ...]) -> str:
        """The outcome with which a concurrence ends; empty if it goes on."""
        element = self.nodes[container].element
        assert isinstance(element, Concurrence)
        here = tuple(e for e in parked if self.nodes[self.source[e]].parent == container)
        return element.outcome((self.nodes[self.source[e]].element.name, self.edges[e].event) for e in here)


def compile_net(top: Group) -> Net:
    """Flatten a checked machine."""
    nodes = _numbered(top)
    by_path = {node.path: node.number for node in nodes}
    edges: list[Edge] = []
    target: list[int] = []
    leads_to: list[str] = []
    for node in nodes:
        if isinstance(node.element, State):
            continue
        siblings = {child.name for child in node.element.states}
        for edge in node.element.edges:
            enters = edge.next_state in siblings
            path = join(node.path, edge.next_state) if enters else edge.next_state
            if not enters and edge.next_state != PARKED and node.path:
                path = node.path
            target.append(by_path[path] if enters else -1)
            leads_to.append("" if enters else edge.next_state)
            edges.append(replace(edge, state=join(node.path, edge.state), next_state=path))
    return Net(
        nodes=nodes,
        edges=tuple(edges),
        source=tuple(by_path[edge.state] for edge in edges),
        target=tuple(target),
        leads_to=tuple(leads_to),
        by_path=by_path,
        by_event={(edge.state, edge.event): i for i, edge in enumerate(edges)},
    )


def join(container: str, name: str) -> str:
    """Path of a child."""
    return f"{container}/{name}" if container else name


def walk(element: Element, path: str = "", parent: str = "") -> Iterator[tuple[str, str, Element]]:
    """A container and everything in it, as (path, path of the container around, element), outer first."""
    yield path, parent, element
    if not isinstance(element, State):
        for child in element.states:
            yield from walk(child, join(path, child.name), path)


def _numbered(top: Group) -> tuple[Node, ...]:
    walked = tuple(walk(top))
    number = {path: i for i, (path, _, _) in enumerate(walked)}
    nodes = []
    for i, (path, parent, element) in enumerate(walked):
        end = i + sum(1 for _ in walk(element))
        nodes.append(Node(i, path, number[parent] if i else -1, end, element, _entry(number, path, element)))
    return tuple(nodes)


def _entry(number: Mapping[str, int], path: str, element: Element) -> tuple[int, ...]:
    if isinstance(element, State):
        return (number[path],)
    enter = (c for c in element.states if isinstance(element, Concurrence) or c.name == element.start)
    return tuple(sorted(n for child in enter for n in _entry(number, join(path, child.name), child)))


def _merged(a: tuple[int, ...], b: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(sorted((*a, *b))) if a else b
