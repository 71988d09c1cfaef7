"""What a packet or message waited for on its way, instant by instant, in whole nanoseconds. Pure functions.

Records tell how long each kind of wait was, not when. The last were in the air; of the time before, what was dark was
dark, and in the light the last seconds went into bits for good, those before into bits in vain, the rest into queueing.
That is exact where a blackout pauses a packet or none comes in between; of one that the dark made begin anew, or whose
fragments let others pass, the sums are exact and the order is this one.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter

from teleop_sim.core.records import MessageEnded, PacketEnded, Record
from teleop_sim.reports.intervals import Interval, both, minus, union
from teleop_sim.reports.lanes import dark

PHASES = {
    "queue": "queueing",
    "blackout": "blackout",
    "serialisation": "sending bits",
    "retransmission": "sending again",
    "propagation": "in the air",
}
"""What a packet waits for, to words."""


_start, _end = itemgetter(0), itemgetter(1)


def ns(t_s: float) -> int:
    """A time in whole nanoseconds, as the log stamps it."""
    return round(t_s * 1e9)


@dataclass(frozen=True, slots=True)
class Way:
    """From when something was offered to a direction to when it arrived, or to where it was lost [ns].

    ``air_ns``, ``again_ns``, ``bits_ns``: propagation, bits in vain, bits for good. ``lost``: it was dropped.
    """

    direction: str
    topic: str
    start_ns: int
    end_ns: int
    air_ns: int
    again_ns: int
    bits_ns: int
    lost: bool

    def phases(self, darkness: Sequence[Interval]) -> dict[str, list[Interval]]:
        """When it waited for what, by ``PHASES``: together all of its way.

        Args:
            darkness: blackouts of its direction [ns], as ``union`` gives them.

        """
        out_ns = max(self.start_ns, self.end_ns - self.air_ns)
        before: list[Interval] = [(self.start_ns, out_ns)] if out_ns > self.start_ns else []
        near = darkness[bisect_right(darkness, self.start_ns, key=_end) : bisect_left(darkness, out_ns, key=_start)]
        blackout = both(before, list(near)) if near else []
        light = minus(before, blackout) if near else before
        queue_or_vain, bits = _last(light, self.bits_ns)
        queue, vain = _last(queue_or_vain, self.again_ns)
        air: list[Interval] = [(out_ns, self.end_ns)] if self.end_ns > out_ns else []
        return dict(zip(PHASES, (queue, blackout, bits, vain, air), strict=True))


def _last(spans: list[Interval], length: int) -> tuple[list[Interval], list[Interval]]:
    """Cut off the last so many nanoseconds: what is before, and they."""
    after: list[Interval] = []
    for i in range(len(spans) - 1, -1, -1):
        if length <= 0:
            return spans[: i + 1], after[::-1]
        start, end = spans[i]
        cut = max(start, end - length)
        after.append((cut, end))
        length -= int(end - cut)
        if cut > start:
            return [*spans[:i], (start, cut)], after[::-1]
    return [], after[::-1]


def ways(records: Iterable[Record]) -> list[Way]:
    """All that went over the link, in the order in which it was offered.

    Of a direction whose messages are in the log (its delivery repeats or acknowledges) they, from the site's point of
    view; of others the packets. A message has one way however many copies it needed.
    """
    records = list(records)
    acknowledged = {r.direction for r in records if isinstance(r, MessageEnded)}
    made = [_message_way(r) for r in records if isinstance(r, MessageEnded)]
    made += [_packet_way(r) for r in records if isinstance(r, PacketEnded) and r.direction not in acknowledged]
    return sorted(made, key=lambda way: way.start_ns)


def _packet_way(r: PacketEnded) -> Way:
    end_s = r.t_s if math.isnan(r.arrived_s) else r.arrived_s
    return Way(r.direction, r.topic, ns(r.sent_s), ns(end_s), *_waits(r), r.outcome == "dropped")


def _message_way(r: MessageEnded) -> Way:
    waited_s = r.queue_s + r.blackout_s + r.serialisation_s + r.propagation_s + r.retransmission_s
    # What was given up may be recorded later, when its last copy has ended.
    end_s = min(r.sent_s + waited_s, r.t_s) if math.isnan(r.delivered_s) else r.delivered_s
    return Way(r.direction, r.topic, ns(r.sent_s), ns(end_s), *_waits(r), r.outcome == "dropped")


def _waits(r: PacketEnded | MessageEnded) -> tuple[int, int, int]:
    """In the air, in vain, for good; logs of before bits in vain were told apart have none."""
    again_s = 0.0 if math.isnan(r.retransmission_s) else r.retransmission_s
    return ns(r.propagation_s), ns(again_s), ns(r.serialisation_s)


def darkness_ns(records: Sequence[Record]) -> Mapping[str, list[Interval]]:
    """Blackouts of each direction [ns]."""
    return {name: union((ns(a), ns(b)) for a, b in dark(records, name)) for name in ("up", "down")}


def one_at_a_time(some: Iterable[Way]) -> Iterator[tuple[Way, Interval]]:
    """Each instant for the oldest that was on its way: ways in the order offered, with what no earlier one covers."""
    covered_ns = 0
    for way in some:
        start_ns = max(way.start_ns, covered_ns)
        if way.end_ns > start_ns:
            covered_ns = way.end_ns
            yield way, (start_ns, way.end_ns)
