"""What became of every message that was entrusted to a delivery: the account of a run, not part of any protocol.

A packet is one copy on the wire and ends in one ``link/packet`` record. A message may need many packets and ends in
one ``Fate``. Neither site acts on this account; what a sender may know, acknowledgements tell it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import simpy

TRIES_TOLD_APART = 16
"""Copies of one message that the wire tells apart: four bits of the flag byte."""


@dataclass(frozen=True, slots=True)
class Fate:
    """The end of one message.

    Attributes:
        number: of the message among those of its sender, from 0.
        topic: label.
        payload_bytes: of the message, without what the delivery adds.
        outcome: ``delivered`` (the other site's application got it), ``gave_up`` (it never will) or ``in_flight``
            (the run ended first).
        reason: of a best-effort packet that was dropped, as in its record; else empty.
        tries: copies offered to the link.
        offered_s: when the application handed it over.
        ended_s: when it was delivered, given up, or the run ended.
        store_s: kept by the sender before the first copy: the window was full, or it was known to be dark.
        retransmission_s: from the first copy to the one that arrived; if none did, to the last.
        link_s: from that copy's offer to its arrival; if none arrived, to ``ended_s``.
        order_s: held by the receiver until all before it were there.
        text: what it meant, for readers; never sent.

    The four waits add up to ``ended_s - offered_s``.

    """

    number: int
    topic: str
    payload_bytes: int
    outcome: str
    reason: str
    tries: int
    offered_s: float
    ended_s: float
    store_s: float
    retransmission_s: float
    link_s: float
    order_s: float
    text: str


Tell = Callable[[Fate], None]


@dataclass(slots=True)
class _Open:
    """A message without a fate; ``copies``: (try, when) of the latest copies."""

    topic: str
    payload_bytes: int
    text: str
    offered_s: float
    tries: int = 0
    first_s: float = math.nan
    gave_up_s: float = math.nan
    copies: deque[tuple[int, float]] = field(default_factory=lambda: deque(maxlen=TRIES_TOLD_APART))


class Book:
    """The messages of one sender until their fate is known. It holds only open messages.

    Attributes:
        offered: messages entered.
        delivered: messages that the other application got.
        gave_up: messages that it never will.

    """

    def __init__(self, env: simpy.Environment, tell: Tell) -> None:
        self.offered = self.delivered = self.gave_up = 0
        self._env = env
        self._tell = tell
        self._open: dict[int, _Open] = {}

    @property
    def in_flight(self) -> int:
        """Messages without a fate."""
        return len(self._open)

    def enter(self, topic: str, payload_bytes: int, text: str) -> int:
        """A new message; returns its number."""
        number = self.offered
        self.offered += 1
        self._open[number] = _Open(topic, payload_bytes, text, self._env.now)
        return number

    def copy(self, number: int) -> None:
        """A copy is offered to the link now."""
        if (entry := self._open.get(number)) is None:
            # It was delivered, but no acknowledgement came.
            return
        entry.tries += 1
        if entry.tries == 1:
            entry.first_s = self._env.now
        entry.copies.append((entry.tries, self._env.now))

    def abandon(self, number: int) -> None:
        """The sender gives up now. A copy on its way may still arrive, so this is no fate yet."""
        if (entry := self._open.get(number)) is not None:
            entry.gave_up_s = self._env.now

    def deliver(self, number: int, attempt: int, arrived_s: float) -> None:
        """The application gets it now, from the copy that came at ``arrived_s``; ``attempt``: its try modulo 16."""
        entry = self._open.pop(number)
        copy_s = next(s for n, s in reversed(entry.copies) if n % TRIES_TOLD_APART == attempt)
        self.delivered += 1
        self._end(number, entry, "delivered", "", self._env.now, copy_s, arrived_s)

    def lose(self, number: int, reason: str) -> None:
        """It can no longer be delivered. It ended when the sender gave up; if it has not, now."""
        entry = self._open.pop(number)
        ended_s = self._env.now if math.isnan(entry.gave_up_s) else entry.gave_up_s
        self.gave_up += 1
        self._end(number, entry, "gave_up", reason, ended_s, *_last(entry, ended_s))

    def close(self) -> None:
        """The run ends: what is open is given up, if its sender has, or in flight. In order of number."""
        for number, entry in sorted(self._open.items()):
            gave_up = not math.isnan(entry.gave_up_s)
            self.gave_up += gave_up
            ended_s = entry.gave_up_s if gave_up else self._env.now
            self._end(number, entry, "gave_up" if gave_up else "in_flight", "", ended_s, *_last(entry, ended_s))
        self._open.clear()

    def _end(
        self, number: int, entry: _Open, outcome: str, reason: str, ended_s: float, copy_s: float, arrived_s: float
    ) -> None:
        first_s = copy_s if math.isnan(entry.first_s) else entry.first_s
        self._tell(
            Fate(
                number=number,
                topic=entry.topic,
                payload_bytes=entry.payload_bytes,
                outcome=outcome,
                reason=reason,
                tries=entry.tries,
                offered_s=entry.offered_s,
                ended_s=ended_s,
                store_s=first_s - entry.offered_s,
                retransmission_s=copy_s - first_s,
                link_s=arrived_s - copy_s,
                order_s=ended_s - arrived_s,
                text=entry.text,
            )
        )


def _last(entry: _Open, ended_s: float) -> tuple[float, float]:
    """Of a message that did not arrive: when its last copy was offered, and until when that one was on its way."""
    return (entry.copies[-1][1] if entry.copies else ended_s), ended_s
