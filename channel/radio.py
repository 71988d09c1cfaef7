"""A direction as a radio on the clock: everything that ``DirectionSettings`` can ask for. See docs/link.md.

One thing is under way at a time: a fragment. Between two fragments the queue says who is next. All times are computed
from the schedules, not added up event by event, so that they are exact over changes of rate and blackouts.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from dataclasses import dataclass
from functools import partial
from operator import itemgetter

import numpy as np
import simpy

from teleop_sim.channel.blackouts import Schedule, dark_between, first_light
from teleop_sim.channel.drops import BLACKOUT, BUDGET, LOST
from teleop_sim.channel.message import DirectionName
from teleop_sim.channel.queueing import DISCIPLINES, Waiting
from teleop_sim.channel.radio_base import Carrier, Packet, Receive, Waits
from teleop_sim.channel.rates import finish_of
from teleop_sim.channel.settings import DirectionSettings
from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.core.records import Emit

GRAIN_S = 1e-9
"""Rounding of a time [s], with room to spare: light or dark as short as this is none. Rounding decides no fate."""

_start_of = itemgetter(0)


def next_dark(t_s: float, blackouts: Schedule) -> float:
    """When the first blackout after ``t_s`` starts [s]; ``inf``: none."""
    i = bisect_right(blackouts, t_s, key=_start_of)
    return blackouts[i][0] if i < len(blackouts) else math.inf


@dataclass(slots=True, eq=False)
class Load(Packet):
    """A packet on its way through a radio.

    Attributes:
        fragments: sizes with headers [bit].
        jitter_s: what is added to its delay.
        keep: whether it is neither superseded nor superseding.
        out: fragments that are out.
        service_s: when the first bit went out (NaN: not yet).
        light_s: time in which bits went out for good.
        vain_s: time in which bits went out that are sent again.
        finish_s: when the last bit was out (``inf``: not yet).
        arrive_s: when the last bit arrives.
        fate: why it will not arrive whole; empty: it will.

    """

    fragments: tuple[int, ...]
    jitter_s: float
    keep: bool = False
    out: int = 0
    service_s: float = math.nan
    light_s: float = 0.0
    vain_s: float = 0.0
    finish_s: float = math.inf
    arrive_s: float = math.inf
    fate: str = ""


class Radio(Carrier):
    """See the module.

    Args:
        env: the clock.
        name: of the direction.
        settings: what it can do; neutral ones too.
        receive: told of each payload that arrives.
        emit: told of each record.
        rng: for loss and jitter; each gets a child of its own, so that one's draws never shift the other's.

    Raises:
        BadInput: loss or jitter without ``rng``.

    """

    def __init__(
        self,
        env: simpy.Environment,
        name: DirectionName,
        settings: DirectionSettings,
        receive: Receive,
        emit: Emit,
        rng: np.random.Generator | None = None,
    ) -> None:
        super().__init__(env, name, settings, receive, emit)
        if settings.random and rng is None:
            raise BadInput((Problem("rng", "loss and jitter need random numbers", "Give a generator as rng."),))
        # Models that draw nothing get a generator too; they never use it.
        self._loss_rng, self._jitter_rng = (rng or np.random.default_rng(0)).spawn(2)
        self._framing = settings.framing
        self._rates = settings.rates or ((0.0, settings.rate_bps),)
        self._left_bits = settings.budget_bits
        self._waiting: Waiting[Load] = DISCIPLINES[settings.discipline](settings.queue_limit, settings.drop)
        self._serving: Load | None = None
        self._began_s = self._until_s = self._free_s = float(env.now)
        self._cut = self._bad = False
        # The event that ends the fragment under way or the dark; any other that comes is out of date.
        self._wake: simpy.Event | None = None
        self._busy_s = 0.0
        self._flying: dict[int, Load] = {}
        self._in_order: deque[Load] = deque()
        self._last_arrive_s = -math.inf

    def busy_s(self) -> float:
        """See ``Carrier``."""
        return self._busy_s + (self._spent_s(self._env.now) if self._serving else 0.0)

    def send(self, topic: str, payload: bytes, text: str, priority: int, keep: bool = False) -> None:
        """See ``Direction.send``."""
        fragments = self._framing.fragments(len(payload))
        bits = sum(fragments)
        number = self._offered(topic, bits)
        # Drawn for every packet offered: what becomes of the others does not shift it.
        jitter_s = self.settings.jitter.draw_s(self._jitter_rng)
        load = Load(number, topic, payload, text, priority, bits, self._env.now, fragments, jitter_s, keep)
        if gone := self._waiting.push(load):
            self._drop(*gone)
        self._serve_next()

    def switch_rate(self, rate_bps: float) -> None:
        """See ``Direction.switch_rate``."""
        now_s = self._env.now
        self._rates = (*(piece for piece in self._rates if piece[0] < now_s), (now_s, rate_bps))
        if self._serving:
            self._plan_end(self._serving)

    def close(self) -> None:
        """See ``Direction.close``."""
        if self._closed:
            return
        self._closed = True
        on_way = [*self._flying.values(), *self._waiting, *([self._serving] if self._serving else [])]
        self._busy_s = self.busy_s()
        for load in sorted(on_way, key=lambda p: p.number):
            self._end(load, self._waits(load), load.service_s, "in_flight")
        self._serving = None
        self._flying.clear()

    # The radio

    def _serve_next(self) -> None:
        """Begin a fragment of whoever is next, when it is light."""
        # Who is told of a drop may send at once, and find the radio free.
        while self._wake is None and len(self._waiting):
            turn_s = max(self._env.now, self._free_s)
            light_s = self._first_chance(turn_s)
            if light_s > turn_s:
                # Who is next is settled when it gets light: more urgent and newer ones may come.
                self._free_s = light_s
                self._wake_at(light_s)
                return
            load = self._waiting.pop()
            if math.isnan(load.service_s) and not self._afford(load):
                continue
            self._begin(load, turn_s)
            return

    def _first_chance(self, t_s: float) -> float:
        """When a fragment may begin: in the light, and with some of it left if the dark would cut it off."""
        blackouts = self.settings.blackouts
        light_s = first_light(t_s, blackouts)
        while self.settings.on_dark != "pause" and next_dark(light_s, blackouts) - light_s <= GRAIN_S:
            light_s = first_light(next_dark(light_s, blackouts), blackouts)
        return light_s

    def _afford(self, load: Load) -> bool:
        """Take the whole packet from the budget, or drop it. What is sent again is not charged again."""
        if load.size_bits > self._left_bits:
            self._drop(load, BUDGET)
            return False
        self._left_bits -= load.size_bits
        return True

    def _begin(self, load: Load, now_s: float) -> None:
        if math.isnan(load.service_s):
            load.service_s = now_s
        self._serving, self._began_s = load, now_s
        self._plan_end(load)

    def _plan_end(self, load: Load) -> None:
        """Settle when the fragment under way ends, and whether the dark cuts it off."""
        link, bits = self.settings, load.fragments[load.out]
        if link.on_dark == "pause":
            self._cut, self._until_s = False, finish_of(self._began_s, bits, self._rates, link.blackouts)
        else:
            whole_s, dark_s = finish_of(self._began_s, bits, self._rates, ()), next_dark(self._began_s, link.blackouts)
            self._cut, self._until_s = whole_s > dark_s + GRAIN_S, min(whole_s, dark_s)
        self._wake_at(self._until_s)

    def _wake_at(self, t_s: float) -> None:
        """Wake up once, then; an earlier wish is forgotten."""
        if math.isinf(t_s):
            # Never: an event that nobody triggers says that the radio has something to wait for.
            self._wake = self._env.event()
            return
        self._wake = self._env.timeout(max(0.0, t_s - self._env.now))
        self._wake.callbacks.append(self._wakes)

    def _wakes(self, event: simpy.Event) -> None:
        if self._closed or event is not self._wake:
            return
        self._wake = None
        if self._serving:
            self._fragment_ends(self._serving)
        self._serve_next()

    def _fragment_ends(self, load: Load) -> None:
        spent_s = self._spent_s(self._until_s)
        self._busy_s += spent_s
        self._free_s, self._serving = self._until_s, None
        if self._cut and self.settings.on_dark == "restart":
            load.vain_s += spent_s
            self._waiting.put_back(load)
            return
        load.light_s += spent_s
        if self._cut:
            self._drop(load, BLACKOUT)
            return
        load.out += 1
        fate = self._fate(load)
        load.fate = load.fate or fate
        if load.out < len(load.fragments):
            self._waiting.put_back(load)
        else:
            self._launch(load)

    def _fate(self, load: Load) -> str:
        """What happens to the fragment that is out, on its way: a reason, or nothing."""
        link = self.settings
        # Two draws a fragment whatever happens to it, so that blackouts do not shift them.
        self._bad, lost = link.loss.step(self._bad, self._loss_rng)
        flight_s = self._flight_s(load)
        fragile = link.on_dark_flight == "lose" and flight_s > 0.0
        if fragile and next_dark(self._began_s, link.blackouts) < self._until_s + flight_s - GRAIN_S:
            return BLACKOUT
        return LOST if lost else ""

    def _flight_s(self, load: Load) -> float:
        """How long the bit that now goes out is in the air. Rounding must not go below zero."""
        return max(0.0, self.settings.delay_at(self._until_s) + load.jitter_s)

    def _spent_s(self, until_s: float) -> float:
        """Light time that the fragment under way has had."""
        return max(0.0, until_s - self._began_s - dark_between(self._began_s, until_s, self.settings.blackouts))

    # The air

    def _launch(self, load: Load) -> None:
        load.finish_s, load.arrive_s = self._until_s, self._until_s + self._flight_s(load)
        self._flying[load.number] = load
        if load.fate or self.settings.reorder:
            # Its own timeout: what does not arrive holds nobody up, and with reordering nobody does.
            wake = self._env.timeout(max(0.0, load.arrive_s - self._env.now))
            wake.callbacks.append(partial(self._lands, load))
            return
        load.arrive_s = self._last_arrive_s = max(load.arrive_s, self._last_arrive_s)
        self._in_order.append(load)
        if len(self._in_order) == 1:
            self._await_first()

    def _await_first(self) -> None:
        """Wake up when the first packet in the air arrives; the others come no earlier."""
        wake = self._env.timeout(max(0.0, self._in_order[0].arrive_s - self._env.now))
        wake.callbacks.append(self._first_lands)

    def _first_lands(self, _: simpy.Event) -> None:
        if self._closed:
            return
        load = self._in_order.popleft()
        if self._in_order:
            self._await_first()
        self._arrive(load)

    def _lands(self, load: Load, _: simpy.Event) -> None:
        if not self._closed:
            self._arrive(load)

    def _arrive(self, load: Load) -> None:
        del self._flying[load.number]
        if load.fate:
            self._drop(load, load.fate)
            return
        self._end(load, self._waits(load), load.service_s, "delivered")
        self._receive(load.payload)

    # The books

    def _drop(self, load: Load, reason: str) -> None:
        self._end(load, self._waits(load), load.service_s, "dropped", reason)

    def _waits(self, load: Load) -> Waits:
        """Where a packet has spent its time up to now. They add up to all of it, to rounding."""
        now_s = self._env.now
        finish_s = min(load.finish_s, now_s)
        light_s = load.light_s + (self._spent_s(now_s) if load is self._serving else 0.0)
        dark_s = dark_between(load.sent_s, finish_s, self.settings.blackouts)
        return Waits(
            # Differences of times: rounding may leave a hair below zero.
            queue_s=max(0.0, finish_s - load.sent_s - dark_s - light_s - load.vain_s),
            blackout_s=dark_s,
            serialisation_s=light_s,
            propagation_s=now_s - finish_s,
            retransmission_s=load.vain_s,
        )
