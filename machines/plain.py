"""Machines as plain tables, texts and numbers, and back: what a TOML file and a patch on the link are made of.

What equals its default is left out. Keys are called as the attributes of ``elements`` and ``declare.Machine``, but for
``to``, an edge's next state (none in a concurrence, where an outcome parks the child). An element with ``finish`` is a
concurrence, one with ``states`` a group, any other a state. A threshold is one of ``THRESHOLDS``. A value that is unset
is ``{none = true}``, one that stands for a parameter ``{given = "name"}``. Reading runs nothing of what it reads.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from types import MappingProxyType
from typing import cast, get_args

from teleop_sim.core.errors import Problem
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import (
    INHERIT,
    Autonomy,
    Concurrence,
    Counter,
    Edge,
    Element,
    Finish,
    Given,
    Group,
    Kind,
    Parameter,
    RaisedBy,
    Row,
    Rule,
    State,
    Value,
)
from teleop_sim.machines.plain_table import Plain, Table

THRESHOLDS = MappingProxyType({INHERIT: "inherit"} | {int(level): level.name.lower() for level in Autonomy})
"""Names of thresholds."""


def machine_plain(machine: Machine) -> Plain:
    """Everything of a machine."""
    return _short(
        name=machine.name,
        start=machine.start,
        outcomes=list(machine.outcomes),
        goals=sorted(machine.goals),
        ends=sorted(machine.ends),
        reads=list(machine.reads),
        writes=list(machine.writes),
        spare=list(machine.spare),
        parameters=[_parameter_plain(p) for p in machine.parameters],
        data=_pairs_plain(machine.data, value_plain),
        edges=[edge_plain(edge) for edge in machine.edges],
        states=[element_plain(element) for element in machine.states],
    )


def read_machine(table: Table) -> Machine | None:
    """Inverse of ``machine_plain``; None if the table is wrong, which it then says.

    Raises:
        BadInput: the table is well-formed but the checks refuse the machine.

    """
    fields = {
        "name": table.text("name", None),
        "start": table.text("start", None),
        "outcomes": table.texts("outcomes"),
        "goals": frozenset(table.texts("goals")),
        "ends": frozenset(table.texts("ends")),
        "reads": table.texts("reads"),
        "writes": table.texts("writes"),
        "spare": table.texts("spare"),
    }
    parameters = tuple(_read_parameter(inner) for inner in table.tables("parameters"))
    data, edges, states = table.holdings("data"), read_edges(table), read_elements(table)
    table.close()
    if table.problems:
        return None
    make = cast(Callable[..., Machine], Machine)
    return make(**fields, parameters=parameters, data=data, edges=edges, states=states)


def edge_plain(edge: Edge) -> Plain:
    """An edge of a container."""
    kind, raised_by = edge.kind.replace("done", ""), edge.raised_by.replace("code", "")
    return {"state": edge.state, "event": edge.event} | _short(
        to=edge.next_state,
        threshold=THRESHOLDS[edge.threshold],
        kind=kind,
        raised_by=raised_by,
        note=edge.note,
    )


def read_edge(table: Table) -> Edge:
    """Inverse of ``edge_plain``."""
    edge = Edge(
        state=table.text("state", None),
        event=table.text("event", None),
        next_state=table.text("to"),
        threshold=read_threshold(table),
        kind=cast(Kind, table.choice("kind", get_args(Kind), "done")),
        raised_by=cast(RaisedBy, table.choice("raised_by", get_args(RaisedBy), "code")),
        note=table.text("note"),
    )
    table.close()
    return edge


def read_threshold(table: Table) -> int:
    """A threshold by its name."""
    named = {name: number for number, name in THRESHOLDS.items()}
    return named[table.choice("threshold", tuple(named), None)]


def read_edges(table: Table) -> tuple[Edge, ...]:
    """The edges of a container."""
    return tuple(read_edge(inner) for inner in table.tables("edges"))


def element_plain(element: Element) -> Plain:
    """A state or container with all that is in it."""
    if isinstance(element, State):
        return _state_plain(element)
    plain = _short(
        name=element.name,
        outcomes=list(element.outcomes),
        reads=_pairs_plain(element.reads),
        writes=_pairs_plain(element.writes),
        data=_pairs_plain(element.data, value_plain),
    )
    if isinstance(element, Group):
        plain |= _short(start=element.start, priority=element.priority, spare=list(element.spare))
    else:
        rules = [{"outcome": rule.outcome, "needs": _pairs_plain(rule.needs)} for rule in element.rules]
        plain |= _short(finish=element.finish, default=element.default, rules=rules)
    return plain | {
        "edges": [edge_plain(edge) for edge in element.edges],
        "states": [element_plain(child) for child in element.states],
    }


def read_elements(table: Table) -> tuple[Element, ...]:
    """The states and containers of a container."""
    return tuple(read_element(inner) for inner in table.tables("states"))


def read_element(table: Table) -> Element:
    """Inverse of ``element_plain``."""
    if "finish" in table:
        made: Element = _read_concurrence(table)
    elif "states" in table:
        made = _read_group(table)
    else:
        made = _read_state(table)
    table.close()
    return made


def _read_group(table: Table) -> Group:
    return Group(
        name=table.text("name", None),
        start=table.text("start", None),
        states=read_elements(table),
        edges=read_edges(table),
        outcomes=table.texts("outcomes"),
        reads=table.names("reads"),
        writes=table.names("writes"),
        data=table.holdings("data"),
        priority=table.flag("priority"),
        spare=table.texts("spare"),
    )


def _read_concurrence(table: Table) -> Concurrence:
    return Concurrence(
        name=table.text("name", None),
        states=read_elements(table),
        edges=read_edges(table),
        outcomes=table.texts("outcomes"),
        finish=cast(Finish, table.choice("finish", get_args(Finish), None)),
        rules=tuple(_read_rule(inner) for inner in table.tables("rules")),
        default=table.text("default"),
        reads=table.names("reads"),
        writes=table.names("writes"),
        data=table.holdings("data"),
    )


def _read_rule(table: Table) -> Rule:
    rule = Rule(table.text("outcome", None), table.names("needs"))
    table.close()
    return rule


def _state_plain(state: State) -> Plain:
    return _short(
        name=state.name,
        program=state.program,
        manual=state.manual,
        decides=state.decides,
        suggests=state.suggests,
        action=state.action,
        outcomes=list(state.outcomes),
        reads=_pairs_plain(state.reads),
        writes=_pairs_plain(state.writes),
        parameters=_pairs_plain(state.parameters, value_plain),
        rows=[_row_plain(row) for row in state.rows],
    )


def _read_state(table: Table) -> State:
    return State(
        name=table.text("name", None),
        program=table.text("program"),
        rows=tuple(_read_row(inner) for inner in table.tables("rows")),
        manual=table.flag("manual"),
        action=table.text("action"),
        decides=table.flag("decides"),
        suggests=table.text("suggests"),
        reads=table.names("reads"),
        writes=table.names("writes"),
        parameters=table.holdings("parameters"),
        outcomes=table.texts("outcomes"),
    )


def _row_plain(row: Row) -> Plain:
    counters = [
        {"limit": c.limit, "event": c.event} | ({} if c.clears else {"clears": False}) | _short(kept=c.kept)
        for c in row.counters
    ]
    return {"signal": row.signal, "counters": counters, "failed": row.failed}


def _read_row(table: Table) -> Row:
    counters = tuple(_read_counter(inner) for inner in table.tables("counters"))
    row = Row(table.text("signal", None), counters, table.text("failed", None))
    table.close()
    return row


def _read_counter(table: Table) -> Counter:
    counter = Counter(table.number("limit"), table.text("event", None), table.flag("clears", True), table.flag("kept"))
    table.close()
    return counter


def _parameter_plain(parameter: Parameter) -> Plain:
    plain: Plain = {"name": parameter.name, "default": value_plain(parameter.default)}
    return plain | _short(choices=[value_plain(choice) for choice in parameter.choices])


def _read_parameter(table: Table) -> Parameter:
    default, choices = table.value("default"), table.values("choices")
    if any(isinstance(value, Given) for value in (default, *choices)):
        table.problems.append(Problem(table.where, "stands for a parameter", "Give the parameter a value of its own."))
    parameter = Parameter(table.text("name", None), cast(Value, default), cast(tuple[Value, ...], choices))
    table.close()
    return parameter


def value_plain(value: Value | Given) -> object:
    """What a key or a parameter holds."""
    if isinstance(value, Given):
        return {"given": value.parameter}
    return {"none": True} if value is None else value


def _pairs_plain(pairs: Iterable[tuple[str, object]], plain: Callable[..., object] = str) -> object:
    """A table; a list of pairs where a key comes twice, which a table could not say."""
    listed = [[key, plain(value)] for key, value in pairs]
    table = {str(key): value for key, value in listed}
    return table if len(table) == len(listed) else listed


def _short(**fields: object) -> Plain:
    """Without what is empty."""
    return {key: value for key, value in fields.items() if value not in ("", [], {}, False)}
