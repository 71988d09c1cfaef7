"""Units at the edge: text such as ``380bps`` or ``250ms`` to plain SI floats and back.

Inside the program a quantity is a float whose name carries its unit (``rate_bps``, ``delay_s``).
"""

from __future__ import annotations

import math
import re

from teleop_sim.core.errors import BadInput, Problem

# Decimal prefixes only: on links k means 1000 (IEEE 1541 keeps Ki for 1024).
RATE_UNITS = {"bps": 1.0, "kbps": 1e3, "mbps": 1e6, "gbps": 1e9, "bit/s": 1.0, "kbit/s": 1e3, "mbit/s": 1e6}
TIME_UNITS = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}

_NUMBER = re.compile(r"\s*([-+]?(?:\d+(?:_\d+)*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([A-Za-z/µ]*)\s*\Z")


def parse_rate_bps(text: str, where: str) -> float:
    """Bits per second from text with a unit, such as ``380bps`` or ``4kbps``.

    Raises:
        BadInput: no number, no or an unknown unit, or a rate that is not above zero.

    """
    value = _parse(text, where, RATE_UNITS, "a rate with its unit, such as 380bps, 4kbps or 0.38Mbps")
    if value <= 0.0:
        raise BadInput((Problem(where, f"a rate of {text} delivers nothing", "Give a rate above zero."),))
    return value


def parse_time_s(text: str, where: str) -> float:
    """Seconds from text with a unit, such as ``10s``, ``250ms`` or ``3min``.

    Raises:
        BadInput: no number, no or an unknown unit, or a negative time.

    """
    value = _parse(text, where, TIME_UNITS, "a time with its unit, such as 10s, 250ms or 3min")
    if value < 0.0:
        raise BadInput((Problem(where, f"{text} is a negative time", "Give zero or more."),))
    return value


def _parse(text: str, where: str, units: dict[str, float], example: str) -> float:
    found = _NUMBER.match(text)
    scale = units.get(found[2].lower().replace("µ", "u")) if found else None
    value = float(found[1]) * scale if found is not None and scale is not None else math.nan
    if not math.isfinite(value):
        raise BadInput((Problem(where, f"{text!r} is not understood", f"Give {example}."),))
    return value


def format_rate(rate_bps: float) -> str:
    """Text for people: ``380 bit/s``, ``4 kbit/s``, ``2 Mbit/s``."""
    for scale, unit in ((1e9, "Gbit/s"), (1e6, "Mbit/s"), (1e3, "kbit/s")):
        # What four digits would round up to 10000 of a unit is one of the next.
        if rate_bps >= 0.99995 * scale:
            return f"{rate_bps / scale:.4g} {unit}"
    return f"{rate_bps:.4g} bit/s"


def format_time(time_s: float) -> str:
    """Text for people: ``250 ms``, ``12.3 s``, ``4 min 45 s``; ``never`` for what is no time."""
    if not math.isfinite(time_s):
        return "never"
    # What three digits would round up to 1000 ms is a second.
    if abs(time_s) < 0.9995:
        return f"{time_s * 1e3:.3g} ms"
    if abs(time_s) < 120.0:
        return f"{time_s:.3g} s"
    minutes, seconds = divmod(round(time_s), 60)
    return f"{minutes} min {seconds} s" if seconds else f"{minutes} min"


def format_quantity(name: str, value: object) -> str:
    """A value for people, by the unit in its name: ``uplink_bps`` 64.0 is ``64 bit/s``."""
    if isinstance(value, float) and name.endswith("_bps"):
        return format_rate(value)
    if isinstance(value, float) and name.endswith("_s"):
        return f"{value:g} s"
    return f"{value:g}" if isinstance(value, float) else str(value)
