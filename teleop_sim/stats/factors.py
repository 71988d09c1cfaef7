"""Factors of an experiment: a name with values or a range. Reads ``64bps,380bps`` and ``64bps:4kbps:7:log``."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from teleop_sim.stats.estimate import refuse

Value = bool | int | float | str
SCALES = ("lin", "log")


@dataclass(frozen=True, slots=True)
class Range:
    """Numbers from one end to the other.

    Attributes:
        low: lower end, in the unit of the factor.
        high: upper end, above ``low``.
        points: how many a grid takes, both ends included; 0: a grid cannot, only designs that fill space.
        scale: ``lin``: equal steps; ``log``: equal ratios.

    Whole ends make whole points. Others are rounded to 9 digits, so that a cell has one name on every processor.

    Raises:
        BadInput: ends in the wrong order or not finite, a logarithm of what is not above zero, one point, or whole
            points that fall together.

    """

    low: float
    high: float
    points: int = 0
    scale: str = "lin"

    def __post_init__(self) -> None:
        where, text = "range", f"{self.low:g}:{self.high:g}:{self.points}:{self.scale}"
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            raise refuse(where, f"{text}: the ends", "Give a lower and a higher number.")
        if self.scale not in SCALES:
            raise refuse(where, f"{text}: unknown scale {self.scale!r}", f"Known: {', '.join(SCALES)}.")
        if self.scale == "log" and self.low <= 0.0:
            raise refuse(where, f"{text}: no logarithm of {self.low:g}", "Start above zero, or space linearly.")
        if self.points < 0 or self.points == 1:
            raise refuse(where, f"{text}: {self.points} points", "Give two or more: both ends count.")
        if len(set(spaced(self))) < self.points:
            raise refuse(where, f"{text}: whole numbers that repeat", "Give fewer points or ends like 1.0.")


@dataclass(frozen=True, slots=True)
class Factor:
    """What an experiment varies.

    Attributes:
        name: of the column and of what it sets.
        levels: values, or a range.

    Raises:
        BadInput: no value, or one twice.

    """

    name: str
    levels: tuple[Value, ...] | Range

    def __post_init__(self) -> None:
        if not isinstance(self.levels, Range) and (not self.levels or len(set(self.levels)) < len(self.levels)):
            raise refuse(self.name, f"levels {self.levels}", "Give one or more different values.")


def at(levels: tuple[Value, ...] | Range, unit: float) -> Value:
    """The value at a place in [0, 1]: along a range, or one of a list in equal parts."""
    if not isinstance(levels, Range):
        # 2/3 of 3 is 1.9999999999999998 on its way from a design.
        return levels[min(int(unit * len(levels) + 1e-9), len(levels) - 1)]
    low, high = levels.low, levels.high
    if unit <= 0.0 or unit >= 1.0:
        return low if unit <= 0.0 else high
    exact = low * (high / low) ** unit if levels.scale == "log" else low + (high - low) * unit
    return round(exact) if isinstance(low, int) and isinstance(high, int) else float(f"{exact:.9g}")


def spaced(levels: Range) -> tuple[Value, ...]:
    """The points of a range, from low to high."""
    return tuple(at(levels, i / (levels.points - 1)) for i in range(levels.points))


def grid_levels(factor: Factor) -> tuple[Value, ...]:
    """The values that a full grid takes.

    Raises:
        BadInput: a range that does not say how many.

    """
    if not isinstance(factor.levels, Range):
        return factor.levels
    if not factor.levels.points:
        hint = f"Add a number, as in {factor.levels.low:g}:{factor.levels.high:g}:4, or take another design."
        raise refuse(factor.name, "a range without a number of points makes no grid", hint)
    return spaced(factor.levels)


def parse_levels(text: str, where: str, read: Callable[[str, str], Value]) -> tuple[Value, ...] | Range:
    """Levels from text.

    Args:
        text: items between commas, each a value or ``low:high``, ``low:high:points`` or ``low:high:points:log``.
        where: place, for complaints.
        read: makes a value of one piece of text, given ``where`` too, such as
        :func:`teleop_sim.core.units.parse_rate_bps`.

    Returns:
        A range if the text is one; otherwise the values, ranges among them spelt out.

    Raises:
        BadInput: from ``read``, or an item that is not understood, or a value twice.

    """
    items = [item.strip() for item in text.split(",")]
    parts = [_item(item, where, read) for item in items]
    if len(parts) == 1 and isinstance(parts[0], Range):
        return parts[0]
    spelt: list[Value] = []
    for part in parts:
        spelt += grid_levels(Factor(where, part)) if isinstance(part, Range) else [part]
    return grid_levels(Factor(where, tuple(spelt)))


def _item(item: str, where: str, read: Callable[[str, str], Value]) -> Value | Range:
    pieces = [piece.strip() for piece in item.split(":")]
    if len(pieces) == 1:
        return read(item, where)
    hint = "Give low:high:points or low:high:points:log, such as 64bps:4kbps:7:log."
    if len(pieces) > 4 or not all(pieces) or not (len(pieces) < 3 or pieces[2].isdecimal()):
        raise refuse(where, f"{item!r} is no range", hint)
    low, high = read(pieces[0], where), read(pieces[1], where)
    if isinstance(low, bool | str) or isinstance(high, bool | str):
        raise refuse(where, f"{item!r}: the ends are no numbers", hint)
    return Range(low, high, int(pieces[2]) if len(pieces) > 2 else 0, pieces[3] if len(pieces) > 3 else "lin")
