"""Rates that change with time, together with blackouts, as pure functions of two schedules.

A rate schedule is a tuple of ``(from_s, rate_bps)`` in order, the first from zero. A rate holds from its instant on, up
to the next; the last holds for ever. A change loses nothing: the bits of a packet that are out stay out, the rest goes
on at the new rate.

Rates are above zero (a pause is a blackout, so that it is recorded as one); ``math.inf`` means no serialisation time.
Every function wants at least one entry and times at or after zero. Cost: logarithmic in both schedules, linear in what
is touched.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from operator import itemgetter

from teleop_sim.channel import blackouts as dark
from teleop_sim.channel.blackouts import Schedule, dark_between
from teleop_sim.core.errors import Problem

RateSchedule = tuple[tuple[float, float], ...]

_from_of = itemgetter(0)


def rate_at(t_s: float, rates: RateSchedule) -> float:
    """The rate at ``t_s`` [bit/s], were it light; at a change, the new one."""
    return rates[_piece(t_s, rates)][1]


def light_between(a_s: float, b_s: float, blackouts: Schedule) -> float:
    """How long it is light from ``a_s`` to ``b_s`` [s]; ``b_s`` may be ``inf``."""
    if blackouts and math.isinf(blackouts[-1][1]):
        b_s = min(b_s, blackouts[-1][0])
    return b_s - a_s - dark_between(a_s, b_s, blackouts) if b_s > a_s else 0.0


def bits_between(a_s: float, b_s: float, rates: RateSchedule, blackouts: Schedule = ()) -> float:
    """How many bits can go out from ``a_s`` to ``b_s``: the sum of rate times light, piece by piece.

    ``inf`` as soon as an infinite rate has any light; ``b_s`` may be ``inf``.
    """
    bits = 0.0
    for i in range(_piece(a_s, rates), len(rates)):
        until_s = min(_until(i, rates), b_s)
        bits += _capacity(a_s, until_s, rates[i][1], blackouts)
        if until_s >= b_s:
            break
        a_s = until_s
    return bits


def finish_of(start_s: float, bits: float, rates: RateSchedule, blackouts: Schedule = ()) -> float:
    """When the last of ``bits`` is out, if the first may go at ``start_s`` [s]; ``inf``: never.

    Inverse of ``bits_between`` for finite rates: ``bits_between(start_s, finish_of(start_s, bits)) == bits``. For one
    rate it is ``blackouts.finish_of``, to the last digit.
    """
    clock_s, left_bits = start_s, bits
    i = _piece(start_s, rates)
    while i < len(rates) - 1:
        until_s = _until(i, rates)
        fit_bits = _capacity(clock_s, until_s, rates[i][1], blackouts)
        if left_bits <= fit_bits:
            break
        clock_s, left_bits = until_s, left_bits - fit_bits
        i += 1
    return dark.finish_of(clock_s, left_bits, rates[i][1], blackouts)


def rate_problems(rates: RateSchedule, where: str) -> tuple[Problem, ...]:
    """All that is wrong with a schedule of rates: rates not above zero, a late start, times that do not increase.

    No entry is no problem: a direction then has its one ``rate_bps``.
    """
    found: list[Problem] = []
    for i, (from_s, rate_bps) in enumerate(rates):
        here = f"{where}[{i}]"
        if not rate_bps > 0.0:
            hint = "Give above zero; give a pause as a blackout."
            found.append(Problem(here, f"a rate of {rate_bps} bit/s delivers nothing", hint))
        if i == 0 and from_s != 0.0:
            found.append(Problem(here, f"the first rate holds from {from_s} s", "Begin at 0 s."))
        elif not math.isfinite(from_s):
            found.append(Problem(here, f"a rate from {from_s} s on", "Give a finite time."))
        elif i and not from_s > rates[i - 1][0]:
            late = f"it holds from {from_s} s, not after the one ahead ({rates[i - 1][0]} s)"
            found.append(Problem(here, late, "Give rates in order, one for an instant."))
    return tuple(found)


def _piece(t_s: float, rates: RateSchedule) -> int:
    return max(0, bisect_right(rates, t_s, key=_from_of) - 1)


def _until(i: int, rates: RateSchedule) -> float:
    return rates[i + 1][0] if i + 1 < len(rates) else math.inf


def _capacity(a_s: float, b_s: float, rate_bps: float, blackouts: Schedule) -> float:
    light_s = light_between(a_s, b_s, blackouts)
    # An infinite rate in no time is no bit, not NaN.
    return rate_bps * light_s if light_s > 0.0 else 0.0
