"""What the timeline draws, as plain bars and marks in seconds. Pure functions, no matplotlib."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heappop, heappush

from teleop_sim.core.records import (
    Blackout,
    EpisodeEnded,
    OperatorActed,
    PacketEnded,
    Record,
    Scored,
    Waited,
)
from teleop_sim.reports.intervals import Interval
from teleop_sim.reports.spans import asked, duration_s
from teleop_sim.reports.visits import visits

SKILLS = {
    "walk": "walk",
    "step": "walk",
    "turn": "walk",
    "look": "see",
    "scan": "see",
    "detect": "see",
    "reach": "hand",
    "grip": "hand",
    "release": "hand",
    "nudge": "hand",
    "cartesian": "hand",
    "joints": "hand",
    "pregrasp": "hand",
    "grasp": "hand",
    "take": "hand",
    "fingers": "hand",
    "retreat": "hand",
    "letgo": "hand",
    "follow": "follow",
    "act": "follow",
    "posture": "posture",
}
"""Skill to the family that gives it its colour; others are ``other``."""

LEAST_S = 0.1
"""A state of a machine within a machine that took less has no row (a choice of layout)."""


@dataclass(frozen=True)
class Bar:
    """A coloured stretch of time: from, to [s], what its colour means, and the row in its lane (0 is the top)."""

    start_s: float
    end_s: float
    kind: str
    row: int = 0


@dataclass(frozen=True)
class Packet:
    """A packet's way: offered, first and last bit out (NaN: never), arrived or given up [s]; row in its lane."""

    sent_s: float
    service_s: float
    out_s: float
    end_s: float
    dropped: bool
    row: int


def state_bars(records: Sequence[Record]) -> tuple[list[str], list[Bar]]:
    """Names of the states in the order of first visits, and one bar an attempt, coloured by mode.

    Of a machine with machines in it, whose states are many, those that took no time to speak of have no row.
    """
    run = visits(records)
    names = list(dict.fromkeys(v.state for v in run))
    if any("/" in name for name in names):
        names = [name for name in names if sum(v.time_s for v in run if v.state == name) >= LEAST_S]
    rows = {name: row for row, name in enumerate(names)}
    return names, [Bar(a.start_s, a.end_s, a.mode, rows[v.state]) for v in run if v.state in rows for a in v.attempts]


def shown_names(names: Sequence[str]) -> list[str]:
    """Names of states as the picture has them: of a state in a machine in a machine its own and the next one's."""
    short = ["/".join(name.split("/")[-2:]).removeprefix("STATE_") for name in names]
    return [name if short.count(name) == 1 else full for name, full in zip(short, names, strict=True)]


def robot_bars(records: Sequence[Record]) -> list[Bar]:
    """One bar an episode, coloured by the family of its skill."""
    return [Bar(r.start_s, r.t_s, SKILLS.get(r.skill.lower(), "other")) for r in records if isinstance(r, EpisodeEnded)]


def wait_bars(records: Sequence[Record]) -> list[Bar]:
    """One bar a pacing wait (row 0), one a wait for the operator (row 1)."""
    paced = [Bar(r.start_s, r.t_s, "pacing") for r in records if isinstance(r, Waited) and r.kind == "pacing"]
    return paced + [Bar(start_s, end_s, "for an answer", 1) for start_s, end_s in asked(records)]


def act_bars(records: Sequence[Record]) -> list[Bar]:
    """One bar an operator's act, coloured by its kind."""
    return [Bar(r.start_s, r.t_s, r.kind) for r in records if isinstance(r, OperatorActed)]


def packets(records: Sequence[Record], direction: str) -> list[Packet]:
    """All packets of a direction in the order sent, stacked so that no two in one row overlap."""
    ended = (r for r in records if isinstance(r, PacketEnded) and r.direction == direction)
    made: list[Packet] = []
    free: list[int] = []
    busy: list[tuple[float, int]] = []
    for r in sorted(ended, key=lambda r: (r.sent_s, r.packet)):
        end_s = r.t_s if math.isnan(r.arrived_s) else r.arrived_s
        while busy and busy[0][0] <= r.sent_s:
            heappush(free, heappop(busy)[1])
        row = heappop(free) if free else len(busy)
        heappush(busy, (end_s, row))
        # A blackout may have struck in mid-packet: the last bit left when the propagation began.
        arrived = not math.isnan(r.arrived_s)
        out_s = r.arrived_s - r.propagation_s if arrived else min(r.service_s + r.serialisation_s, end_s)
        made.append(Packet(r.sent_s, r.service_s, out_s, end_s, r.outcome == "dropped", row))
    return made


def dark(records: Sequence[Record], direction: str) -> list[Interval]:
    """Blackouts of a direction; one that lasts ends with the run."""
    spans: list[Interval] = []
    since_s: float | None = None
    for r in records:
        if isinstance(r, Blackout) and r.direction == direction:
            if r.dark and since_s is None:
                since_s = r.t_s
            elif not r.dark and since_s is not None:
                spans.append((since_s, r.t_s))
                since_s = None
    return spans if since_s is None else [*spans, (since_s, duration_s(records))]


def scores(records: Sequence[Record]) -> list[tuple[float, int, bool]]:
    """When the scorer saw something: time [s], last checkpoint by then, and whether it was passed just then."""
    marks: list[tuple[float, int, bool]] = []
    for r in records:
        if isinstance(r, Scored):
            marks.append((r.t_s, r.checkpoint, r.checkpoint > max((m[1] for m in marks), default=0)))
    return marks
