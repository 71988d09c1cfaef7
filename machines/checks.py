"""What can be wrong with a declared machine. Everything is found at once, each with the path of its state."""

from __future__ import annotations

from collections import Counter as Tally
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from teleop_sim.core.errors import BadInput, Problem, unknown_name
from teleop_sim.machines.checks_keys import key_problems, parameter_problems
from teleop_sim.machines.elements import INHERIT, PARKED, Autonomy, Concurrence, Edge, Element, Group, Row, State
from teleop_sim.machines.net import walk

if TYPE_CHECKING:
    from teleop_sim.machines.declare import Machine

MOST_EDGES = 65535
"""An edge's place in the table is sent as one byte or two, and one number says *none*."""

Container = Group | Concurrence


def refuse_bad(machine: Machine) -> None:
    """Raise ``BadInput`` with every problem of the machine, if it has any."""
    found = tuple(problems(machine))
    if found:
        raise BadInput(found)


def problems(machine: Machine) -> Iterator[Problem]:
    """Everything that is wrong.

    Names and doubles, unknown targets, outcomes without a transition, thresholds, counters, states never reached or
    never left, keys read before anything could have written them, parameters.
    """
    yield from _ends(machine)
    at = f"machine {machine.name}"
    for path, _, element in walk(machine.top):
        if isinstance(element, State):
            continue
        where = f"{at}: {path}" if path else at
        yield from _container(where, path, element, machine.ends if not path else frozenset())
    yield from key_problems(at, machine.top)
    yield from parameter_problems(at, machine)


def _ends(machine: Machine) -> Iterator[Problem]:
    at = f"machine {machine.name}"
    names = tuple(s.name for s in machine.states)
    for name in sorted(machine.ends):
        if name not in names:
            yield unknown_name(f"{at}: end", name, names)
    for name in sorted(machine.goals):
        if name not in machine.outcomes:
            yield unknown_name(f"{at}: goal", name, machine.outcomes)
    if not machine.ends and not machine.outcomes:
        yield Problem(f"{at}: ends", "there is none", "Name a state in which the machine stops, or give it outcomes.")
    edges = sum(len(e.edges) for _, _, e in walk(machine.top) if not isinstance(e, State))
    if edges > MOST_EDGES:
        yield Problem(f"{at}: edges", f"{edges} do not fit into two bytes", f"At most {MOST_EDGES}.")


def _doubles(names: Iterable[str]) -> list[str]:
    return [name for name, n in Tally(names).items() if n > 1]


def _container(where: str, path: str, element: Container, ends: frozenset[str]) -> Iterator[Problem]:
    names = tuple(child.name for child in element.states)
    yield from _names(where, element, names)
    for child in element.states:
        here = f"{where}: {child.name}" if not path else f"{where}/{child.name}"
        yield from _child(here, element, child, child.name in ends)
    for edge in element.edges:
        here = f"{where}: {edge.state}: {edge.event}" if not path else f"{where}/{edge.state}: {edge.event}"
        yield from _edge(here, element, edge, names)
    for pair, n in Tally((e.state, e.event) for e in element.edges).items():
        if n > 1:
            yield Problem(
                f"{where}: {': '.join(pair)}", f"{n} edges on one event", "Give each event of a state one edge."
            )
    if isinstance(element, Group):
        yield from _ways(where, element, ends)
        yield from _hasty(where, element)
    else:
        yield from _rules(where, element)


def _names(where: str, element: Container, names: tuple[str, ...]) -> Iterator[Problem]:
    if not names:
        yield Problem(where, "nothing is in it", "Give it at least one state.")
    for name in _doubles(names):
        yield Problem(f"{where}: {name}", "the state is declared twice", "Give each state one entry.")
    for name in names:
        if not name or "/" in name or name.strip() != name:
            yield Problem(
                f"{where}: {name!r}", "cannot be a name", "Names are not empty, hold no '/', and no outer spaces."
            )
    for name in element.outcomes:
        if name in names:
            yield Problem(f"{where}: {name}", "is a state and an outcome", "Call one of them otherwise.")
    for name in _doubles(element.outcomes):
        yield Problem(f"{where}: {name}", "the outcome is declared twice", "Give each outcome one entry.")
    if isinstance(element, Group) and names and element.start not in names:
        yield unknown_name(f"{where}: start or end", element.start, names)


def _child(where: str, container: Container, child: Element, end: bool) -> Iterator[Problem]:
    events = tuple(e.event for e in container.edges if e.state == child.name)
    for outcome in child.outcomes:
        if outcome not in events:
            yield Problem(f"{where}: {outcome}", "the outcome has no transition", "Give it an edge.")
    if child.outcomes:
        for event in events:
            if event not in child.outcomes:
                yield unknown_name(f"{where}: outcome", event, child.outcomes)
    if isinstance(child, State):
        yield from _state(where, child, events, end)


