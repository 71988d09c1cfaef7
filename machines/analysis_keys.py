"""Keys that may be read on some way on which nothing has written them.

A forward analysis of what *must* have been written (Nielson, Nielson and Hankin, Principles of Program Analysis, 1999,
section 2.1: intersection over all ways, greatest fixed point). A state is taken to write all that it declares,
whichever outcome it comes to. What a container starts with counts as written, unless it is nothing (None) and stands in
for what something in the container writes. Forced outcomes of containers are not followed.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from teleop_sim.machines.elements import Concurrence, Element, Group, State
from teleop_sim.machines.net import join

Keys = frozenset[str]


class Unwritten(NamedTuple):
    """A key that may hold nothing when it is read: path of the state, its own name for it, and the container's."""

    path: str
    own: str
    key: str


def unwritten(top: Group) -> tuple[Unwritten, ...]:
    """All of them, by path; keys of the machine itself are taken to be given."""
    found: dict[Unwritten, None] = {}
    _leaves("", top, frozenset(own for own, _ in top.reads), found)
    return tuple(found)


def _leaves(path: str, element: Element, given: Keys, found: dict[Unwritten, None]) -> dict[str, Keys]:
    """Keys of an element that must be written when it is left, by outcome; '' stands for every outcome of a state."""
    if isinstance(element, State):
        return {"": frozenset(own for own, _ in element.writes)}
    later = {key for child in element.states for _, key in child.writes}
    start = given | {key for key, value in element.data if value is not None or key not in later}
    if isinstance(element, Concurrence):
        return _concurrent(path, element, start, found)
    at: dict[str, Keys] = {element.start: start}
    leaves: dict[str, Keys] = {}
    scratch: dict[Unwritten, None] = {}
    front = [element.start]
    children = {child.name: child for child in element.states}
    while front:
        name = front.pop()
        wrote = _child(path, children[name], at[name], scratch)
        for edge in (e for e in element.edges if e.state == name and e.raised_by != "nobody"):
            written = wrote.get("", wrote.get(edge.event))
            # None: the container never comes to this outcome.
            if written is not None:
                into = at if edge.next_state in children else leaves
                before = into.get(edge.next_state)
                after = at[name] | written if before is None else before & (at[name] | written)
                into[edge.next_state] = after
                if into is at and after != before:
                    front.append(edge.next_state)
    for name, known in at.items():
        _child(path, children[name], known, found)
    return leaves


def _child(path: str, child: Element, known: Keys, found: dict[Unwritten, None]) -> dict[str, Keys]:
    """What a child must have written of the container's keys when it is left, by outcome."""
    here = join(path, child.name)
    if isinstance(child, State):
        found.update((Unwritten(here, own, key), None) for own, key in child.reads if key not in known)
        return {"": frozenset(key for _, key in child.writes)}
    given = frozenset(own for own, key in child.reads if key in known)
    wrote = _leaves(here, child, given, found)
    return {event: frozenset(key for own, key in child.writes if own in keys) for event, keys in wrote.items()}


def _concurrent(path: str, element: Concurrence, start: Keys, found: dict[Unwritten, None]) -> dict[str, Keys]:
    wrote = [_common(_child(path, child, start, found).values()) for child in element.states]
    # Unless all must end, only one child is sure to have.
    sure = frozenset[str]().union(*wrote) if element.finish == "all" else _common(wrote)
    return dict.fromkeys(element.outcomes, start | sure)


def _common(sets: Iterable[Keys]) -> Keys:
    found = tuple(sets)
    return found[0].intersection(*found[1:]) if found else frozenset()
