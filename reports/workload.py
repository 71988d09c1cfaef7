"""How busy each role was and what waited for people, over time, from a run's records. Pure functions.

Workload is utilisation: the share of a window in which somebody was at work, rho of an M/G/1 queue with one person as
its server (docs/operator.md; M. L. Cummings, S. Guerlain, Human Factors 49 (2007), 1-15, use the same measure).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import accumulate, pairwise

from teleop_sim.core.records import MessageEnded, OperatorActed, PacketEnded, Record
from teleop_sim.reports.intervals import Interval, both, length_s, union
from teleop_sim.reports.link_use import Steps
from teleop_sim.reports.spans import requests

ROLES = ("supervisor", "primary", "auxiliary", "immersed")
"""In the order in which they are shown; others come after them by name."""


def roles(records: Iterable[Record]) -> list[str]:
    """Roles in which anybody acted."""
    found = {r.role for r in records if isinstance(r, OperatorActed)}
    return [role for role in ROLES if role in found] + sorted(found - set(ROLES))


def at_work(records: Iterable[Record], role: str | None = None) -> list[Interval]:
    """When a role was at work [s]; None: when anybody was."""
    acts = (r for r in records if isinstance(r, OperatorActed) and role in (None, r.role))
    return union((r.start_s, r.t_s) for r in acts)


def shares(spans: list[Interval], end_s: float, step_s: float) -> tuple[list[float], list[float]]:
    """Edges of windows from 0 to the end [s], and the share of each window that lies in the spans, 0 to 1."""
    edges = [step_s * i for i in range(math.ceil(end_s / step_s - 1e-9))] + [end_s]
    return edges, [length_s(both([(a, b)], spans)) / (b - a) for a, b in pairwise(edges)]


def at_station(records: Sequence[Record]) -> list[Interval]:
    """When each request waited at the control station or was worked on there [s].

    From its arrival (if its packet was lost: from the first act for it) until the last thing was sent for it, or until
    it was over for another reason. Those that nobody there ever heard of have none.
    """
    arrivals = {
        r.sent_s: r.t_s
        for r in records
        if isinstance(r, PacketEnded | MessageEnded) and r.topic == "request" and r.outcome == "delivered"
    }
    acts: dict[int, list[OperatorActed]] = {}
    for r in records:
        if isinstance(r, OperatorActed) and r.request:
            acts.setdefault(r.request, []).append(r)
    found = []
    for number, start_s, over_s in requests(records):
        mine = [act for act in acts.get(number, []) if act.start_s < over_s]
        come_s = arrivals.get(start_s, min((act.start_s for act in mine), default=math.inf))
        sent_s = max((act.t_s for act in mine if act.kind == "send" and act.t_s <= over_s), default=over_s)
        if come_s < sent_s:
            found.append((come_s, sent_s))
    return found


def waiting(records: Sequence[Record]) -> Steps:
    """How many requests there were at the control station, from each time on."""
    changes: dict[float, int] = {0.0: 0}
    for start_s, end_s in at_station(records):
        changes[start_s] = changes.get(start_s, 0) + 1
        changes[end_s] = changes.get(end_s, 0) - 1
    times = sorted(changes)
    return tuple(times), tuple(accumulate(changes[t_s] for t_s in times))
