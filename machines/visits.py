"""What the executive knows of a state at work, and what it hands to programs and takes from them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import simpy

from teleop_sim.machines.elements import State, Value

How = Literal["autonomous", "confirmed", "forced"]
AnswerKind = Literal["confirmed", "rejected", "forced", "suspended", "taken_over", "left", "over"]


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
    """What ends a wait: an operator's answer, or something that ends the visit."""

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
    """One active state, or a container that has ended inside and waits to be left, or that a person forces to be left.

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
        held: the outcome that waits for a lock, a pause or a container of priority to end.
        leaving: the outcome that is being taken, while what is left with it comes to rest.
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
    held: Outcome | None = None
    leaving: Outcome | None = None
    over: bool = False
    waited_s: float = 0.0

    @property
    def busy(self) -> bool:
        """Does its program run?"""
        return self.program is not None and bool(self.program.is_alive)

    @property
    def decided(self) -> bool:
        """Is there nothing left to decide? A program that is brought to rest for a pause leaves everything open."""
        answered = self.answer is not None and self.answer.kind != "suspended"
        return answered or self.leaving is not None or self.over

    def chosen(self) -> str:
        """The event that was decided and is not taken yet; empty if there is none."""
        if self.leaving is not None:
            return self.leaving.event
        if self.answer is None or self.over:
            return ""
        if self.answer.kind == "confirmed" and self.pending is not None:
            return self.pending.event
        return self.answer.event

    def wake(self, answer: Answer) -> None:
        """End the visit's wait; the first answer holds, but what ends the visit wins."""
        if answer.kind in ("left", "over"):
            self.over = True
            self.answer = answer
        elif self.answer is None or self.answer.kind == "suspended":
            self.answer = answer
        self.nudge()

    def nudge(self) -> None:
        """Let the visit look again at what it waits for."""
        if not self.called.triggered:
            self.called.succeed()

    def wait(self) -> simpy.Event:
        """The next nudge. Whoever waits looks first, and again afterwards."""
        self.called = self.called.env.event()
        return self.called
