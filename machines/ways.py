"""The shortest way through a machine: with which outcome each state comes nearest to the goal.

It gives table robots and automatic crews something sensible to answer. It is no plan: it knows no times and no chances.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import Concurrence, Edge, Element, Group, State
from teleop_sim.machines.net import join, walk

_DETOUR = 1000
"""What an outcome costs that is no success, in outcomes: more than any machine here has states."""


def way(machine: Machine) -> dict[str, str]:
    """By path of each state and container, the outcome that leads soonest to the goal.

    Goals are the machine's ends and goals; of a container, the outcomes that are a success for the container around,
    or any if none is. Successes and decisions count one, other outcomes only where there is no other way. Of a manual
    state it is the first outcome that leads there at all. States from which nothing leads there have the first outcome.
    """
    found: dict[str, str] = {}
    goals = {"": machine.ends | machine.goals}
    for path, _, element in walk(machine.top):
        if isinstance(element, State):
            continue
        chosen = _group(element, goals[path]) if isinstance(element, Group) else _concurrence(element)
        for child in element.states:
            here = join(path, child.name)
            if child.name in chosen:
                found[here] = chosen[child.name].event
            if not isinstance(child, State):
                good = {e.event for e in element.edges if e.state == child.name and e.kind == "done"}
                goals[here] = frozenset(good or child.outcomes)
    return found


def _group(group: Group, goals: frozenset[str]) -> dict[str, Edge]:
    far = {name: 0 if name in goals else math.inf for name in (*(s.name for s in group.states), *group.outcomes)}
    edges = {child.name: tuple(_usable(group, child)) for child in group.states}
    manual = tuple(s.name for s in group.states if isinstance(s, State) and s.manual)
    chosen = {name: some[0] for name, some in edges.items() if some}
    grown = True
    while grown:
        _approach({name: some for name, some in edges.items() if name not in manual}, far, chosen)
        grown = False
        # People are asked last: what they may choose among is known then.
        for name in manual:
            first = next((e for e in edges[name] if far[e.next_state] < math.inf), None)
            if far[name] == math.inf and first is not None:
                far[name], chosen[name], grown = _cost(first) + far[first.next_state], first, True
    return chosen


def _approach(edges: dict[str, tuple[Edge, ...]], far: dict[str, float], chosen: dict[str, Edge]) -> None:
    """Shorten ways until none is shorter (Bellman and Ford)."""
    changed = True
    while changed:
        changed = False
        for name, some in edges.items():
            for edge in some:
                if far[name] > (length := _cost(edge) + far[edge.next_state]):
                    far[name], chosen[name], changed = length, edge, True


def _cost(edge: Edge) -> int:
    return 1 if edge.kind in ("done", "command") else _DETOUR


def _usable(container: Group | Concurrence, child: Element) -> Iterator[Edge]:
    """What a program may signal, or a person choose."""
    person = isinstance(child, State) and (child.manual or child.decides)
    for edge in container.edges:
        if edge.state == child.name and edge.kind != "executing" and (person or edge.raised_by == "code"):
            yield edge


def _concurrence(concurrence: Concurrence) -> dict[str, Edge]:
    chosen = {}
    for child in concurrence.states:
        edges = tuple(_usable(concurrence, child))
        best = next((e for e in edges if e.kind == "done"), next(iter(edges), None))
        if best is not None:
            chosen[child.name] = best
    return chosen
