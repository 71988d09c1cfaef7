"""What can be wrong with a declared machine. Everything is found at once."""

from __future__ import annotations

from collections import Counter as Tally
from collections.abc import Iterable, Iterator

from teleop_sim.core.errors import BadInput, Problem, unknown_name
from teleop_sim.machines.declare import INHERIT, Autonomy, Edge, Machine, Row

MOST_EDGES = 256
"""An edge's place in the table is sent as one byte."""


def refuse_bad(machine: Machine) -> None:
    """Raise ``BadInput`` with every problem of the machine, if it has any."""
    found = tuple(problems(machine))
    if found:
        raise BadInput(found)


def problems(machine: Machine) -> Iterator[Problem]:
    """Everything that is wrong: names, doubles, thresholds, counters, states never reached or never left."""
    yield from _names(machine)
    for edge in machine.edges:
        yield from _edge(machine, edge)
    for state in machine.states:
        for row in state.rows:
            yield from _row(machine, state.name, row)
    yield from _ways(machine)


def _at(machine: Machine, *path: str) -> str:
    return f"machine {machine.name}: " + ": ".join(path)


def _doubles(names: Iterable[str]) -> list[str]:
    return [name for name, n in Tally(names).items() if n > 1]


def _names(machine: Machine) -> Iterator[Problem]:
    names = tuple(s.name for s in machine.states)
    for name in _doubles(names):
        yield Problem(_at(machine, name), "the state is declared twice", "Give each state one entry.")
    for state in machine.states:
        if not (state.program or state.manual or state.name in machine.ends):
            yield Problem(
                _at(machine, state.name), "nothing runs in it", "Name a program, or make it manual or an end."
            )
    for name in (machine.start, *sorted(machine.ends)):
        if name not in names:
            yield unknown_name(_at(machine, "start or end"), name, names)
    if not machine.ends:
        yield Problem(_at(machine, "ends"), "there is none", "Name at least one state in which the machine stops.")
    if len(machine.edges) > MOST_EDGES:
        yield Problem(_at(machine, "edges"), f"{len(machine.edges)} do not fit into one byte", f"At most {MOST_EDGES}.")
    for pair, n in Tally((e.state, e.event) for e in machine.edges).items():
        if n > 1:
            yield Problem(_at(machine, *pair), f"{n} edges on one event", "Give each event of a state one edge.")


def _edge(machine: Machine, edge: Edge) -> Iterator[Problem]:
    names = tuple(s.name for s in machine.states)
    where = _at(machine, edge.state, edge.event)
    for name in dict.fromkeys((edge.state, edge.next_state)):
        if name not in names:
            yield unknown_name(where, name, names)
    if not INHERIT <= edge.threshold <= max(Autonomy):
        yield Problem(where, f"threshold {edge.threshold}", "Give -1 (inherit) or 0 to 3 (off, low, high, full).")
    elif (edge.threshold == INHERIT) != (edge.kind == "executing"):
        yield Problem(
            where, f"threshold {edge.threshold} on kind {edge.kind}", "Inherit (-1) is for kind executing alone."
        )
    if edge.kind == "executing" and edge.state != edge.next_state:
        yield Problem(where, "kind executing leaves the state", "Only a self-loop can say that the state is at work.")


def _row(machine: Machine, state: str, row: Row) -> Iterator[Problem]:
    where = _at(machine, state, row.signal)
    events = tuple(e.event for e in machine.edges if e.state == state)
    named = (*(c.event for c in row.counters), row.failed, *(() if row.signal.startswith("!") else (row.signal,)))
    for event in dict.fromkeys(named):
        if event not in events:
            yield unknown_name(where, event, events)
    for counter in row.counters:
        if counter.limit < 0:
            yield Problem(where, f"limit {counter.limit}", "Give zero or more.")
    signals = [r.signal for s in machine.states if s.name == state for r in s.rows]
    if signals.count(row.signal) > 1:
        yield Problem(where, "the signal has two rows", "Give each signal of a state one row.")


def _closure(begin: Iterable[str], steps: Iterable[tuple[str, str]]) -> set[str]:
    seen, pairs = set(begin), tuple(steps)
    while new := {b for a, b in pairs if a in seen and b not in seen}:
        seen |= new
    return seen


def _ways(machine: Machine) -> Iterator[Problem]:
    steps = tuple((e.state, e.next_state) for e in machine.edges)
    reached = _closure([machine.start], steps)
    leads_out = _closure(machine.ends, ((b, a) for a, b in steps))
    for state in machine.states:
        if state.name not in reached:
            yield Problem(_at(machine, state.name), "unreachable from the start", "Give an edge that leads to it.")
        if state.name not in leads_out:
            yield Problem(_at(machine, state.name), "no way out", "Give edges that lead to an end, or make it one.")
