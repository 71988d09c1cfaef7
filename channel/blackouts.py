"""Times in which a direction of the link is dark, as pure functions of a schedule.

A schedule is a tuple of ``(start_s, end_s)``, in order, without overlap; the last end may be ``math.inf``. A window is
half open: dark at its start, light at its end. Cost: logarithmic in the windows, linear in those that are touched.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from operator import itemgetter

from teleop_sim.core.errors import Problem

Schedule = tuple[tuple[float, float], ...]

_end_of = itemgetter(1)


def first_light(t_s: float, blackouts: Schedule) -> float:
    """The first instant at or after ``t_s`` at which bits can go out [s]; ``inf``: never."""
    for i in range(bisect_right(blackouts, t_s, key=_end_of), len(blackouts)):
        start_s, end_s = blackouts[i]
        if t_s < start_s:
            break
        t_s = end_s
    return t_s


def finish_of(start_s: float, bits: float, rate_bps: float, blackouts: Schedule) -> float:
    """When the last of ``bits`` is out, if the first may go at ``start_s`` [s]; ``inf``: never.

    Bits go out at ``rate_bps`` while it is light and not at all while it is dark; the rest goes out afterwards.
    """
    clock_s, left_s = start_s, bits / rate_bps
    for i in range(bisect_right(blackouts, start_s, key=_end_of), len(blackouts)):
        dark_s, light_s = blackouts[i]
        if clock_s < dark_s and clock_s + left_s <= dark_s:
            break
        # Rounding must not leave a negative rest.
        left_s = max(0.0, left_s - max(0.0, dark_s - clock_s))
        clock_s = light_s
    return clock_s + left_s


def dark_between(start_s: float, end_s: float, blackouts: Schedule) -> float:
    """How long it is dark from ``start_s`` to ``end_s`` [s]."""
    total_s = 0.0
    for i in range(bisect_right(blackouts, start_s, key=_end_of), len(blackouts)):
        dark_s, light_s = blackouts[i]
        if dark_s >= end_s:
            break
        total_s += min(light_s, end_s) - max(dark_s, start_s)
    return total_s


def schedule_problems(blackouts: Schedule, where: str) -> tuple[Problem, ...]:
    """All that is wrong with a schedule: times before zero or not numbers, backward windows, overlap, wrong order."""
    found: list[Problem] = []
    for i, (start_s, end_s) in enumerate(blackouts):
        here = f"{where}[{i}]"
        if not (math.isfinite(start_s) and start_s >= 0.0):
            found.append(Problem(here, f"a blackout that starts at {start_s} s", "Start at zero or later."))
        elif not end_s > start_s:
            found.append(Problem(here, f"it ends at {end_s} s, not after its start at {start_s} s", "Swap the times."))
        if i and start_s < blackouts[i - 1][1]:
            before = f"before the one ahead ends at {blackouts[i - 1][1]} s"
            found.append(Problem(here, f"it starts at {start_s} s, {before}", "Give blackouts in order, apart."))
    return tuple(found)
