"""Links that cannot deliver anything are refused before anything is sent, with the reason."""

from __future__ import annotations

import math
from dataclasses import replace

from teleop_sim.channel.blackouts import Schedule
from teleop_sim.channel.rates import bits_between
from teleop_sim.channel.settings import DirectionSettings
from teleop_sim.channel.tcp import tcp_problems
from teleop_sim.core.errors import BadInput, Problem

SMALLEST_PAYLOAD_BYTES = 1


def refuse_undeliverable(settings: DirectionSettings, until_s: float, where: str) -> None:
    """Do nothing if a payload of one byte can get through before ``until_s``.

    Raises:
        BadInput: with every reason why it cannot.

    """
    if problems := undeliverable(settings, until_s, where):
        raise BadInput(problems)


def undeliverable(settings: DirectionSettings, until_s: float, where: str, tcp_bytes: int = 0) -> tuple[Problem, ...]:
    """Why not even a payload of one byte gets through: the budget, the dark, or light that is too short.

    Where TCP is used, ``tcp_bytes`` is the smallest packet that it needs there (``tcp.least_packet_bytes``); then also
    what keeps a direction from carrying TCP at all.

    How short is too short follows from the rule for blackouts: a fragment that pauses goes out in pieces, one that
    starts again or is lost needs one stretch of light for all of its bits.
    """
    smallest_bits = 8 * (settings.header_bytes + max(SMALLEST_PAYLOAD_BYTES, tcp_bytes))
    found: list[Problem] = []
    if tcp_bytes:
        found += (replace(problem, where=f"{where}.{problem.where}") for problem in tcp_problems(settings, tcp_bytes))
    if settings.budget_bits < smallest_bits:
        least = "one packet of TCP" if tcp_bytes else "one header and one byte"
        what = f"a budget of {settings.budget_bits:g} bits is below {least} ({smallest_bits} bits)"
        found.append(Problem(f"{where}.budget_bits", what, f"Give at least {smallest_bits}."))
    rates = settings.rates or ((0.0, settings.rate_bps),)
    lights = light_windows(settings.blackouts, until_s)
    most_bits = [bits_between(a_s, b_s, rates) for a_s, b_s in lights]
    enough = math.fsum(most_bits) if settings.on_dark == "pause" else max(most_bits, default=0.0)
    if not lights:
        found.append(Problem(f"{where}.blackouts", "it is dark all the time", "Leave some light."))
    elif enough < smallest_bits:
        longest_s = max(b_s - a_s for a_s, b_s in lights)
        what = (
            f"the longest light, {longest_s:g} s, carries {enough:g} bits; one fragment has {smallest_bits} "
            f"and the rule for blackouts is {settings.on_dark!r}"
        )
        found.append(Problem(f"{where}.blackouts", what, "Give more light, a higher rate, or the rule 'pause'."))
    return tuple(found)


def light_windows(blackouts: Schedule, until_s: float) -> Schedule:
    """The stretches of light from zero to ``until_s`` as (start, end) [s]."""
    lights: list[tuple[float, float]] = []
    clock_s = 0.0
    for dark_s, light_s in blackouts:
        if dark_s >= until_s:
            break
        if dark_s > clock_s:
            lights.append((clock_s, dark_s))
        clock_s = light_s
    if clock_s < until_s:
        lights.append((clock_s, until_s))
    return tuple(lights)
