"""Where a run's time went, in shares that add up to its duration. Pure functions."""

from __future__ import annotations

from collections.abc import Iterable

from teleop_sim.core.records import Record
from teleop_sim.reports.spans import asked, duration_s
from teleop_sim.reports.waterfall import CAUSES, time_by_cause

__all__ = ["SHARES", "asked", "duration_s", "where_time_went"]

SHARES = {
    "robot_s": "robot moving",
    "pacing_s": "pacing waits",
    "link_s": "waiting for the link",
    "operator_s": "operator thinking and acting",
    "other_s": "other",
}
"""Key of ``where_time_went`` to words for people."""


def where_time_went(records: Iterable[Record]) -> dict[str, float]:
    """Split a run's duration [s] into the keys of ``SHARES``, which add up to ``total_s``.

    They are the sums over the groups of ``waterfall.CAUSES``, which says what counts as what.
    """
    records = list(records)
    sums_ns = dict.fromkeys(SHARES, 0)
    for key, time_ns in time_by_cause(records).items():
        sums_ns[CAUSES[key].group] += time_ns
    return {**{key: time_ns / 1e9 for key, time_ns in sums_ns.items()}, "total_s": duration_s(records)}
