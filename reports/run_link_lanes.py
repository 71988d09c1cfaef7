"""The lanes of a run's link: each direction's state, queue and packets. Pure functions of records."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby

from teleop_sim.core.records import PacketEnded
from teleop_sim.core.units import format_time
from teleop_sim.reports import lanes, timeline
from teleop_sim.reports.intervals import union
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
STACK = 80
"""Rows for packets side by side; what is under way beyond that shares the last (a choice of layout)."""
TOLD, DRAWN = 4000, 8000
"""Packets of a direction up to which each tells its waits, and up to which each is drawn: a page stays below 3 MB."""
FINEST = 5000
"""Beyond that, parts of the axis into which the state and the queue are divided."""


def link(run: Run, direction: str) -> Lane:
    """One direction of the link: dark or busy, how many packets wait, and each packet's way.

    Of more than ``DRAWN`` packets only the state and the queue are told.
    """
    ended = [r for r in run.records if isinstance(r, PacketEnded) and r.direction == direction]
    # lanes.packets gives them in the order in which they were offered.
    ended.sort(key=lambda r: (r.sent_s, r.packet))
    ways = lanes.packets(run.records, direction)
    dark = lanes.dark(run.records, direction)
    if not ways and not dark:
        return Lane(direction, "", ())
    least_s = run.end_s / FINEST if len(ways) > DRAWN else 0.0
    bars = [*(Bar(a, b, 0, _DARK_BAR, "blackout") for a, b in dark), *_busy(ways, least_s)]
    rows = [Row("state", height=11.0), Row("queue", height=26.0)]
    crosses: list[Mark] = []
    if not least_s:
        stack = min(max((way.row for way in ways), default=0) + 1, STACK)
        height = max(min(STACK_PX / stack, 9.0), 1.5)
        rows += [Row("packets" if n == 0 else "", height=height) for n in range(stack)]
        texts = [_told(r) if len(ended) <= TOLD else r.topic for r in ended]
        bars += [bar for way, text in zip(ways, texts, strict=True) for bar in _way(way, text)]
        crosses = [Mark(w.end_s, _row(w), _DROPPED, text) for w, text in zip(ways, texts, strict=True) if w.dropped]
    steps = (_queue(ways, least_s),) if ways else ()
    bands = tuple((a, b, _DARK) for a, b in dark)
    title = f"{direction.capitalize()}link" + (f", {len(ways)} packets" if least_s else "")
    return Lane(f"{direction}link", title, tuple(rows), tuple(bars), tuple(crosses), steps, bands)


def _row(way: lanes.Packet) -> int:
    return min(way.row, STACK - 1) + 2


def _busy(ways: Sequence[lanes.Packet], least_s: float) -> list[Bar]:
    """When bits went out; gaps shorter than ``least_s`` are not told."""
    spans = union((way.service_s, way.out_s + least_s) for way in ways if not math.isnan(way.out_s))
    return [Bar(a, b - least_s, 0, _SENDING, "sending") for a, b in spans]


def _way(way: lanes.Packet, text: str) -> list[Bar]:
    """A packet's stretches: waiting, being sent, travelling."""
    waited_s = way.end_s if math.isnan(way.service_s) else way.service_s
    spans = [(way.sent_s, waited_s, _WAITING)]
    if not math.isnan(way.out_s):
        spans += [(way.service_s, way.out_s, _SENDING), (way.out_s, way.end_s, _FLYING)]
    return [Bar(a, b, _row(way), kind, text) for a, b, kind in spans if b > a]


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


def _queue(ways: Sequence[lanes.Packet], least_s: float) -> Step:
    """How many packets wait for their first bit to go out; of each stretch of ``least_s`` the most."""
    waits = [(way.sent_s, way.end_s if math.isnan(way.service_s) else way.service_s) for way in ways]
    changes = sorted([(a, 1) for a, b in waits if b > a] + [(b, -1) for a, b in waits if b > a])
    at_s, counts, now = [0.0], [0], 0
    for t_s, group in groupby(changes, key=lambda change: change[0]):
        now += sum(change for _, change in group)
        if least_s and t_s - at_s[-1] < least_s:
            counts[-1] = max(counts[-1], now)
        else:
            at_s.append(t_s)
            counts.append(now)
    most = max(counts)
    share = tuple(0.92 * n / max(most, 1) for n in counts)
    return Step(1, _QUEUE, tuple(at_s), share, tuple(f"{n} waiting; at most {most}" for n in counts))
