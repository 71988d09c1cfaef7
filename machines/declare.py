"""The extended state machine as data, checked when declared; ``as_tuple`` gives the WPI paper's 8-tuple.

Hardware status h is one bit, *the robot is up*.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple
from zlib import crc32

from teleop_sim.core.errors import BadInput, Problem, UnknownName, unknown_name
from teleop_sim.machines.elements import (
    FELL,
    INHERIT,
    PARKED,
    Autonomy,
    Concurrence,
    Counter,
    Edge,
    Element,
    Given,
    Group,
    Kind,
    Pairs,
    Parameter,
    RaisedBy,
    Row,
    Rule,
    State,
    Value,
)
from teleop_sim.machines.net import Net, compile_net

__all__ = [
    "FELL",
    "INHERIT",
    "PARKED",
    "Autonomy",
    "Concurrence",
    "Counter",
    "Edge",
    "EightTuple",
    "Element",
    "Given",
    "Group",
    "Kind",
    "Machine",
    "Parameter",
    "RaisedBy",
    "Row",
    "Rule",
    "State",
    "Value",
    "embed",
]


class EightTuple(NamedTuple):
    """(Σ, S, s0, δ, D, F, U, A) of the WPI paper, section IV

    Attributes:
        symbols: Σ, all inputs: events, signals of programs, and ``!fell``.
        states: S, containers included.
        start: s0.
        transitions: δ as ((state, event), next state), in table order.
        variables: D by name: ``b.<state>``, ``c.<state>``, ``c.<state>.<signal>.<k>`` and ``h.up``.
        triggers: F as (state, signal, events that it may become): the event depends on D.
        updates: U as (state, signal, variables that it changes).
        actions: A as (state, program).

    """

    symbols: tuple[str, ...]
    states: tuple[str, ...]
    start: str
    transitions: tuple[tuple[tuple[str, str], str], ...]
    variables: tuple[str, ...]
    triggers: tuple[tuple[str, str, tuple[str, ...]], ...]
    updates: tuple[tuple[str, str, tuple[str, ...]], ...]
    actions: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Machine:
    """A machine, checked when made. It ends in one of ``ends``, or with one of its ``outcomes``.

    States within containers are called by path, such as ``Open_Door/Go_to_Grasp/Plan_To_Grasp``.

    Attributes:
        name: of the machine.
        start: first state, s0.
        states: children of the top, in order.
        edges: of the children of the top.
        ends: states of the top in which the machine stops; it has then succeeded.
        outcomes: of the machine, as a container has them.
        goals: those of the outcomes with which the machine has succeeded.
        parameters: what may be chosen by ``given``.
        data: keys of the top and what they hold at the start.
        reads, writes: keys that an embedding container must give, and those that it gets.
        spare: children of the top that are kept although nothing leads to them.

    Raises:
        BadInput: with every problem of the declaration (``checks.problems``).

    """

    name: str
    start: str
    states: tuple[Element, ...]
    edges: tuple[Edge, ...]
    ends: frozenset[str] = frozenset()
    outcomes: tuple[str, ...] = ()
    goals: frozenset[str] = frozenset()
    parameters: tuple[Parameter, ...] = ()
    data: tuple[tuple[str, Value | Given], ...] = ()
    reads: tuple[str, ...] = ()
    writes: tuple[str, ...] = ()
    spare: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        # Late: the checks are about the classes of this file.
        from teleop_sim.machines.checks import refuse_bad

        refuse_bad(self)

    @cached_property
    def top(self) -> Group:
        """The machine as a container; its name is empty."""
        keys = tuple((key, key) for key in self.writes)
        reads = tuple((key, key) for key in self.reads)
        return Group("", self.start, self.states, self.edges, self.outcomes, reads, keys, self.data, spare=self.spare)

    @cached_property
    def net(self) -> Net:
        """The machine flattened for running it: nodes and edges by number."""
        return compile_net(self.top)

    @cached_property
    def table(self) -> tuple[Edge, ...]:
        """All edges with paths instead of names; a place in it is sent over the link."""
        return self.net.edges

    @cached_property
    def state_names(self) -> tuple[str, ...]:
        """Paths of all states and containers; a place in it is a state's number on the link."""
        return tuple(node.path for node in self.net.nodes[1:])

    @cached_property
    def events(self) -> tuple[str, ...]:
        """All events, each once, in the order in which the table names them first."""
        return tuple(dict.fromkeys(e.event for e in self.table))

    @cached_property
    def checksum(self) -> int:
        """32 bits over everything that both sites must agree on: whatever is declared, but no words and notes."""
        ends = sorted(self.ends), sorted(self.goals)
        return crc32(repr((_bare(self.top), ends, self.parameters)).encode())

    def given(self, **values: Value) -> Machine:
        """The machine with other values of its parameters.

        Raises:
            BadInput: an unknown parameter, or a value that is not among its choices.

        """
        names = tuple(p.name for p in self.parameters)
        at = f"machine {self.name}: parameter"
        found = [unknown_name(at, name, names) for name in values if name not in names]
        for p in self.parameters:
            value = values.get(p.name, p.default)
            if p.choices and value not in p.choices:
                found.append(Problem(f"{at} {p.name}", f"{value!r}", f"Give one of {', '.join(map(str, p.choices))}."))
        if found:
            raise BadInput(tuple(found))
        return replace(
            self, parameters=tuple(replace(p, default=values.get(p.name, p.default)) for p in self.parameters)
        )

    def value(self, value: Value | Given) -> Value:
        """A value as it is, or the parameter's that it stands for."""
        if isinstance(value, Given):
            return next(p.default for p in self.parameters if p.name == value.parameter)
        return value

    def state(self, path: str) -> Element:
        """The state or container of that path.

        Raises:
            UnknownName: the machine has none.

        """
        if path not in self.net.by_path or not path:
            raise UnknownName(f"machine {self.name}: state", path, self.state_names)
        return self.net.nodes[self.net.by_path[path]].element

    def leaf(self, path: str) -> State:
        """As ``state``; what is asked of a container is asked of a state in which nothing is declared."""
        element = self.state(path)
        return element if isinstance(element, State) else State(element.name)

    def outcomes_of(self, path: str) -> tuple[Edge, ...]:
        """The edges that leave a state, in table order."""
        return tuple(e for e in self.table if e.state == path)

    def has_edge(self, path: str, event: str) -> bool:
        """Is the event declared for the state?"""
        return self.net.number(path, event) is not None

    def edge_index(self, path: str, event: str) -> int:
        """Place of an outcome in the table.

        Raises:
            UnknownName: the event is not declared for the state.

        """
        found = self.net.number(path, event)
        if found is None:
            choices = tuple(e.event for e in self.outcomes_of(path))
            raise UnknownName(f"machine {self.name}: {path}: event", event, choices)
        return found

    def edge(self, path: str, event: str) -> Edge:
        """The outcome ``event`` of the state; raises as ``edge_index``."""
        return self.table[self.edge_index(path, event)]

    def as_tuple(self) -> EightTuple:
        """The machine as the paper writes it."""
        nodes = tuple((n.path, n.element) for n in self.net.nodes[1:])
        leaves = tuple((path, e) for path, e in nodes if isinstance(e, State))
        rows = tuple((path, r) for path, s in leaves for r in s.rows)
        return EightTuple(
            symbols=tuple(dict.fromkeys((*self.events, *(r.signal for _, r in rows), FELL))),
            states=self.state_names,
            start=self.start,
            transitions=tuple(((e.state, e.event), e.next_state) for e in self.table),
            variables=(
                *(f"b.{path}" for path, _ in nodes),
                *(f"c.{path}" for path, _ in nodes),
                *(name for path, r in rows for name in _counts(path, r)),
                "h.up",
            ),
            triggers=tuple(
                (path, r.signal, tuple(dict.fromkeys((*(c.event for c in r.counters), r.failed)))) for path, r in rows
            ),
            updates=tuple((path, r.signal, (f"c.{path}", *_counts(path, r))) for path, r in rows),
            actions=tuple((path, s.program) for path, s in leaves if s.program),
        )


