"""Sets of times as sorted, disjoint intervals, of seconds or of whole nanoseconds. Pure functions."""

from __future__ import annotations

from collections.abc import Iterable

Interval = tuple[float, float]
"""From, to [s, or whole ns]."""


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
    first = 0
    for start, end in some:
        at = start
        while first < len(others) and others[first][1] <= start:
            first += 1
        # An interval of ``others`` may reach into the next of ``some``, so that ``first`` stays.
        i = first
        while i < len(others) and others[i][0] < end:
            off, on = others[i]
            if off > at:
                left.append((at, off))
            at = max(at, on)
            i += 1
        if at < end:
            left.append((at, end))
    return left


def both(some: list[Interval], others: list[Interval]) -> list[Interval]:
    """The part of ``some`` that is in ``others`` too; both as ``union`` gives them."""
    return minus(some, minus(some, others))


def length_s(intervals: list[Interval]) -> float:
    """Total time of disjoint intervals, in their unit."""
    return sum(end - start for start, end in intervals)
