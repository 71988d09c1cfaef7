"""A direction whose settings are neutral: FIFO, one rate, one delay, nothing lost, everything in closed form.

Because the sender knows the schedule, everything about a packet follows when it is offered: one timeout a packet, its
arrival. Only the head of the queue has one, so the clock's event list stays short.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import simpy

from teleop_sim.channel.blackouts import Schedule, dark_between, finish_of, first_light
from teleop_sim.channel.message import DirectionName
from teleop_sim.channel.radio_base import Carrier, Packet, Receive, Waits
from teleop_sim.channel.settings import DirectionSettings
from teleop_sim.core.records import Emit


@dataclass(slots=True, eq=False)
class Planned(Packet):
    """A packet and its times [s]: first in line, first bit out, last bit out, last bit in (``inf``: never)."""

    turn_s: float
    service_s: float
    finish_s: float
    arrive_s: float


def waits_until(packet: Planned, now_s: float, blackouts: Schedule) -> Waits:
    """Where a packet on its way has spent its time up to ``now_s``. They add up to ``now_s - sent_s``."""
    turn_s, finish_s = min(packet.turn_s, now_s), min(packet.finish_s, now_s)
    dark_before_s = dark_between(packet.sent_s, turn_s, blackouts)
    dark_after_s = dark_between(turn_s, finish_s, blackouts)
    return Waits(
        queue_s=turn_s - packet.sent_s - dark_before_s,
        blackout_s=dark_before_s + dark_after_s,
        serialisation_s=finish_s - turn_s - dark_after_s,
        propagation_s=now_s - finish_s,
    )


class PlannedRadio(Carrier):
    """See the module."""

    def __init__(
        self, env: simpy.Environment, name: DirectionName, settings: DirectionSettings, receive: Receive, emit: Emit
    ) -> None:
        super().__init__(env, name, settings, receive, emit)
        self._free_s: float = env.now
        self._busy_s = 0.0
        self._on_way: deque[Planned] = deque()

    def busy_s(self) -> float:
        """See ``Carrier``."""
        waits = (waits_until(p, self._env.now, self.settings.blackouts) for p in self._on_way)
        return self._busy_s + sum(w.serialisation_s for w in waits)

    def send(self, topic: str, payload: bytes, text: str, priority: int, keep: bool = False) -> None:
        """See ``Direction.send``."""
        del keep  # First in, first out: nothing is superseded.
        link, now_s = self.settings, self._env.now
        bits = 8 * (len(payload) + link.header_bytes)
        number = self._offered(topic, bits)
        turn_s = max(now_s, self._free_s)
        service_s = first_light(turn_s, link.blackouts)
        self._free_s = finish_s = finish_of(turn_s, bits, link.rate_bps, link.blackouts)
        arrive_s = finish_s + link.delay_s
        times = (now_s, turn_s, service_s, finish_s, arrive_s)
        self._on_way.append(Planned(number, topic, payload, text, priority, bits, *times))
        if len(self._on_way) == 1:
            self._await_head()

    def close(self) -> None:
        """See ``Direction.close``."""
        self._closed = True
        now_s = self._env.now
        while self._on_way:
            packet = self._on_way.popleft()
            waits = waits_until(packet, now_s, self.settings.blackouts)
            self._busy_s += waits.serialisation_s
            service_s = packet.service_s if packet.service_s <= now_s else math.nan
            self._end(packet, waits, service_s, "in_flight")

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
        waits = Waits(
            queue_s=packet.turn_s - packet.sent_s - dark_s,
            blackout_s=dark_s + dark_between(packet.turn_s, packet.finish_s, link.blackouts),
            serialisation_s=packet.size_bits / link.rate_bps,
            propagation_s=link.delay_s,
        )
        self._busy_s += waits.serialisation_s
        self._end(packet, waits, packet.service_s, "delivered")
        self._receive(packet.payload)
