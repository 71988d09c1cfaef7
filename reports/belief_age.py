"""How old the newest thing is that the control station has been told: the age of information. Pure functions.

Source: S. Kaul, R. Yates, M. Gruteser, Real-time status: how often should one update?, Proc. IEEE INFOCOM (2012),
2731-2735. The age at a time is that time less when the newest update that has arrived was generated; here, when it was
handed to the link. It grows with slope one and falls when something newer arrives: a sawtooth, whose average over time
is the sum of its trapezoids over its length. One that comes late, after something newer, changes nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from itertools import pairwise

from teleop_sim.core.records import MessageEnded, PacketEnded, Record

PICTURES = frozenset({"image", "voxel_cloud", "hand_cloud"})
"""Topics that show the world: camera images and clouds of points."""


@dataclass(frozen=True)
class Tooth:
    """A stretch in which nothing newer arrived: from, to [s], and the age at its start [s]."""

    start_s: float
    end_s: float
    age_s: float

    @property
    def end_age_s(self) -> float:
        """Age at its end [s]."""
        return self.age_s + self.end_s - self.start_s


def teeth(records: Iterable[Record], end_s: float, topics: Collection[str] | None = None) -> list[Tooth]:
    """The sawtooth from the first arrival to the end of the run; nothing before it, for nothing is known then.

    Args:
        records: of the run. Where a delivery acknowledges, its messages count, not their packets.
        end_s: of the run.
        topics: what counts; None: everything that the downlink brings but acknowledgements.

    """
    records = list(records)
    down = [r for r in records if isinstance(r, PacketEnded | MessageEnded) and r.direction == "down"]
    kind = MessageEnded if any(isinstance(r, MessageEnded) for r in down) else PacketEnded
    come = [
        (r.delivered_s if isinstance(r, MessageEnded) else r.arrived_s, r.sent_s)
        for r in down
        if isinstance(r, kind) and r.outcome == "delivered" and _counts(r.topic, topics)
    ]
    newer: list[tuple[float, float]] = []
    for t_s, sent_s in sorted(come):
        if not newer or sent_s > newer[-1][1]:
            newer.append((t_s, sent_s))
    ends = [*newer, (end_s, end_s)]
    return [Tooth(a[0], b[0], a[0] - a[1]) for a, b in pairwise(ends) if b[0] > a[0]]


def _counts(topic: str, topics: Collection[str] | None) -> bool:
    return topic not in ("ack", "skip") if topics is None else topic in topics


def mean_s(some: Iterable[Tooth]) -> float | None:
    """Average over time [s]: the trapezoids over their length. None: nothing ever arrived."""
    some = list(some)
    whole_s = sum(tooth.end_s - tooth.start_s for tooth in some)
    area = sum(0.5 * (tooth.age_s + tooth.end_age_s) * (tooth.end_s - tooth.start_s) for tooth in some)
    return area / whole_s if whole_s > 0.0 else None


def quantile_s(some: Iterable[Tooth], share: float) -> float | None:
    """Age [s] that is not exceeded for that share of the time, exactly. None: nothing ever arrived."""
    some = list(some)
    whole_s = sum(tooth.end_s - tooth.start_s for tooth in some)
    if whole_s <= 0.0:
        return None
    # How many teeth hold an age: between two of these ages the time below grows at that rate.
    slopes: dict[float, int] = {}
    for tooth in some:
        slopes[tooth.age_s] = slopes.get(tooth.age_s, 0) + 1
        slopes[tooth.end_age_s] = slopes.get(tooth.end_age_s, 0) - 1
    ages = sorted(slopes)
    below_s, slope = 0.0, 0
    for low_s, high_s in pairwise(ages):
        slope += slopes[low_s]
        grown_s = slope * (high_s - low_s)
        if slope and below_s + grown_s >= share * whole_s:
            return min(low_s + (share * whole_s - below_s) / slope, high_s)
        below_s += grown_s
    return ages[-1]
