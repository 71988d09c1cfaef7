"""What one direction of the link can do: parameters that do not change within a run, checked when made."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, get_args

from teleop_sim.channel.blackouts import Schedule, schedule_problems
from teleop_sim.channel.framing import Framing
from teleop_sim.channel.jitter import Jitter, NoJitter
from teleop_sim.channel.loss import Loss, NoLoss
from teleop_sim.channel.queueing import DISCIPLINES, DROPS, Drop
from teleop_sim.channel.rates import RateSchedule, rate_at, rate_problems
from teleop_sim.core.errors import BadInput, Problem, unknown_name

OnDark = Literal["pause", "restart", "lose"]
"""A fragment under way when it gets dark: goes on afterwards, is sent again from its first bit, or is lost."""
OnDarkFlight = Literal["arrive", "lose"]
"""Bits in the air when it gets dark: arrive all the same, or are lost."""


@dataclass(frozen=True, slots=True)
class DirectionSettings:
    """What a direction can do, constant within a run. With the defaults it is a plain FIFO with a rate and a delay.

    Attributes:
        rate_bps: serialisation rate, above zero; ``inf`` means no serialisation time.
        delay_s: one-way propagation delay, zero or more.
        header_bytes: added to every fragment and charged to the rate.
        blackouts: ``(start_s, end_s)`` in order and apart; the last end may be ``math.inf``.
        rates: ``(from_s, rate_bps)``; when given they replace ``rate_bps``.
        delays: ``(from_s, delay_s)``; when given they replace ``delay_s``. A packet has the delay that holds when its
            last bit goes out.
        jitter: added to a packet's delay; the sum must not go below zero.
        reorder: whether a packet with less jitter overtakes; if not, it waits at the far end for those ahead.
        loss: of each fragment; a packet is lost if one of its fragments is.
        on_dark: what a blackout does to the fragment under way.
        on_dark_flight: what it does to the bits in the air.
        queue_limit: packets that may wait besides the one under way; 0 means no limit.
        discipline: who goes next, a name of ``queueing.DISCIPLINES``.
        drop: who goes away when there is no room.
        budget_bits: bits of all packets together, with headers; ``inf`` means no budget.
        mtu_bytes: see ``framing.Framing``; 0 means packets are never cut.

    Raises:
        BadInput: with all problems found.

    """

    rate_bps: float
    delay_s: float
    header_bytes: int = 0
    blackouts: Schedule = ()
    rates: RateSchedule = field(default=(), kw_only=True)
    delays: RateSchedule = field(default=(), kw_only=True)
    jitter: Jitter = field(default_factory=NoJitter, kw_only=True)
    reorder: bool = field(default=False, kw_only=True)
    loss: Loss = field(default_factory=NoLoss, kw_only=True)
    on_dark: OnDark = field(default="pause", kw_only=True)
    on_dark_flight: OnDarkFlight = field(default="arrive", kw_only=True)
    queue_limit: int = field(default=0, kw_only=True)
    discipline: str = field(default="fifo", kw_only=True)
    drop: Drop = field(default="tail", kw_only=True)
    budget_bits: float = field(default=math.inf, kw_only=True)
    mtu_bytes: int = field(default=0, kw_only=True)

    def __post_init__(self) -> None:
        if problems := (*_number_problems(self), *_name_problems(self)):
            raise BadInput(problems)

    @property
    def random(self) -> bool:
        """Whether random numbers are needed."""
        return self.jitter != NoJitter() or self.loss != NoLoss()

    @property
    def neutral(self) -> bool:
        """Whether everything about a packet is known when it is offered: only the first four fields are used."""
        first_four = (self.rate_bps, self.delay_s, self.header_bytes, self.blackouts)
        return self == DirectionSettings(*first_four, reorder=self.reorder)

    def delay_at(self, t_s: float) -> float:
        """The one-way delay in force [s], without jitter."""
        return rate_at(t_s, self.delays) if self.delays else self.delay_s

    @property
    def longest_delay_s(self) -> float:
        """The longest one-way delay at any time, without jitter."""
        return max((delay_s for _, delay_s in self.delays), default=self.delay_s)

    @property
    def framing(self) -> Framing:
        """How packets are cut and what headers they get."""
        return Framing(self.header_bytes, self.mtu_bytes)


def _number_problems(settings: DirectionSettings) -> tuple[Problem, ...]:
    rate_bps, delay_s, found = settings.rate_bps, settings.delay_s, list[Problem]()
    if not rate_bps > 0.0:
        found.append(Problem("rate_bps", f"a rate of {rate_bps} bit/s delivers nothing", "Give above zero."))
    if not (math.isfinite(delay_s) and delay_s >= 0.0):
        found.append(Problem("delay_s", f"a delay of {delay_s} s is impossible", "Give zero or more."))
    elif not delay_s + settings.jitter.least_s >= 0.0:
        what = f"a delay of {delay_s} s with {settings.jitter.least_s} s of jitter arrives before it goes"
        found.append(Problem("jitter", what, f"Give a delay of at least {-settings.jitter.least_s} s."))
    if settings.header_bytes < 0:
        found.append(Problem("header_bytes", f"{settings.header_bytes} bytes of header", "Give zero or more."))
    if settings.queue_limit < 0:
        found.append(
            Problem("queue_limit", f"room for {settings.queue_limit} packets", "Give zero (no limit) or more.")
        )
    if not settings.budget_bits > 8 * max(0, settings.header_bytes):
        what = f"a budget of {settings.budget_bits} bits is no more than one header"
        found.append(Problem("budget_bits", what, f"Give above {8 * max(0, settings.header_bytes)}."))
    if settings.mtu_bytes and not settings.mtu_bytes > max(0, settings.header_bytes):
        what = f"fragments of {settings.mtu_bytes} bytes hold no more than a header"
        found.append(Problem("mtu_bytes", what, f"Give 0 for no limit, or above {settings.header_bytes}."))
    return (
        *found,
        *schedule_problems(settings.blackouts, "blackouts"),
        *rate_problems(settings.rates, "rates"),
        *_delay_problems(settings),
    )


def _delay_problems(settings: DirectionSettings) -> tuple[Problem, ...]:
    """All that is wrong with a schedule of delays: the times as for rates, and delays that jitter takes below zero."""
    # Any rate will do: only the times are judged here.
    found = list(rate_problems(tuple((from_s, 1.0) for from_s, _ in settings.delays), "delays"))
    for i, (_, delay_s) in enumerate(settings.delays):
        if not (math.isfinite(delay_s) and delay_s + min(0.0, settings.jitter.least_s) >= 0.0):
            what = f"a delay of {delay_s} s with {settings.jitter.least_s} s of jitter arrives before it goes"
            found.append(Problem(f"delays[{i}]", what, "Give zero or more, and more than the jitter takes away."))
    return tuple(found)


def _name_problems(settings: DirectionSettings) -> tuple[Problem, ...]:
    names: dict[str, tuple[str, tuple[str, ...]]] = {
        "on_dark": (settings.on_dark, get_args(OnDark)),
        "on_dark_flight": (settings.on_dark_flight, get_args(OnDarkFlight)),
        "discipline": (settings.discipline, tuple(DISCIPLINES)),
        "drop": (settings.drop, DROPS),
    }
    return tuple(unknown_name(where, name, known) for where, (name, known) in names.items() if name not in known)