def _state(where: str, state: State, events: tuple[str, ...], end: bool) -> Iterator[Problem]:
    works = (bool(state.program), state.manual, state.decides)
    if sum(works) > 1:
        yield Problem(where, "two of program, manual and decides", "A state runs a program or waits for a person.")
    elif not any(works) and not end:
        yield Problem(where, "nothing runs in it", "Name a program, or make it manual, a decision or an end.")
    if state.suggests and state.suggests not in events:
        yield unknown_name(f"{where}: suggests", state.suggests, events)
    for row in state.rows:
        yield from _row(f"{where}: {row.signal}", row, events)
    for signal in _doubles(row.signal for row in state.rows):
        yield Problem(f"{where}: {signal}", "the signal has two rows", "Give each signal of a state one row.")


def _row(where: str, row: Row, events: tuple[str, ...]) -> Iterator[Problem]:
    named = (*(c.event for c in row.counters), row.failed, *(() if row.signal.startswith("!") else (row.signal,)))
    for event in dict.fromkeys(named):
        if event not in events:
            yield unknown_name(where, event, events)
    for counter in row.counters:
        if counter.limit < 0:
            yield Problem(where, f"limit {counter.limit}", "Give zero or more.")


def _edge(where: str, container: Container, edge: Edge, names: tuple[str, ...]) -> Iterator[Problem]:
    if edge.state not in names:
        yield unknown_name(where, edge.state, names)
    if isinstance(container, Group):
        goals = (*names, *container.outcomes)
        if edge.next_state not in goals:
            yield unknown_name(where, edge.next_state, goals)
    elif edge.next_state != PARKED:
        yield Problem(
            where, f"leads to {edge.next_state}", "In a concurrence an outcome parks the child: lead nowhere."
        )
    inside = next((c for c in container.states if c.name == edge.state), None)
    if not INHERIT <= edge.threshold <= max(Autonomy):
        yield Problem(where, f"threshold {edge.threshold}", "Give -1 (inherit) or 0 to 3 (off, low, high, full).")
    elif isinstance(inside, State) and (edge.threshold == INHERIT) != (edge.kind == "executing"):
        what = f"threshold {edge.threshold} on kind {edge.kind}"
        yield Problem(where, what, "Inherit (-1) is for containers and for kind executing alone.")
    if edge.kind == "executing" and edge.state != edge.next_state:
        yield Problem(where, "kind executing leaves the state", "Only a self-loop can say that the state is at work.")


def _rules(where: str, element: Concurrence) -> Iterator[Problem]:
    pairs = {(e.state, e.event) for e in element.edges}
    for outcome in dict.fromkeys((*(rule.outcome for rule in element.rules), element.default)):
        if outcome not in element.outcomes:
            yield unknown_name(f"{where}: rule or default", outcome, element.outcomes)
    for rule in element.rules:
        for child, event in rule.needs:
            if (child, event) not in pairs:
                yield unknown_name(
                    f"{where}: rule for {rule.outcome}", f"{child}: {event}", tuple(map(": ".join, pairs))
                )


def closure(begin: Iterable[str], steps: Iterable[tuple[str, str]]) -> set[str]:
    """Everything that can be reached from ``begin`` by steps (from, to)."""
    onward: dict[str, list[str]] = {}
    for a, b in steps:
        onward.setdefault(a, []).append(b)
    seen: set[str] = set()
    front = list(begin)
    while front:
        here = front.pop()
        if here not in seen:
            seen.add(here)
            front += onward.get(here, ())
    return seen


def _ways(where: str, group: Group, ends: frozenset[str]) -> Iterator[Problem]:
    steps = tuple((e.state, e.next_state) for e in group.edges)
    reached = closure([group.start], steps)
    for name in group.spare:
        if name not in {child.name for child in group.states}:
            yield unknown_name(f"{where}: spare", name, tuple(child.name for child in group.states))
        elif name in reached:
            yield Problem(f"{where}: spare: {name}", "is reached from the start", "Take it from the spare ones.")
    reached |= closure(group.spare, steps)
    leads_out = closure((*ends, *group.outcomes), ((b, a) for a, b in steps))
    for child in group.states:
        here = f"{where}: {child.name}" if not group.name else f"{where}/{child.name}"
        if child.name not in reached:
            yield Problem(here, "unreachable from the start", "Give an edge that leads to it.")
        if child.name not in leads_out:
            yield Problem(here, "no way out", "Give edges that lead to an end, or make it one.")


def _hasty(where: str, group: Group) -> Iterator[Problem]:
    """Decisions whose suggestions lead round in a circle: they would pass again and again without any time going by."""
    suggests = {s.name: s.suggests for s in group.states if isinstance(s, State) and s.decides and s.suggests}
    leads = {
        e.state: e.next_state
        for e in group.edges
        if suggests.get(e.state) == e.event and e.next_state in suggests and e.threshold < max(Autonomy)
    }
    for name in leads:
        seen, here = {name}, leads[name]
        while here in leads and here not in seen:
            seen.add(here)
            here = leads[here]
        if here == name:
            at = f"{where}: {name}" if not group.name else f"{where}/{name}"
            hint = "Let the suggestion wait for a person (threshold full), or put a state with a program between."
            yield Problem(at, "its suggestion leads back to it through decisions alone, in no time", hint)
