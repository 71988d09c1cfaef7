"""Where a run's time went, in shares that add up to its duration. Pure functions."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from teleop_sim.channel.messages import MESSAGES
from teleop_sim.core.records import (
    EpisodeEnded,
    OperatorActed,
    PacketEnded,
    Record,
    Released,
    Requested,
    RunEnded,
    TransitionTaken,
    Waited,
)
from teleop_sim.reports.intervals import Interval, both, length_s, minus, union

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

    Every instant counts once, for the first that fits: a skill was under way; a pacing wait; the field site was waiting
    for an answer, and the operator was at work on it (``operator_s``) or not (``link_s``: the request or a command was
    queueing, being sent or travelling; what the operator does meanwhile holds up nothing). ``other_s`` is the rest,
    such as a machine that stands finished.
    """
    records = list(records)
    whole = [(0.0, duration_s(records))]
    robot = both(whole, union((r.start_s, r.t_s) for r in records if isinstance(r, EpisodeEnded)))
    paced = union((r.start_s, r.t_s) for r in records if isinstance(r, Waited) and r.kind == "pacing")
    pacing = minus(both(whole, paced), robot)
    asking = minus(minus(both(whole, union(asked(records))), robot), pacing)
    acting = union((r.start_s, r.t_s) for r in records if isinstance(r, OperatorActed))
    operator = minus(both(asking, acting), union(_on_the_way(records)))
    parts = [length_s(part) for part in (robot, pacing, minus(asking, operator), operator)]
    total_s = length_s(whole)
    return dict(zip((*SHARES, "total_s"), (*parts, max(total_s - sum(parts), 0.0), total_s), strict=True))


def duration_s(records: Sequence[Record]) -> float:
    """Time at which the run ended, or of the last record of an interrupted run [s]."""
    ends = [r.t_s for r in records if isinstance(r, RunEnded)]
    return ends[-1] if ends else max((r.t_s for r in records), default=0.0)


def _on_the_way(records: Sequence[Record]) -> list[Interval]:
    """When a request was on its way to the operator or a command to the robot, or to where it was lost."""
    return [
        (r.sent_s, r.t_s if math.isnan(r.arrived_s) else r.arrived_s)
        for r in records
        # An acknowledgement on the uplink is no command.
        if isinstance(r, PacketEnded) and (r.topic == "request" or (r.direction == "up" and r.topic in MESSAGES))
    ]


def asked(records: Sequence[Record]) -> list[Interval]:
    """When the field site waited for its operator.

    From each request to its answer, or to the next transition where something else moved the machine on, or to the end;
    and whatever the field site itself logged as a wait for the operator.
    """
    waits = [(r.start_s, r.t_s) for r in records if isinstance(r, Waited) and r.kind == "operator"]
    pending: dict[int, float] = {}
    for r in records:
        if isinstance(r, Requested):
            pending.setdefault(r.request, r.t_s)
        elif isinstance(r, TransitionTaken):
            waits += [(start_s, r.t_s) for start_s in pending.values()]
            pending.clear()
        elif isinstance(r, Released) and r.effect == "answered" and r.request in pending:
            waits.append((pending.pop(r.request), r.t_s))
    end_s = duration_s(records)
    return waits + [(start_s, end_s) for start_s in pending.values()]
