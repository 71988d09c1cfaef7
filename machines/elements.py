"""What a machine is made of: states, outcomes with thresholds, failure counters, containers, keys and parameters.

Sources: the 8-tuple of Jagtap, Agarwal et al., "Extended State Machines for Robust Robot Performance in Complex Tasks",
section IV (the WPI paper); thresholds, containers and keys as in ViGIR's behaviours (Romay et al., the ViGIR/Hector
paper; FlexBE, Schillinger et al. 2016).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from typing import Literal

INHERIT = -1
"""Threshold of an outcome that always passes: of a state still at work, or of a container whose inside was guarded."""

FELL = "!fell"
"""What a program returns when the robot is down: nothing can be done any more."""

PARKED = ""
"""Where an outcome in a concurrence leads: the child is done and waits for the others."""

RaisedBy = Literal["code", "operator", "nobody"]
Kind = Literal["done", "retry", "failed", "executing", "command"]
Finish = Literal["all", "any", "map"]
Value = str | int | float | bool | None
"""What a key or a parameter may start with."""

Pairs = tuple[tuple[str, str], ...]
"""Keys with remapping: (name inside, key of the container around)."""


class Autonomy(IntEnum):
    """How much the machine may do by itself. An outcome passes by itself iff its threshold is below the level."""

    OFF = 0
    LOW = 1
    HIGH = 2
    FULL = 3


@dataclass(frozen=True, slots=True)
class Given:
    """Stands for the value of a parameter of the behaviour."""

    parameter: str


@dataclass(frozen=True, slots=True)
class Parameter:
    """What may be chosen when a behaviour is started or embedded.

    Attributes:
        name: unique in the machine.
        default: its value if none is given.
        choices: values it may have; empty: any.

    """

    name: str
    default: Value
    choices: tuple[Value, ...] = ()


@dataclass(frozen=True, slots=True)
class Edge:
    """One outcome of a state or container and where it leads.

    Attributes:
        state: that the outcome belongs to: a name within its container; in ``Machine.table`` a path.
        event: name of the outcome; the link calls it by the edge's place in the table.
        next_state: a sibling, an outcome of the container, or ``PARKED`` in a concurrence. In ``Machine.table`` the
            path of the sibling, the path of the container that is left, or the outcome of the whole machine.
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
        taken, anew = 0, 0
        for counter in self.counters:
            # The counters inside that clear are filled anew for each failure that this one takes.
            own = counter.limit * (1 + anew)
            taken += own
            anew += own if counter.clears else 0
        return taken + 1


@dataclass(frozen=True, slots=True)
class State:
    """One state without states inside.

    Attributes:
        name: unique among its siblings; no ``/``.
        program: name of what runs in it (A of the tuple); empty if nothing does.
        rows: counted failures.
        manual: the state waits for a person to take over: manual mode.
        action: in words.
        decides: the state asks a person to choose an outcome; it has no program.
        suggests: of a state that decides: the outcome that passes by itself where its threshold lets it; empty: none.
        reads, writes: keys, as (the program's own name, the container's key).
        parameters: what the program is told, as (name, value).
        outcomes: to be checked against its edges; empty: those that have an edge.

    """

    name: str
    program: str = ""
    rows: tuple[Row, ...] = ()
    manual: bool = False
    action: str = ""
    decides: bool = False
    suggests: str = ""
    reads: Pairs = ()
    writes: Pairs = ()
    parameters: tuple[tuple[str, Value | Given], ...] = ()
    outcomes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Group:
    """A state with states inside of which one is active: a hierarchical machine.

    Attributes:
        name: unique among its siblings.
        start: the child that is entered first.
        states: children.
        edges: of the children.
        outcomes: of the group; the container around gives each an edge.
        reads, writes: keys, as (key inside, key of the container around): read when entered, written when left.
        data: keys and what they hold when the group is entered.
        priority: while it is active, everything outside it is suspended.
        spare: children that are kept although nothing leads to them.

    """

    name: str
    start: str
    states: tuple[Element, ...]
    edges: tuple[Edge, ...]
    outcomes: tuple[str, ...]
    reads: Pairs = ()
    writes: Pairs = ()
    data: tuple[tuple[str, Value | Given], ...] = ()
    priority: bool = False
    spare: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Rule:
    """One way in which a concurrence ends: with ``outcome`` if all of ``needs``, (child, its outcome), have come."""

    outcome: str
    needs: Pairs


@dataclass(frozen=True, slots=True)
class Concurrence:
    """A state with states inside that are all active at once.

    A child that has come to an outcome is *parked*. ``finish`` says when the whole ends: ``all`` when all children are
    parked, ``any`` when the first is, ``map`` as soon as a rule holds or all are parked. It ends with the outcome of
    the first rule that holds, or with ``default``. Children that are still at work are brought to rest.

    Attributes:
        name: unique among its siblings.
        states: children; each outcome of each has an edge to ``PARKED``.
        edges: of the children, for their thresholds.
        outcomes: of the concurrence.
        finish: see above.
        rules: in order; the first that holds gives the outcome.
        default: the outcome if no rule holds.
        reads, writes, data: as in ``Group``.

    """

    name: str
    states: tuple[Element, ...]
    edges: tuple[Edge, ...]
    outcomes: tuple[str, ...]
    finish: Finish
    rules: tuple[Rule, ...] = ()
    default: str = ""
    reads: Pairs = ()
    writes: Pairs = ()
    data: tuple[tuple[str, Value | Given], ...] = ()

    def outcome(self, parked: Iterable[tuple[str, str]]) -> str:
        """With what it ends when these children, (name, outcome), are parked; empty if it goes on."""
        have = set(parked)
        complete = len(have) == len(self.states)
        if not (complete or (self.finish == "any" and have) or self.finish == "map"):
            return ""
        held = next((rule.outcome for rule in self.rules if have.issuperset(rule.needs)), "")
        return held or (self.default if complete or self.finish == "any" else "")


Element = State | Group | Concurrence
"""What may stand in a container."""
