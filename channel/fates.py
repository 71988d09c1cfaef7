"""What became of every message that was entrusted to a delivery: the account of a run, not part of any protocol.

A packet is one copy on the wire and ends in one ``link/packet`` record. A message may need many packets and ends in
one ``Fate``. The account is kept from the records of the packets. Neither site acts on it; what a sender may know,
acknowledgements tell it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import simpy

from teleop_sim.channel.drops import GAVE_UP
from teleop_sim.core.records import PacketEnded


@dataclass(frozen=True, slots=True)
class Fate:
    """The end of one message.

    Attributes:
        number: of the message among those of its sender, from 0.
        topic: label.
        payload_bytes: of the message, without what the delivery adds.
        outcome: ``delivered`` (the other site's application got it), ``gave_up`` (it never will) or ``in_flight``
            (the run ended first).
        reason: of ``gave_up``: ``gave_up`` or ``no_connection`` (``drops.py``), or of a best-effort packet why it was
            dropped; else empty.
        tries: copies offered to the link.
        offered_s: when the application handed it over.
        ended_s: when it was delivered, given up, or the run ended.
        store_s: kept by the sender before the first copy: the window was full, or it was known to be dark.
        retransmission_s: from the first copy to the one that arrived; if none did, to the last.
        link_s: from that copy's offer to its arrival; if none arrived, to ``ended_s``.
        order_s: held by the receiver until all before it were there.
        text: what it meant, for readers; never sent.
        packet: number, in its direction, of the packet in which it arrived; if it did not, of its last; -1: none.
        record: of that packet; None: there is no packet, or it has not ended.

    The four waits add up to ``ended_s - offered_s``. Of a message in several packets they are those of the part that
    arrived last.

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
    packet: int = -1
    record: PacketEnded | None = field(default=None, compare=False, repr=False)


Tell = Callable[[Fate], None]


@dataclass(slots=True)
class _Open:
    """A message without a fate; ``on_way``: copies whose packets have not ended. A time is NaN before it comes.

    ``record``: of the packet ``packet``. ``reason``: why its sender gave up, if it does.
    ``missing``: parts that have not arrived; ``firsts_s``: when the first copy of a part was offered. ``first_s``,
    ``copy_s`` and ``packet`` are of the last copy's part, and once all have arrived of the part that came last.
    """

    topic: str
    payload_bytes: int
    text: str
    offered_s: float
    missing: set[int]
    firsts_s: dict[int, float] = field(default_factory=dict)
    tries: int = 0
    on_way: int = 0
    packet: int = -1
    first_s: float = math.nan
    copy_s: float = math.nan
    arrived_s: float = math.nan
    gave_up_s: float = math.nan
    reason: str = GAVE_UP
    record: PacketEnded | None = None

    @property
    def arrived(self) -> bool:
        return not math.isnan(self.arrived_s)

    @property
    def abandoned(self) -> bool:
        return not math.isnan(self.gave_up_s)


class Book:
    """The messages of one sender until their fate is known. It holds only open messages and packets.

    Attributes:
        offered: messages entered.
        delivered: messages that the other application got.
        gave_up: messages that it never will.
        firsts: of each connection (by its name) the number of its first message, where a delivery has connections.

    """

    def __init__(self, env: simpy.Environment, tell: Tell, best_effort: bool) -> None:
        """``best_effort``: the end of a packet is that of its message."""
        self.offered = self.delivered = self.gave_up = 0
        self._env = env
        self._tell = tell
        self._best_effort = best_effort
        self._open: dict[int, _Open] = {}
        self._packets: dict[int, tuple[int, int]] = {}
        self.firsts: dict[int, int] = {}

    @property
    def in_flight(self) -> int:
        """Messages without a fate."""
        return len(self._open)

    def enter(self, topic: str, payload_bytes: int, text: str, parts: int = 1) -> int:
        """A new message in so many parts; returns its number."""
        number = self.offered
        self.offered += 1
        self._open[number] = _Open(topic, payload_bytes, text, self._env.now, set(range(parts)))
        return number

    def copy(self, number: int, packet: int, part: int = 0) -> None:
        """A copy of a part is offered to the link now, as the packet of that number."""
        if (entry := self._open.get(number)) is None:
            # It was delivered, but no acknowledgement has come.
            return
        self._packets[packet] = number, part
        entry.tries += 1
        entry.on_way += 1
        entry.firsts_s.setdefault(part, self._env.now)
        if not entry.arrived:
            entry.first_s, entry.copy_s, entry.packet = entry.firsts_s[part], self._env.now, packet
            entry.record = None

    def packet_ended(self, packet: PacketEnded) -> None:
        """The record of a packet is written. If it was delivered, its receiver is told after this."""
        number, part = self._packets.pop(packet.packet, (-1, 0))
        if (entry := self._open.get(number)) is None:
            return
        if packet.packet == entry.packet:
            entry.record = packet
        if packet.outcome == "in_flight":
            return
        entry.on_way -= 1
        if packet.outcome == "dropped":
            if self._best_effort:
                self._lose(number, packet.reason)
            else:
                self._lose_if_hopeless(number)
        elif part in entry.missing:
            entry.missing.remove(part)
            if not entry.missing:
                entry.first_s, entry.packet = entry.firsts_s[part], packet.packet
                entry.copy_s, entry.arrived_s, entry.record = packet.sent_s, packet.arrived_s, packet
            if self._best_effort:
                self.deliver(number)

    def abandon(self, number: int, reason: str = GAVE_UP) -> None:
        """The sender gives up now. While a copy is on its way, which may arrive, this is no fate yet."""
        if (entry := self._open.get(number)) is not None:
            entry.gave_up_s, entry.reason = self._env.now, reason
            self._lose_if_hopeless(number)

    def passed_over(self, number: int) -> None:
        """The receiver will not take this number any more."""
        if number in self._open:
            self._lose(number, self._open[number].reason)

    def deliver(self, number: int) -> None:
        """The application gets it now."""
        self.delivered += 1
        self._end(number, "delivered", "", self._env.now)

    def close(self) -> None:
        """The run ends: what is open is given up, if its sender has and no copy is there, or in flight."""
        for number, entry in sorted(self._open.items()):
            if entry.abandoned and not entry.arrived:
                self._lose(number, entry.reason)
            else:
                self._end(number, "in_flight", "", self._env.now)

    def _lose_if_hopeless(self, number: int) -> None:
        entry = self._open[number]
        if entry.abandoned and not entry.arrived and not entry.on_way:
            self._lose(number, entry.reason)

    def _lose(self, number: int, reason: str) -> None:
        entry = self._open[number]
        self.gave_up += 1
        self._end(number, "gave_up", reason, entry.gave_up_s if entry.abandoned else self._env.now)

    def _end(self, number: int, outcome: str, reason: str, ended_s: float) -> None:
        entry = self._open.pop(number)
        first_s = entry.first_s if entry.tries else ended_s
        copy_s = entry.copy_s if entry.tries else ended_s
        # A copy that comes after its message was given up is part of no wait.
        arrived_s = min(entry.arrived_s, ended_s) if entry.arrived else ended_s
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
                packet=entry.packet,
                record=entry.record,
            )
        )
