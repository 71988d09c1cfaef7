"""Which outcomes can come, and which states can be reached and left, over all ways through a machine.

``checks`` looks at each container alone and trusts that every outcome comes. Here an outcome comes only if something
raises it: of a state as its edges say, of a container if what is in it can come to it.
"""

from __future__ import annotations

from dataclasses import dataclass

from teleop_sim.machines.checks import closure
from teleop_sim.machines.elements import Concurrence, Edge, Element, Group, State
from teleop_sim.machines.net import join

_MOST_PARKED = 20_000
"""Ways to park the children of a concurrence that are tried; of more, every outcome is taken to come."""


@dataclass(frozen=True)
class Ways:
    """Of a container and all in it.

    Attributes:
        outcomes: that it can come to.
        reached: paths of states that can be reached in it.
        dead: paths of states that can be reached, and from which no way leads out of their container.
        silent: (path of a container, outcome) that never comes.

    """

    outcomes: frozenset[str]
    reached: tuple[str, ...] = ()
    dead: tuple[str, ...] = ()
    silent: tuple[tuple[str, str], ...] = ()


def ways(path: str, element: Element, edges: tuple[Edge, ...], ends: frozenset[str], people: bool) -> Ways:
    """What can come of an element, over all ways.

    Args:
        path: of the element.
        element: state or container.
        edges: of the element itself, from the container around.
        ends: states of the top in which the machine stops.
        people: outcomes that only people raise count too.

    """
    if isinstance(element, State):
        came = (e.event for e in edges if e.raised_by == "code" or (people and e.raised_by == "operator"))
        return Ways(frozenset(came))
    inside = {
        child.name: ways(
            join(path, child.name),
            child,
            tuple(e for e in element.edges if e.state == child.name),
            frozenset(),
            people,
        )
        for child in element.states
    }
    come = tuple(e for e in element.edges if e.event in inside[e.state].outcomes)
    if isinstance(element, Concurrence):
        reached, outcomes = set(inside), _finishes(element, come)
        # Children wait for each other: the whole ends, or all that have no outcome are dead.
        leaving = set(inside) if outcomes else {e.state for e in come}
    else:
        reached = closure([element.start], ((e.state, e.next_state) for e in come if e.state not in ends))
        outcomes = frozenset(element.outcomes) & reached
        leaving = closure((*ends, *element.outcomes), ((e.next_state, e.state) for e in come))
    return _together(path, element, inside, reached, leaving, outcomes)


def _together(
    path: str,
    element: Group | Concurrence,
    inside: dict[str, Ways],
    reached: set[str],
    leaving: set[str],
    outcomes: frozenset[str],
) -> Ways:
    here = tuple(child.name for child in element.states if child.name in reached)
    return Ways(
        outcomes,
        tuple(p for name in here for p in (join(path, name), *inside[name].reached)),
        tuple(p for name in here for p in (*((join(path, name),) * (name not in leaving)), *inside[name].dead)),
        (
            *((path, outcome) for outcome in element.outcomes if outcome not in outcomes),
            *(pair for name in here for pair in inside[name].silent),
        ),
    )


def _finishes(element: Concurrence, come: tuple[Edge, ...]) -> frozenset[str]:
    """Outcomes with which a concurrence can end: every order in which children can be parked is tried."""
    found: dict[str, None] = {}
    seen: dict[frozenset[tuple[str, str]], None] = {frozenset(): None}
    front: list[frozenset[tuple[str, str]]] = [frozenset()]
    while front:
        parked = front.pop()
        done = {name for name, _ in parked}
        for edge in come:
            if edge.state in done:
                continue
            more = parked | {(edge.state, edge.event)}
            outcome = element.outcome(more)
            if outcome:
                found[outcome] = None
            elif more not in seen:
                seen[more] = None
                front.append(more)
        if len(seen) > _MOST_PARKED:
            return frozenset(element.outcomes)
    return frozenset(found)
