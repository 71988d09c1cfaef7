"""What every kind of direction has: numbers for its packets, their records and counts, and the records of the dark."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator
from dataclasses import dataclass

import simpy

from teleop_sim.channel.counters import Counters
from teleop_sim.channel.message import DirectionName
from teleop_sim.channel.settings import DirectionSettings
from teleop_sim.core.errors import TeleopError
from teleop_sim.core.records import Blackout, Emit, PacketEnded

Receive = Callable[[bytes], None]
"""Called with the payload when its last bit has arrived: the bytes that were paid for, and nothing else."""


class LinkClosed(TeleopError, RuntimeError):
    """Something was sent after the run had ended: it would be lost without a record."""

    def __init__(self, direction: str, topic: str) -> None:
        super().__init__(direction, topic)

    def __str__(self) -> str:
        return f"{self.args[0]}link: {self.args[1]!r} was sent after close()\n  Close the link last."


@dataclass(slots=True, eq=False)
class Packet:
    """A packet that was offered to a direction. ``size_bits`` has its headers."""

    number: int
    topic: str
    payload: bytes
    text: str
    priority: int
    size_bits: int
    sent_s: float


@dataclass(slots=True)
class Waits:
    """Where a packet has spent its time [s]; the five add up to all of it."""

    queue_s: float
    blackout_s: float
    serialisation_s: float
    propagation_s: float
    retransmission_s: float = 0.0


class Carrier(ABC):
    """One direction on the clock, without saying how packets get across.

    Attributes:
        name: ``up`` or ``down``.
        settings: what it can do.
        counters: what became of its packets, by topic.
        sent: packets offered so far.
        sent_bits: theirs, with headers.
        in_flight: packets queued, in service or propagating.

    """

    def __init__(
        self, env: simpy.Environment, name: DirectionName, settings: DirectionSettings, receive: Receive, emit: Emit
    ) -> None:
        self.name = name
        self.settings = settings
        self.counters = Counters()
        self.sent = self.sent_bits = self.in_flight = 0
        self._env = env
        self._receive = receive
        self._emit = emit
        self._started_s: float = env.now
        self._closed = False
        if settings.blackouts:
            env.process(self._tell_blackouts())

    @abstractmethod
    def send(self, topic: str, payload: bytes, text: str, priority: int, keep: bool = False) -> None:
        """See ``Direction.send``."""

    @abstractmethod
    def busy_s(self) -> float:
        """Time so far in which bits went out [s]."""

    @abstractmethod
    def close(self) -> None:
        """See ``Direction.close``."""

    def utilisation(self) -> float:
        """Share of the time so far in which bits went out, 0 to 1."""
        elapsed_s = self._env.now - self._started_s
        # Sums of floats: a packet that takes no time can leave a rounding below zero.
        return max(0.0, self.busy_s() / elapsed_s) if elapsed_s > 0.0 else 0.0

    def _offered(self, topic: str, size_bits: int) -> int:
        """Count a packet that is offered; its number."""
        if self._closed:
            raise LinkClosed(self.name, topic)
        number = self.sent
        self.sent += 1
        self.sent_bits += size_bits
        self.in_flight += 1
        return number

    def _end(self, packet: Packet, waits: Waits, service_s: float, outcome: str, reason: str = "") -> None:
        """Write the one record of a packet, now."""
        now_s = self._env.now
        ended = PacketEnded(
            t_s=now_s,
            direction=self.name,
            packet=packet.number,
            topic=packet.topic,
            payload_bytes=len(packet.payload),
            size_bits=packet.size_bits,
            sent_s=packet.sent_s,
            service_s=service_s,
            arrived_s=now_s if outcome == "delivered" else math.nan,
            queue_s=waits.queue_s,
            blackout_s=waits.blackout_s,
            serialisation_s=waits.serialisation_s,
            propagation_s=waits.propagation_s,
            outcome=outcome,
            reason=reason,
            text=packet.text,
            retransmission_s=waits.retransmission_s,
            priority=packet.priority,
        )
        self.in_flight -= 1
        self.counters(ended)
        self._emit(ended)

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
