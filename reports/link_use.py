"""What a direction of the link carried and when, from the records of its packets alone. Pure functions.

From a packet's first bit to its last the radio is at work on it or on another that was let pass, except in the dark. So
the union of these times is when bits went out, and its length is the sum of the packets' serialisation and
retransmission: what the link itself counts (``channel/radio_base.py``, ``utilisation``).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

from teleop_sim.core.records import PacketEnded, Record
from teleop_sim.reports.intervals import Interval, minus, union
from teleop_sim.reports.lanes import dark

WINDOWS_S = (10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1800.0, 3600.0)
MOST_WINDOWS = 200
"""The first of ``WINDOWS_S`` that makes no more of them than that (a choice of layout)."""
MOST_STEPS = 2000
"""Of a figure: more than a page or a print can tell apart (a choice of layout)."""
Steps = tuple[tuple[float, ...], tuple[int, ...]]
"""Times [s] and what holds from each on."""


@dataclass(frozen=True)
class Window:
    """One stretch of time and the shares of it, 0 to 1, in which bits of each kind went out.

    ``payload``: of messages that arrived. ``headers``: of the packets that these came in. ``vain``: of packets that did
    not arrive, or that had to be sent again.
    """

    start_s: float
    end_s: float
    payload: float
    headers: float
    vain: float

    @property
    def busy(self) -> float:
        """Share in which bits went out: utilisation."""
        return self.payload + self.headers + self.vain


def window_s(end_s: float) -> float:
    """Length of the windows for a run of that length [s]."""
    return next((w for w in WINDOWS_S if end_s / w <= MOST_WINDOWS), WINDOWS_S[-1])


def of_direction(records: Iterable[Record], direction: str) -> list[PacketEnded]:
    """A direction's packets in the order offered."""
    found = (r for r in records if isinstance(r, PacketEnded) and r.direction == direction)
    return sorted(found, key=lambda r: (r.sent_s, r.packet))


def out_s(packet: PacketEnded) -> float:
    """When a packet's last bit went out, or it was given up [s]."""
    return packet.t_s - packet.propagation_s


def service(packet: PacketEnded) -> Interval:
    """From a packet's first bit to its last [s]; empty where it had no turn."""
    if math.isnan(packet.service_s):
        return packet.sent_s, packet.sent_s
    return packet.service_s, max(packet.service_s, out_s(packet))


def busy(records: Sequence[Record], direction: str) -> list[Interval]:
    """When bits went out [s]."""
    return minus(union(map(service, of_direction(records, direction))), union(dark(records, direction)))


def edges_of(end_s: float) -> list[float]:
    """Bounds of the windows from 0 to the end of the run [s]; the last may be shorter."""
    step_s = window_s(end_s)
    return [step_s * i for i in range(math.ceil(end_s / step_s - 1e-9))] + [end_s]


def goodput_bps(records: Iterable[Record], direction: str, end_s: float) -> list[float]:
    """Payload that arrived in each window over its length [bit/s]."""
    edges = edges_of(end_s)
    bits = [0] * (len(edges) - 1)
    for packet in of_direction(records, direction):
        if packet.outcome == "delivered" and bits:
            bits[min(bisect_right(edges, packet.arrived_s) - 1, len(bits) - 1)] += 8 * packet.payload_bytes
    return [n / (b - a) for n, (a, b) in zip(bits, pairwise(edges), strict=True)]


def windows(records: Sequence[Record], direction: str, end_s: float) -> list[Window]:
    """Windows of the run, as ``edges_of`` bounds them.

    A packet's seconds of each kind lie evenly in its own light time between its first bit and its last, which is exact
    where no other was let pass in between.
    """
    edges = edges_of(end_s)
    sums = [[0.0, 0.0, 0.0] for _ in edges[1:]]
    darkness = union(dark(records, direction))
    for packet in of_direction(records, direction):
        kinds = _kinds_s(packet)
        light = minus(union([service(packet)]), darkness)
        whole_s = sum(b - a for a, b in light)
        for a, b in light:
            i = max(bisect_right(edges, a) - 1, 0)
            while i < len(sums) and edges[i] < b:
                share = (min(b, edges[i + 1]) - max(a, edges[i])) / whole_s
                sums[i] = [total + share * kind for total, kind in zip(sums[i], kinds, strict=True)]
                i += 1
    made = zip(pairwise(edges), sums, strict=True)
    return [Window(a, b, *(kind / (b - a) for kind in kinds)) for (a, b), kinds in made if b > a]


def _kinds_s(packet: PacketEnded) -> tuple[float, float, float]:
    """Seconds in which its payload, its headers, and bits in vain went out."""
    # Logs of before bits in vain were told apart have none.
    again_s = 0.0 if math.isnan(packet.retransmission_s) else packet.retransmission_s
    if packet.outcome != "delivered":
        return 0.0, 0.0, packet.serialisation_s + again_s
    payload = 8 * packet.payload_bytes / packet.size_bits if packet.size_bits else 1.0
    return packet.serialisation_s * payload, packet.serialisation_s * (1.0 - payload), again_s


def queue(records: Sequence[Record], direction: str, in_bits: bool = False) -> Steps:
    """How many packets (or bits) waited for their first bit, from each time on.

    What a blackout keeps back waits too; the packet under way does not.
    """
    changes: dict[float, int] = {0.0: 0}
    for packet in of_direction(records, direction):
        until_s = packet.t_s if math.isnan(packet.service_s) else packet.service_s
        if until_s > packet.sent_s:
            amount = packet.size_bits if in_bits else 1
            changes[packet.sent_s] = changes.get(packet.sent_s, 0) + amount
            changes[until_s] = changes.get(until_s, 0) - amount
    times = sorted(changes)
    return tuple(times), tuple(accumulate(changes[t_s] for t_s in times))


def thinned(steps: Steps, end_s: float, most: int = MOST_STEPS) -> Steps:
    """The same steps, or where there are more than can be told apart, the greatest in each of so many equal spans."""
    times, counts = steps
    if len(times) <= most:
        return steps
    width_s = max(end_s, times[-1]) / most
    greatest = [0] * (most + 1)
    for at_s, until_s, count in zip(times, (*times[1:], times[-1]), counts, strict=True):
        for i in range(int(at_s / width_s), int(until_s / width_s) + 1):
            greatest[i] = max(greatest[i], count)
    return tuple(width_s * i for i in range(most + 1)), tuple(greatest)
