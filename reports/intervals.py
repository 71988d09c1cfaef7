"""Sets of times as sorted, disjoint intervals. Pure functions."""

from __future__ import annotations

from collections.abc import Iterable

Interval = tuple[float, float]
"""From, to [s]."""


def union(intervals: Iterable[Interval]) -> list[Interval]:
    """Merge what overlaps or touches; drop what is empty."""
    merged: list[Interval] = []
    for start, end in sorted(i for i in intervals if i[1] > i[0]):
        if merged and start <= merged[-1][1]:
            merged[-1] = (merged[-1][0], max(end, merged[-1][1]))
        else:
            merged.append((start, end))
    return merged


def minus(some: list[Interval], others: list[Interval]) -> list[Interval]:
    """The part of ``some`` that is in none of ``others``; both as ``union`` gives them."""
    left: list[Interval] = []
    for start, end in some:
        at = start
        for off, on in others:
            if on <= at or off >= end:
                continue
            if off > at:
                left.append((at, off))
            at = max(at, on)
        if at < end:
            left.append((at, end))
    return left


def both(some: list[Interval], others: list[Interval]) -> list[Interval]:
    """The part of ``some`` that is in ``others`` too; both as ``union`` gives them."""
    return minus(some, minus(some, others))


def length_s(intervals: list[Interval]) -> float:
    """Total time of disjoint intervals [s]."""
    return sum(end - start for start, end in intervals)
