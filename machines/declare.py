"""The extended state machine as data: states, outcomes with thresholds, failure counters; checked when declared.

Source: the 8-tuple (Σ, S, s0, δ, D, F, U, A) of Jagtap, Agarwal et al., "Extended State Machines for Robust Robot
Performance in Complex Tasks", section IV (the WPI paper), with the autonomy threshold on every outcome that ViGIR's
behaviours have. Not modelled: hierarchy, concurrence and data keys; hardware status h is one bit, *the robot is up*.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Literal, NamedTuple

from teleop_sim.core.errors import UnknownName

INHERIT = -1
"""Threshold of an outcome that always passes: the state merely says that it is still at work."""

FELL = "!fell"
"""What a program returns when the robot is down: nothing can be done any more."""

RaisedBy = Literal["code", "operator", "nobody"]
Kind = Literal["done", "retry", "failed", "executing", "command"]


class Autonomy(IntEnum):
    """How much the machine may do by itself. An outcome passes by itself iff its threshold is below the level."""

    OFF = 0
    LOW = 1
    HIGH = 2
    FULL = 3


@dataclass(frozen=True, slots=True)
class Edge:
    """One outcome of a state and where it leads.

    Attributes:
        state: that the outcome belongs to.
        event: name of the outcome; the link calls it by the edge's place in the table.
        next_state: where the machine goes.
        threshold: -1 (inherit) to 3; see ``passes``.
        kind: ``done`` (the state's action succeeded, b of D), ``retry`` or ``failed`` (it did not: c of D grows),
            ``executing`` (still at work) or ``command`` (a person's wish).
        raised_by: who raises it; an operator may force any.
        note: when it is raised, in words.

    """

    state: str
    event: str
    next_state: str
    threshold: int
    kind: Kind = "done"
    raised_by: RaisedBy = "code"
    note: str = ""

    def passes(self, level: int) -> bool:
        """The guard: may this outcome pass without a person?"""
        return self.threshold == INHERIT or self.threshold < level


@dataclass(frozen=True, slots=True)
class Counter:
    """One c of D and its limit.

    Attributes:
        limit: failures that are let pass as ``event``, zero or more.
        event: the outcome while the counter is not full.
        clears: a full counter goes back to zero when it is passed over.
        kept: a success does not put it back to zero.

    """

    limit: int
    event: str
    clears: bool = True
    kept: bool = False


@dataclass(frozen=True, slots=True)
class Row:
    """What becomes of one signal of a state's program: trigger F and update U.

    The first counter that is not full takes the failure and gives its event; when all are full, it is ``failed``.

    Attributes:
        signal: what the program returns: an event of the state, or a name of its own that starts with ``!``.
        counters: inner first.
        failed: the event when all counters are full.

    """

    signal: str
    counters: tuple[Counter, ...]
    failed: str

    @property
    def attempts(self) -> int:
        """Failures in a row, from counters at zero, up to and with the one that gives ``failed``."""
        attempts, refilled = 1, True
        for counter in self.counters:
            # A counter inside that clears must be filled anew for each failure that this one takes.
            attempts = attempts * (counter.limit + 1) if refilled else attempts + counter.limit
            refilled = counter.clears
        return attempts


@dataclass(frozen=True, slots=True)
class State:
    """One state.

    Attributes:
        name: unique.
        program: name of what runs in it (A of the tuple); empty if nothing does.
        rows: counted failures.
        manual: the state waits for a person.
        action: in words.

    """

    name: str
    program: str = ""
    rows: tuple[Row, ...] = ()
    manual: bool = False
    action: str = ""


class EightTuple(NamedTuple):
    """(Σ, S, s0, δ, D, F, U, A) of the WPI paper, section IV

    Attributes:
        symbols: Σ, all inputs: events, signals of programs, and ``!fell``.
        states: S.
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
    """A machine, checked when made.

    Attributes:
        name: of the machine.
        start: first state, s0.
        states: in the order of the table.
        edges: in the order of the table; a place in it is sent over the link as one byte.
        ends: states in which the machine stops.

    Raises:
        BadInput: with every problem of the declaration (``checks.problems``).

    """

    name: str
    start: str
    states: tuple[State, ...]
    edges: tuple[Edge, ...]
    ends: frozenset[str]

    def __post_init__(self) -> None:
        # Late: the checks are about the classes of this file.
        from teleop_sim.machines.checks import refuse_bad

        refuse_bad(self)

    @cached_property
    def _states(self) -> Mapping[str, State]:
        return {s.name: s for s in self.states}

    @cached_property
    def _edges(self) -> Mapping[tuple[str, str], int]:
        return {(e.state, e.event): i for i, e in enumerate(self.edges)}

    @cached_property
    def state_names(self) -> tuple[str, ...]:
        """Names in table order; a place in it is a state's number on the link."""
        return tuple(s.name for s in self.states)

    @cached_property
    def events(self) -> tuple[str, ...]:
        """All events, each once, in the order in which the table names them first."""
        return tuple(dict.fromkeys(e.event for e in self.edges))

    def state(self, name: str) -> State:
        """The state of that name.

        Raises:
            UnknownName: the machine has none.

        """
        if name not in self._states:
            raise UnknownName(f"machine {self.name}: state", name, self.state_names)
        return self._states[name]

    def outcomes(self, state: str) -> tuple[Edge, ...]:
        """The edges that leave a state, in table order."""
        return tuple(e for e in self.edges if e.state == state)

    def has_edge(self, state: str, event: str) -> bool:
        """Is the event declared for the state?"""
        return (state, event) in self._edges

    def edge_index(self, state: str, event: str) -> int:
        """Place of an outcome in the table, 0 to 255.

        Raises:
            UnknownName: the event is not declared for the state.

        """
        if (state, event) not in self._edges:
            choices = tuple(e.event for e in self.outcomes(state))
            raise UnknownName(f"machine {self.name}: {state}: event", event, choices)
        return self._edges[state, event]

    def edge(self, state: str, event: str) -> Edge:
        """The outcome ``event`` of ``state``; raises as ``edge_index``."""
        return self.edges[self.edge_index(state, event)]

    def as_tuple(self) -> EightTuple:
        """The machine as the paper writes it."""
        rows = tuple((s, r) for s in self.states for r in s.rows)
        signals = (r.signal for _, r in rows)
        return EightTuple(
            symbols=tuple(dict.fromkeys((*self.events, *signals, FELL))),
            states=self.state_names,
            start=self.start,
            transitions=tuple(((e.state, e.event), e.next_state) for e in self.edges),
            variables=_variables(self.states),
            triggers=tuple(
                (s.name, r.signal, tuple(dict.fromkeys((*(c.event for c in r.counters), r.failed)))) for s, r in rows
            ),
            updates=tuple((s.name, r.signal, (f"c.{s.name}", *_counts(s.name, r))) for s, r in rows),
            actions=tuple((s.name, s.program) for s in self.states if s.program),
        )


def _counts(state: str, row: Row) -> tuple[str, ...]:
    return tuple(f"c.{state}.{row.signal}.{k}" for k in range(1, len(row.counters) + 1))


def _variables(states: tuple[State, ...]) -> tuple[str, ...]:
    done = (f"b.{s.name}" for s in states)
    failures = (f"c.{s.name}" for s in states)
    limited = (name for s in states for r in s.rows for name in _counts(s.name, r))
    return (*done, *failures, *limited, "h.up")
