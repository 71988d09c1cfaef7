"""The lanes of a run's link: each direction's state, queue and packets. Pure functions of records."""

from __future__ import annotations

import math
from collections.abc import Sequence

from teleop_sim.core.records import PacketEnded
from teleop_sim.core.units import format_time
from teleop_sim.reports import lanes, timeline
from teleop_sim.reports.lane_data import Bar, Kind, Lane, Mark, Row, Step
from teleop_sim.reports.run_view import Run

_WAITING = Kind("queueing or dark", "#d9b400")
_SENDING = Kind("being sent", timeline.BLUE)
_FLYING = Kind("travelling", "#56b4e980")
_DROPPED = Kind("dropped", timeline.RED, "cross")
_DARK = Kind("blackout", "dark-band")
_DARK_BAR = Kind("blackout", "muted")
_QUEUE = Kind("", "#d9b400")

STACK_PX = 120.0
"""The most that a direction's packets side by side may take (a choice of layout)."""
TOLD = 6000
"""Packets of a direction up to which each tells its waits; of more, only the topic, to keep the page small."""


def link(run: Run, direction: str) -> Lane:
    """One direction of the link: dark or busy, how many packets wait, and each packet's way."""
    ended = [r for r in run.records if isinstance(r, PacketEnded) and r.direction == direction]
    ways = lanes.packets(run.records, direction)
    # lanes.packets gives them in the order in which they were offered.
    ended.sort(key=lambda r: (r.sent_s, r.packet))
    dark = lanes.dark(run.records, direction)
    stack = max((way.row for way in ways), default=0) + 1
    height = max(min(STACK_PX / stack, 9.0), 1.5)
    bars = [Bar(a, b, 0, _DARK_BAR, "blackout") for a, b in dark]
    crosses = []
    for way, r in zip(ways, ended, strict=True):
        text = _told(r) if len(ended) <= TOLD else r.topic
        bars += _way(way, text)
        if way.dropped:
            crosses.append(Mark(way.end_s, way.row + 2, _DROPPED, text))
        if not math.isnan(way.out_s) and way.out_s > way.service_s:
            bars.append(Bar(way.service_s, way.out_s, 0, _SENDING, text))
    rows = (
        Row("state", height=11.0),
        Row("queue", height=26.0),
        *(Row("packets" if n == 0 else "", height=height) for n in range(stack)),
    )
    bands = tuple((a, b, _DARK) for a, b in dark)
    queue = _queue(ways)
    steps = (queue,) if ways else ()
    if not ways and not dark:
        return Lane(direction, "", ())
    return Lane(f"{direction}link", f"{direction.capitalize()}link", rows, tuple(bars), tuple(crosses), steps, bands)


def _way(way: lanes.Packet, text: str) -> list[Bar]:
    """A packet's stretches: waiting, being sent, travelling."""
    waited_s = way.end_s if math.isnan(way.service_s) else way.service_s
    spans = [(way.sent_s, waited_s, _WAITING)]
    if not math.isnan(way.out_s):
        spans += [(way.service_s, way.out_s, _SENDING), (way.out_s, way.end_s, _FLYING)]
    return [Bar(a, b, way.row + 2, kind, text) for a, b, kind in spans if b > a]


def _told(r: PacketEnded) -> str:
    waits = {
        "queued": r.queue_s,
        "dark": r.blackout_s,
        "sending": r.serialisation_s,
        "again": r.retransmission_s,
        "in the air": r.propagation_s,
    }
    fate = {"dropped": f"dropped: {r.reason}", "in_flight": "still under way at the end"}.get(r.outcome, "")
    spent = ", ".join(f"{words} {format_time(time_s)}" for words, time_s in waits.items() if time_s > 0.0)
    size = f"{r.payload_bytes} bytes, {r.size_bits} bit with headers"
    return "\n".join(line for line in (f"packet {r.packet}: {r.topic}", r.text, size, spent, fate) if line)


def _queue(ways: Sequence[lanes.Packet]) -> Step:
    """How many packets wait for their first bit to go out."""
    waits = [(way.sent_s, way.end_s if math.isnan(way.service_s) else way.service_s) for way in ways]
    changes = sorted([(a, 1) for a, b in waits if b > a] + [(b, -1) for a, b in waits if b > a])
    at_s, counts = [0.0], [0]
    for t_s, change in changes:
        if t_s == at_s[-1]:
            counts[-1] += change
        else:
            at_s.append(t_s)
            counts.append(counts[-1] + change)
    most = max(counts)
    share = tuple(0.92 * n / max(most, 1) for n in counts)
    return Step(1, _QUEUE, tuple(at_s), share, tuple(f"{n} waiting; at most {most}" for n in counts))