def _counts(path: str, row: Row) -> tuple[str, ...]:
    return tuple(f"c.{path}.{row.signal}.{k}" for k in range(1, len(row.counters) + 1))


def _bare(element: Element) -> object:
    """What the checksum is made of."""
    if isinstance(element, State):
        return replace(element, action="")
    inside = tuple(_bare(child) for child in element.states)
    # A threshold may be written as a number or by its name.
    edges = tuple(replace(edge, threshold=int(edge.threshold), note="") for edge in element.edges)
    return repr(replace(element, states=(), edges=edges)), inside


def embed(
    name: str, machine: Machine, reads: Pairs = (), writes: Pairs = (), data: tuple[tuple[str, Value], ...] = ()
) -> Group:
    """A behaviour as a container of another: its parameters as they are, its keys remapped.

    Args:
        name: of the container.
        machine: what is embedded; give it other values by ``Machine.given`` first.
        reads, writes: keys, as (the behaviour's, the container's around).
        data: instead of the behaviour's own start data, key by key.

    Raises:
        BadInput: the machine ends in states instead of outcomes, so nothing could follow it.

    """
    if machine.ends or not machine.outcomes:
        what = f"machine {machine.name} ends in states"
        raise BadInput((Problem(f"embed {name}", what, "Only a machine with outcomes can be embedded."),))
    start = {key: machine.value(value) for key, value in machine.data} | dict(data)
    states = tuple(_resolved(machine, element) for element in machine.states)
    top = machine.top
    return replace(top, name=name, states=states, reads=reads, writes=writes, data=tuple(start.items()))


def _resolved(machine: Machine, element: Element) -> Element:
    """With the values of parameters in place of their names."""
    if isinstance(element, State):
        return replace(element, parameters=tuple((k, machine.value(v)) for k, v in element.parameters))
    states = tuple(_resolved(machine, child) for child in element.states)
    return replace(element, states=states, data=tuple((k, machine.value(v)) for k, v in element.data))
