"""One direction of the link: FIFO, a rate, a one-way delay, headers, scheduled blackouts. See docs/link.md.

Because the sender knows the schedule, everything about a packet follows in closed form when it is offered: one timeout
a packet, its arrival. Only the head of the queue has one, so the clock's event list stays short.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Generator
from dataclasses import dataclass

import simpy

from teleop_sim.channel.blackouts import Schedule, dark_between, finish_of, first_light, schedule_problems
from teleop_sim.channel.message import DirectionName
from teleop_sim.core.errors import BadInput, Problem, TeleopError
from teleop_sim.core.records import Blackout, Emit, PacketEnded

Receive = Callable[[bytes], None]
"""Called with the payload when its last bit has arrived: the bytes that were paid for, and nothing else."""


class LinkClosed(TeleopError, RuntimeError):
    """Something was sent after the run had ended: it would be lost without a record."""

    def __init__(self, direction: str, topic: str) -> None:
        super().__init__(direction, topic)

    def __str__(self) -> str:
        return f"{self.args[0]}link: {self.args[1]!r} was sent after close()\n  Close the link last."


@dataclass(frozen=True, slots=True)
class DirectionSettings:
    """What a direction can do, constant within a run.

    Attributes:
        rate_bps: serialisation rate, above zero; ``inf`` means no serialisation time.
        delay_s: one-way propagation delay, zero or more.
        header_bytes: added to every payload and charged to the rate.
        blackouts: ``(start_s, end_s)`` in order and apart; the last end may be ``math.inf``.

    Raises:
        BadInput: with all problems found.

    """

    rate_bps: float
    delay_s: float
    header_bytes: int = 0
    blackouts: Schedule = ()

    def __post_init__(self) -> None:
        if problems := _problems(self):
            raise BadInput(problems)


def _problems(settings: DirectionSettings) -> tuple[Problem, ...]:
    rate_bps, delay_s, found = settings.rate_bps, settings.delay_s, list[Problem]()
    if not rate_bps > 0.0:
        found.append(Problem("rate_bps", f"a rate of {rate_bps} bit/s delivers nothing", "Give above zero."))
    if not (math.isfinite(delay_s) and delay_s >= 0.0):
        found.append(Problem("delay_s", f"a delay of {delay_s} s is impossible", "Give zero or more."))
    if settings.header_bytes < 0:
        found.append(Problem("header_bytes", f"{settings.header_bytes} bytes of header", "Give zero or more."))
    return (*found, *schedule_problems(settings.blackouts, "blackouts"))


@dataclass(frozen=True, slots=True)
class _Packet:
    """A packet and its times [s]: offered, first in line, first bit out, last bit out, last bit in (``inf``: never)."""

    number: int
    topic: str
    payload: bytes
    text: str
    size_bits: int
    sent_s: float
    turn_s: float
    service_s: float
    finish_s: float
    arrive_s: float


@dataclass(frozen=True, slots=True)
class _Waits:
    queue_s: float
    blackout_s: float
    serialisation_s: float
    propagation_s: float


def _waits_until(packet: _Packet, now_s: float, blackouts: Schedule) -> _Waits:
    """Where a packet on its way has spent its time up to ``now_s``. The four add up to ``now_s - sent_s``."""
    turn_s, finish_s = min(packet.turn_s, now_s), min(packet.finish_s, now_s)
    dark_before_s = dark_between(packet.sent_s, turn_s, blackouts)
    dark_after_s = dark_between(turn_s, finish_s, blackouts)
    return _Waits(
        queue_s=turn_s - packet.sent_s - dark_before_s,
        blackout_s=dark_before_s + dark_after_s,
        serialisation_s=finish_s - turn_s - dark_after_s,
        propagation_s=now_s - finish_s,
    )


class Direction:
    """One direction of the link on the clock. Sites hold only its ``send`` and are told by ``receive``.

    Not modelled yet: loss, jitter, bounded queues, priorities, fragments, retransmission, changing rates.

    Attributes:
        sent: packets offered so far.
        delivered: packets whose last bit has arrived.
        dropped: packets lost for a named reason (none, for now).
        sent_bits: with headers, of all packets offered.
        delivered_bits: with headers, of all packets delivered.

    """

    def __init__(
        self, env: simpy.Environment, name: DirectionName, settings: DirectionSettings, receive: Receive, emit: Emit
    ) -> None:
        self.name = name
        self.settings = settings
        self.sent = self.delivered = self.dropped = 0
        self.sent_bits = self.delivered_bits = 0
        self._env = env
        self._receive = receive
        self._emit = emit
        self._started_s: float = env.now
        self._free_s: float = env.now
        self._busy_s = 0.0
        self._on_way: deque[_Packet] = deque()
        self._closed = False
        if settings.blackouts:
            env.process(self._tell_blackouts())

    @property
    def in_flight(self) -> int:
        """Packets queued, in service or propagating."""
        return len(self._on_way)

    def utilisation(self) -> float:
        """Share of the time so far in which bits went out, 0 to 1."""
        now_s = self._env.now
        if now_s <= self._started_s:
            return 0.0
        waits = (_waits_until(p, now_s, self.settings.blackouts) for p in self._on_way)
        return (self._busy_s + sum(w.serialisation_s for w in waits)) / (now_s - self._started_s)

    def send(self, topic: str, payload: bytes, text: str = "") -> None:
        """Offer a packet now. ``text`` says in the log what it means; it is never transmitted.

        Raises:
            LinkClosed: after ``close``.

        """
        if self._closed:
            raise LinkClosed(self.name, topic)
        packet = self._plan(topic, payload, text)
        self.sent += 1
        self.sent_bits += packet.size_bits
        self._free_s = packet.finish_s
        self._on_way.append(packet)
        if len(self._on_way) == 1:
            self._await_head()

    def close(self) -> None:
        """End the run: every packet on its way ends ``in_flight``, in order of packet number. Again: no effect."""
        self._closed = True
        now_s = self._env.now
        while self._on_way:
            packet = self._on_way.popleft()
            waits = _waits_until(packet, now_s, self.settings.blackouts)
            self._busy_s += waits.serialisation_s
            service_s = packet.service_s if packet.service_s <= now_s else math.nan
            self._record(packet, waits, service_s, math.nan, "in_flight")

    def _plan(self, topic: str, payload: bytes, text: str) -> _Packet:
        link, now_s = self.settings, self._env.now
        bits = 8 * (len(payload) + link.header_bytes)
        turn_s = max(now_s, self._free_s)
        return _Packet(
            number=self.sent,
            topic=topic,
            payload=payload,
            text=text,
            size_bits=bits,
            sent_s=now_s,
            turn_s=turn_s,
            service_s=first_light(turn_s, link.blackouts),
            finish_s=(finish_s := finish_of(turn_s, bits, link.rate_bps, link.blackouts)),
            arrive_s=finish_s + link.delay_s,
        )

    def _await_head(self) -> None:
        """Wake up when the first packet on its way arrives. FIFO at one delay: the others come later."""
        arrive_s = self._on_way[0].arrive_s
        if math.isinf(arrive_s):
            return
        # Rounding may put an arrival a hair before the one ahead.
        wake = self._env.timeout(max(0.0, arrive_s - self._env.now))
        wake.callbacks.append(self._arrive)

    def _arrive(self, _: simpy.Event) -> None:
        if self._closed:
            return
        packet = self._on_way.popleft()
        if self._on_way:
            self._await_head()
        link = self.settings
        dark_s = dark_between(packet.sent_s, packet.turn_s, link.blackouts)
        waits = _Waits(
            queue_s=packet.turn_s - packet.sent_s - dark_s,
            blackout_s=dark_s + dark_between(packet.turn_s, packet.finish_s, link.blackouts),
            serialisation_s=packet.size_bits / link.rate_bps,
            propagation_s=link.delay_s,
        )
        self.delivered += 1
        self.delivered_bits += packet.size_bits
        self._busy_s += waits.serialisation_s
        self._record(packet, waits, packet.service_s, self._env.now, "delivered")
        self._receive(packet.payload)

    def _record(self, packet: _Packet, waits: _Waits, service_s: float, arrived_s: float, outcome: str) -> None:
        self._emit(
            PacketEnded(
                t_s=self._env.now,
                direction=self.name,
                packet=packet.number,
                topic=packet.topic,
                payload_bytes=len(packet.payload),
                size_bits=packet.size_bits,
                sent_s=packet.sent_s,
                service_s=service_s,
                arrived_s=arrived_s,
                queue_s=waits.queue_s,
                blackout_s=waits.blackout_s,
                serialisation_s=waits.serialisation_s,
                propagation_s=waits.propagation_s,
                outcome=outcome,
                reason="",
                text=packet.text,
            )
        )

    def _tell_blackouts(self) -> Generator[simpy.Event, None, None]:
        """Process: a record when it gets dark and when it gets light; ends with the last finite time."""
        for start_s, end_s in self.settings.blackouts:
            for when_s, dark in ((start_s, True), (end_s, False)):
                if math.isinf(when_s):
                    return
                yield self._env.timeout(max(0.0, when_s - self._env.now))
                if self._closed:
                    return
                self._emit(Blackout(self._env.now, self.name, dark))
