"""What the executive knows of a state at work, and what it hands to programs and takes from them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import simpy

from teleop_sim.machines.elements import State, Value

How = Literal["autonomous", "confirmed", "forced"]
AnswerKind = Literal["confirmed", "rejected", "forced", "autonomous", "suspended", "taken_over", "left", "over"]


class Signal(NamedTuple):
    """What a program returns.

    Attributes:
        signal: an event of the state, a name of its own that a ``Row`` makes an event of, or ``!fell``.
        note: for the log.
        writes: values of the keys that the state writes, by the program's own names.

    """

    signal: str
    note: str = ""
    writes: Mapping[str, object] = {}


@dataclass(frozen=True)
class Start:
    """What a program is started with.

    Attributes:
        path: of the state.
        program: name of what runs in it.
        reads: values of the keys that the state reads; None: never written.
        parameters: as declared.
        ask: ask the operator for data and wait for it; the event's value is what was answered.

    """

    path: str
    program: str
    reads: Mapping[str, object]
    parameters: Mapping[str, Value]
    ask: Callable[[str], simpy.Event]


@dataclass(frozen=True)
class Pending:
    """A request that is open. ``event`` is empty if none is suggested."""

    request: int
    kind: str
    path: str
    event: str
    since_s: float


@dataclass(frozen=True)
class Answer:
    """What ends a wait: an operator's answer, a level that is high enough, or something that ends the visit."""

    kind: AnswerKind
    event: str = ""
    note: str = ""


@dataclass(frozen=True)
class Outcome:
    """An outcome that is to be taken. ``signal`` is empty if a person forced it or a container raised it."""

    path: str
    event: str
    how: How
    signal: str = ""
    note: str = ""
    waited_s: float = 0.0


@dataclass(eq=False)
class Visit:
    """One active state, or a container that has ended inside and waits to be left.

    Attributes:
        node: its number; a modification of the machine may change it.
        path: of the state.
        state: what is declared; None for a container.
        raised: a container's outcome.
        entered_s: when.
        mode: ``normal``, ``auto`` or ``manual``.
        called: wakes the visit.
        answer: why it was woken, until that is dealt with.
        pending: what is asked for it.
        program: what runs in it.
        process: the visit's own.
        held: the outcome that waits for a lock or a pause to end.
        over: it is left, or the machine has ended.

    """

    node: int
    path: str
    state: State | None
    raised: str
    entered_s: float
    mode: str
    called: simpy.Event
    answer: Answer | None = None
    pending: Pending | None = None
    program: simpy.Process | None = None
    process: simpy.Process | None = None
    held: Outcome | None = field(default=None)
    over: bool = False
    waited_s: float = 0.0

    @property
    def busy(self) -> bool:
        """Does its program run?"""
        return self.program is not None and bool(self.program.is_alive)

    def wake(self, answer: Answer) -> None:
        """End the visit's wait; the first answer holds, but what ends the visit wins."""
        if answer.kind in ("left", "over"):
            self.over = True
            self.answer = answer
        elif self.answer is None:
            self.answer = answer
        if not self.called.triggered:
            self.called.succeed()
