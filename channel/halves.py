"""The two halves of a delivery with acknowledgements: who sends and repeats, and who accepts each number once."""

from __future__ import annotations

import math
from collections import OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import simpy

from teleop_sim.channel.arq import DATA, SKIP, WINDOW_MAX, Delivery, Frame
from teleop_sim.channel.custody import alarm_s, start_s
from teleop_sim.channel.fates import Book
from teleop_sim.channel.link import DirectionSettings

_NUMBERS = 2 * WINDOW_MAX

SKIP_TRIES = 64
"""Copies of a skip before it rests (assumed): of links that lose half of all packets, each way, one in 10⁸ fails."""


class Transmit(Protocol):
    """Offers a frame to the link now and returns when its turn should come [s]."""

    def __call__(self, topic: str, frame: Frame, text: str, priority: int, copy_of: int | None) -> float:
        """``text`` and ``copy_of``, the number of a message, are for the log."""


Notify = Callable[[int, bool], None]
"""What a sender knows: the number of a message, and whether it was acknowledged or given up."""


@dataclass(slots=True)
class _Kept:
    """A message that the sender answers for.

    ``skip``: it was given up and only its number still has to cross. After ``SKIP_TRIES`` copies of that it rests, and
    goes on when there is a reason to: a new message, or an acknowledgement of another.
    """

    number: int
    topic: str
    payload: bytes
    text: str
    priority: int
    tries: int = 0
    skip: bool = False
    alarm: simpy.Event | None = None


class Sender:
    """Keeps messages until they are acknowledged or given up; at most a window of them at once.

    It acts on the clock, on acknowledgements and on the settings of the link, never on the ``book``.
    """

    def __init__(
        self,
        env: simpy.Environment,
        delivery: Delivery,
        ways: tuple[DirectionSettings, DirectionSettings],
        transmit: Transmit,
        book: Book,
        notify: Notify,
    ) -> None:
        self._env = env
        self._delivery = delivery
        self._out, self._back = ways
        self._transmit = transmit
        self._book = book
        self._notify = notify
        self._waiting: deque[_Kept] = deque()
        self._window: OrderedDict[int, _Kept] = OrderedDict()
        self._resting: list[_Kept] = []
        self._unconfirmed = 0
        self._closed = False

    def offer(self, number: int, topic: str, payload: bytes, text: str, priority: int) -> None:
        """Take over a message. Numbers come in order, without gaps."""
        self._waiting.append(_Kept(number, topic, payload, text, priority))
        self._rouse()
        self._fill()

    def acknowledge(self, wire_number: int) -> None:
        """The other site says that it needs this number no more. A late or repeated one has no effect."""
        base = next(iter(self._window), 0)
        number = base + (wire_number - base) % _NUMBERS
        if (kept := self._window.pop(number, None)) is None:
            return
        kept.alarm = None
        self._unconfirmed = max(self._unconfirmed, number + 1)
        if not kept.skip:
            self._notify(number, True)
        self._rouse()
        self._fill()

    def close(self) -> None:
        """Repeat nothing any more."""
        self._closed = True

    def _rouse(self) -> None:
        resting, self._resting = self._resting, []
        for kept in resting:
            if kept.number in self._window:
                kept.tries = 0
                self._go(kept)

    def _fill(self) -> None:
        while self._waiting:
            number = self._waiting[0].number
            if number >= next(iter(self._window), number) + self._delivery.window:
                return
            self._window[number] = self._waiting.popleft()
            self._go(self._window[number])

    def _go(self, kept: _Kept) -> None:
        """Offer a copy to the link, now or when the sender believes that it can go."""
        now_s = self._env.now
        when_s = start_s(self._delivery, now_s, self._out)
        if when_s > now_s:
            self._wake_at(kept, when_s)
            return
        kept.tries += 1
        wire_number = kept.number % _NUMBERS
        if kept.skip:
            frame, text = Frame(SKIP, wire_number), f"skip {kept.number}"
            turn_s = self._transmit("skip", frame, text, kept.priority, None)
        else:
            frame = Frame(DATA, wire_number, kept.payload)
            turn_s = self._transmit(kept.topic, frame, kept.text, kept.priority, kept.number)
        self._wake_at(kept, alarm_s(self._delivery, turn_s, len(kept.payload), self._out, self._back))

    def _wake_at(self, kept: _Kept, when_s: float) -> None:
        if math.isinf(when_s):
            kept.alarm = None
            return
        alarm = self._env.timeout(max(0.0, when_s - self._env.now))
        alarm.callbacks.append(lambda _: self._wake(kept, alarm))
        kept.alarm = alarm

    def _wake(self, kept: _Kept, alarm: simpy.Event) -> None:
        # An acknowledgement takes the alarm away; a later copy sets another.
        if self._closed or kept.alarm is not alarm:
            return
        must_cross = kept.skip or self._would_wrap(kept.number)
        tries = max(self._delivery.tries, SKIP_TRIES) if must_cross else self._delivery.tries
        if kept.tries < tries:
            self._go(kept)
        elif must_cross:
            kept.alarm = None
            self._resting.append(kept)
        else:
            self._give_up(kept)

    def _would_wrap(self, number: int) -> bool:
        """Whether the receiver, if it has heard nothing lately, would take the next number for an old one."""
        return number + 1 - self._unconfirmed >= WINDOW_MAX

    def _give_up(self, kept: _Kept) -> None:
        self._book.abandon(kept.number)
        self._notify(kept.number, False)
        if self._delivery.window == 1:
            # The next number says by itself that this one is over.
            del self._window[kept.number]
            self._fill()
            return
        kept.skip, kept.payload, kept.tries = True, b"", 0
        self._go(kept)


@dataclass(frozen=True, slots=True)
class Taken:
    """A message for the application."""

    number: int
    payload: bytes


class Receiver:
    """Accepts each number once, and tells what the application may have now.

    Attributes:
        expected: the lowest number that is neither handed on nor passed over.

    """

    def __init__(self, window: int, in_order: bool) -> None:
        self.expected = 0
        self._window = window
        self._in_order = in_order
        self._held: dict[int, Taken | None] = {}

    def take(self, frame: Frame) -> tuple[tuple[Taken, ...], tuple[int, ...]]:
        """Messages for the application, in order, and the numbers that it will never get from now on."""
        half = WINDOW_MAX
        number = self.expected + (frame.number - self.expected + half) % _NUMBERS - half
        if number < self.expected or number in self._held:
            return (), ()
        taken = Taken(number, frame.payload) if frame.kind == DATA else None
        over = [] if taken else [number]
        ready: list[Taken] = []
        if taken and not self._in_order:
            ready.append(taken)
            taken = None
        self._held[number] = taken
        # The sender would not have sent this number if those a window before it were not over.
        while self.expected <= number - self._window or self.expected in self._held:
            if self.expected not in self._held:
                over.append(self.expected)
            elif held := self._held.pop(self.expected):
                ready.append(held)
            self.expected += 1
        return tuple(ready), tuple(over)
