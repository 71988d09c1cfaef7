"""A machine in words, for a terminal: its tree of states, or its 8-tuple."""

from __future__ import annotations

from collections import Counter as Tally
from collections.abc import Iterator

from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import INHERIT, PARKED, Autonomy, Concurrence, Edge, Element, Given, Group, Row, State
from teleop_sim.machines.net import walk
from teleop_sim.machines.plain import THRESHOLDS

COLUMNS = ("states", "containers", "edges", *(THRESHOLDS[n] for n in (*Autonomy, INHERIT)))
"""What ``sizes`` counts; the last five are edges by threshold."""

_TUPLE = (
    ("symbols", "Σ, inputs"),
    ("states", "S, states"),
    ("start", "s0, start"),
    ("transitions", "δ, transitions"),
    ("variables", "D, variables"),
    ("triggers", "F, triggers"),
    ("updates", "U, updates"),
    ("actions", "A, actions"),
)


def sizes(machine: Machine) -> tuple[int, ...]:
    """How much there is, by ``COLUMNS``; containers are not among the states."""
    elements = tuple(node.element for node in machine.net.nodes[1:])
    leaves = sum(isinstance(element, State) for element in elements)
    by_threshold = Tally(edge.threshold for edge in machine.table)
    edges = (len(machine.table), *(by_threshold[n] for n in (*Autonomy, INHERIT)))
    return leaves, len(elements) - leaves, *edges


def describe(machine: Machine) -> Iterator[str]:
    """Lines: the machine, then each state with what runs in it, its outcomes, thresholds, targets and counters."""
    yield f"{machine.name}: checksum {machine.checksum:08x}"
    yield ", ".join(f"{n} {what}" for n, what in zip(sizes(machine), COLUMNS, strict=True))
    outcomes = (f"{name} (success)" if name in machine.goals else name for name in machine.outcomes)
    for label, listed in (
        ("outcomes", outcomes),
        ("ends in", sorted(machine.ends)),
        ("reads", machine.reads),
        ("writes", machine.writes),
        ("parameters", (_parameter(p.name, p.default, p.choices) for p in machine.parameters)),
        ("starts with", _held(machine.data)),
    ):
        words = ", ".join(listed)
        if words:
            yield f"{label}: {words}"
    for path, around, element in walk(machine.top):
        if path:
            container = machine.top if not around else machine.state(around)
            assert not isinstance(container, State)
            yield from _element("  " * path.count("/"), element, container)


def tuple_lines(machine: Machine) -> Iterator[str]:
    """Lines: (Σ, S, s0, δ, D, F, U, A), one entry a line."""
    parts = machine.as_tuple()._asdict()
    for name, label in _TUPLE:
        part = parts[name]
        if isinstance(part, str):
            yield f"{label}: {part}"
            continue
        yield f"{label} ({len(part)}):"
        yield from (f"  {_entry(name, entry)}" for entry in part)


def _entry(name: str, entry: object) -> str:
    match name, entry:
        case "transitions", ((state, event), target):
            return f"({state}, {event}) -> {target}"
        case "triggers" | "updates", (state, signal, listed):
            assert isinstance(listed, tuple)
            return f"({state}, {signal}) -> {', '.join(listed)}"
        case "actions", (state, program):
            return f"{state} -> {program}"
    return str(entry)


def _element(indent: str, element: Element, container: Group | Concurrence) -> Iterator[str]:
    begins = isinstance(container, Group) and container.start == element.name
    facts = [fact for fact in (*_facts(element), "begins here" if begins else "") if fact]
    yield f"{indent}{element.name}" + (f": {'; '.join(facts)}" if facts else "")
    edges = [edge for edge in container.edges if edge.state == element.name]
    width = max((len(edge.event) for edge in edges), default=0)
    for edge in edges:
        yield f"{indent}  - {edge.event:{width}}  {_edge(edge)}"
    if isinstance(element, State):
        yield from (f"{indent}  * {_row(row)}" for row in element.rows)


def _facts(element: Element) -> Iterator[str]:
    if isinstance(element, State):
        yield f"runs {element.program}" if element.program else ""
        yield "a person takes over" if element.manual else ""
        yield "a person decides" if element.decides else ""
        yield f"suggests {element.suggests}" if element.suggests else ""
        yield element.action
        yield f"with {', '.join(_held(element.parameters))}" if element.parameters else ""
    elif isinstance(element, Concurrence):
        ways = [f"{rule.outcome} if {' and '.join(': '.join(need) for need in rule.needs)}" for rule in element.rules]
        ways += [f"otherwise {element.default}"] if element.default else []
        yield f"all at once, ends when {element.finish}: {', '.join(ways)}"
    else:
        yield "suspends all outside" if element.priority else ""
    for label, pairs in (("reads", element.reads), ("writes", element.writes)):
        yield f"{label} {', '.join(own if own == key else f'{own} = {key}' for own, key in pairs)}" if pairs else ""
    if not isinstance(element, State) and element.data:
        yield f"starts with {', '.join(_held(element.data))}"


def _edge(edge: Edge) -> str:
    by = "" if edge.raised_by == "code" else f", raised by {edge.raised_by}"
    to = "parked" if edge.next_state == PARKED else edge.next_state
    return f"{THRESHOLDS[edge.threshold]:7}  {edge.kind:9}  -> {to}{by}" + (f"  ({edge.note})" if edge.note else "")


def _row(row: Row) -> str:
    counters = ", then ".join(
        f"{c.event} {c.limit} times" + ("" if c.clears else " in all") + (" (kept over a success)" if c.kept else "")
        for c in row.counters
    )
    return f"{row.signal}: {counters + ', then ' if counters else ''}{row.failed} (at attempt {row.attempts})"


def _held(data: tuple[tuple[str, object], ...]) -> Iterator[str]:
    for key, value in data:
        yield f"{key} = {f'parameter {value.parameter}' if isinstance(value, Given) else repr(value)}"


def _parameter(name: str, default: object, choices: tuple[object, ...]) -> str:
    return f"{name} = {default!r}" + (f" (one of {', '.join(map(repr, choices))})" if choices else "")
