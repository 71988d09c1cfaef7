"""Keys and parameters of a machine: is everything that is read written before, somewhere?"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from teleop_sim.core.errors import Problem, unknown_name
from teleop_sim.machines.elements import Concurrence, Edge, Element, Given, Group, State
from teleop_sim.machines.net import walk

if TYPE_CHECKING:
    from teleop_sim.machines.declare import Machine


def key_problems(at: str, top: Group) -> Iterator[Problem]:
    """Keys that nothing can have written when they are read, and keys that a container promises and nothing writes.

    A key counts as written if the container starts with it or some state on some way there writes it: a way on which it
    is not written is found by ``analysis``, not here. Children of a concurrence see nothing of each other.
    """
    for path, _, element in walk(top):
        if isinstance(element, State):
            continue
        at_start = frozenset(key for key, _ in (*element.reads, *element.data))
        known = available(element, at_start)
        spare = element.spare if isinstance(element, Group) else ()
        for child in element.states:
            if child.name in spare:
                continue
            where = f"{at}: {path}/{child.name}" if path else f"{at}: {child.name}"
            for own, key in child.reads:
                if key not in known[child.name]:
                    hint = f"Known there: {', '.join(sorted(known[child.name])) or 'none'}."
                    yield Problem(f"{where}: key {own}", f"{key!r} is read before anything writes it", hint)
        written = at_start | {key for child in element.states for _, key in child.writes}
        for own, _ in element.writes:
            if own not in written:
                where = f"{at}: {path}" if path else at
                yield Problem(
                    f"{where}: key {own}", "nothing inside writes it", "Let a state write it, or start with it."
                )


def available(element: Group | Concurrence, at_start: frozenset[str]) -> dict[str, frozenset[str]]:
    """Keys that may hold something when each child is entered, over all ways there."""
    known = {child.name: at_start for child in element.states}
    if isinstance(element, Concurrence):
        return known
    writes = {child.name: frozenset(key for _, key in child.writes) for child in element.states}
    edges: list[Edge] = [e for e in element.edges if e.state in known and e.next_state in known]
    grown = True
    while grown:
        grown = False
        for edge in edges:
            more = known[edge.next_state] | known[edge.state] | writes[edge.state]
            if more != known[edge.next_state]:
                known[edge.next_state], grown = more, True
    return known


def parameter_problems(at: str, machine: Machine) -> Iterator[Problem]:
    """Doubled parameters, defaults that are no choice, values that stand for no parameter."""
    names = tuple(p.name for p in machine.parameters)
    for p in machine.parameters:
        if names.count(p.name) > 1:
            yield Problem(f"{at}: parameter {p.name}", "is declared twice", "Give each parameter one entry.")
        if p.choices and p.default not in p.choices:
            choices = ", ".join(map(str, p.choices))
            yield Problem(f"{at}: parameter {p.name}", f"{p.default!r} is no choice", f"Give one of {choices}.")
    for path, _, element in walk(machine.top):
        for key, value in _values(element):
            if isinstance(value, Given) and value.parameter not in names:
                yield unknown_name(f"{at}: {path}: {key}", value.parameter, names)


def _values(element: Element) -> tuple[tuple[str, object], ...]:
    return element.parameters if isinstance(element, State) else element.data
