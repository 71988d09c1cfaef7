"""How often a machine may try: loops that no counter ends, or else the longest way.

An edge is taken again and again only if what raises it comes again and again. A signal that is not counted always may.
A counter's event comes again only if the counter is put back: by a success of its state, or when it is passed over. The
event of full counters comes again only if those fill again that were put back. Edges for which this fails are struck
out until what is left feeds itself or nothing is left (the greatest set that keeps itself going). So a machine without
such loops is sure to come to an end or to a person; a loop that is named is one that no counter is known to end.

A failure (kind ``failed``) that a row gives is taken to come of that row alone.
"""

from __future__ import annotations

from collections.abc import Iterator

from teleop_sim.machines.checks import closure
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import Concurrence, Edge, Row, State
from teleop_sim.machines.net import Configuration, walk
from teleop_sim.machines.remembered import NOTHING, Counted, Memory

Loop = tuple[Edge, ...]
"""Edges one after the other, with paths; the last leads back to where the first begins."""

MOST_STEPS = 20_000
"""Situations that are looked at for the longest way."""


def loops(machine: Machine) -> tuple[Loop, ...]:
    """A shortest loop of each knot of states among which the machine's own programs may go round for ever.

    Being at work (kind ``executing``) is no loop.
    """
    found = []
    for path, _, element in walk(machine.top):
        if not isinstance(element, State):
            inside = (e for e in machine.table if _container(machine, e) == path and e.next_state not in ("", path))
            found += _knots(machine, tuple(e for e in inside if e.raised_by == "code" and e.kind != "executing"))
    return tuple(found)


def _container(machine: Machine, edge: Edge) -> str:
    nodes = machine.net.nodes
    return nodes[nodes[machine.net.by_path[edge.state]].parent].path


def _knots(machine: Machine, edges: tuple[Edge, ...]) -> list[Loop]:
    going, shrunk = edges, True
    while shrunk:
        kept = tuple(e for e in going if _returns(e, going) and _recurs(machine, e, going))
        shrunk, going = kept != going, kept
    found: list[Loop] = []
    covered: set[str] = set()
    for edge in going:
        if edge.state not in covered:
            # Every edge that is left lies on a loop: what it leads to leads back.
            covered |= closure([edge.state], ((e.state, e.next_state) for e in going))
            found.append(_shortest(edge.state, going))
    return found


def _returns(edge: Edge, going: tuple[Edge, ...]) -> bool:
    return edge.state in closure([edge.next_state], ((e.state, e.next_state) for e in going))


def _recurs(machine: Machine, edge: Edge, going: tuple[Edge, ...]) -> bool:
    """Can what raises the edge come again and again, if only these edges are taken again and again?"""
    rows = machine.leaf(edge.state).rows
    here = {e.event for e in going if e.state == edge.state}
    succeeds = any(e.kind == "done" for e in going if e.state == edge.state)
    return edge.event in uncounted(machine, edge.state) or any(
        _row_recurs(row, edge.event, here, succeeds) for row in rows
    )


def uncounted(machine: Machine, path: str) -> tuple[str, ...]:
    """Events that the code of a state may raise as they are."""
    rows = machine.leaf(path).rows
    given = {event for row in rows for event in (*(c.event for c in row.counters), row.failed)}
    counted = {row.signal for row in rows}
    return tuple(
        e.event
        for e in machine.outcomes_of(path)
        if e.raised_by == "code" and e.event not in counted and not (e.kind == "failed" and e.event in given)
    )


def _row_recurs(row: Row, event: str, here: set[str], succeeds: bool) -> bool:
    for place, counter in enumerate(row.counters):
        after = (*(c.event for c in row.counters[place + 1 :] if c.limit), row.failed)
        put_back = (succeeds and not counter.kept) or (counter.clears and any(e in here for e in after))
        if counter.event == event and counter.limit and put_back:
            return True
    fills = all(not c.limit or not c.clears or c.event in here for c in row.counters)
    return row.failed == event and fills


def _shortest(begin: str, edges: tuple[Edge, ...]) -> Loop:
    """The loop through ``begin`` with the fewest edges; of those, by the table's order."""
    front: list[Loop] = [()]
    seen: set[str] = set()
    while True:
        further: list[Loop] = []
        for way in front:
            here = way[-1].next_state if way else begin
            for edge in (e for e in edges if e.state == here):
                if edge.next_state == begin:
                    return (*way, edge)
                if edge.next_state not in seen:
                    seen.add(edge.next_state)
                    further.append((*way, edge))
        front = further


def longest(machine: Machine) -> int | None:
    """Most outcomes in a row that code raises without a loop, with everything passing; containers' outcomes count.

    None: there may be no end, states work at once, or more than ``MOST_STEPS`` situations would have to be looked at.
    """
    if loops(machine) or any(isinstance(n.element, Concurrence) for n in machine.net.nodes):
        return None
    counted = Counted(machine)
    begin = (machine.net.begin(), NOTHING)
    most: dict[tuple[Configuration, Memory], int] = {}
    stack = [(begin, False)]
    while stack:
        now, back = stack.pop()
        if now in most:
            continue
        onward = tuple(_onward(machine, counted, now))
        if back:
            most[now] = max((n + most[then] for n, then in onward), default=0)
            continue
        if len(most) + len(stack) > MOST_STEPS:
            return None
        stack.append((now, True))
        stack += [(then, False) for _, then in onward if then not in most]
    return most[begin]


def _onward(
    machine: Machine, counted: Counted, now: tuple[Configuration, Memory]
) -> Iterator[tuple[int, tuple[Configuration, Memory]]]:
    """What may follow, with the number of outcomes until then."""
    net, (configuration, memory) = machine.net, now
    for node in configuration.active:
        path = net.nodes[node].path
        if path in machine.ends:
            return
        rows = machine.leaf(path).rows
        for signal in (*uncounted(machine, path), *(row.signal for row in rows)):
            (edge,) = counted.edges(memory, node, signal)
            if net.edges[edge].kind == "executing":
                continue
            then, after, taken = configuration, memory, 0
            while edge >= 0:
                after = counted.after(after, edge, signal)
                move = net.move(then, edge)
                then, edge, signal, taken = move.configuration, move.raised, "", taken + 1
            yield taken, (then, after)
