"""One door or valve in words and for scripts: Table 2's columns, and what the crew did. Pure functions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

from teleop_sim.core.records import Record
from teleop_sim.reports.captions import task
from teleop_sim.reports.drc_marks import MARKS, counts
from teleop_sim.reports.drc_times import Times, drc_times
from teleop_sim.reports.visits import visits

LONGEST = 3
"""How many states the summary names (a choice of layout)."""
SHOWN_S = 1.0
"""The least time that makes a state worth naming (a choice of layout)."""


def is_drc(records: Sequence[Record]) -> bool:
    """Whether a run's task is one of the DARPA Robotics Challenge."""
    return task(records).startswith("drc-")


def crew_lines(records: Sequence[Record]) -> list[str]:
    """What the crew did besides confirming, and the states that took longest."""
    did = [f"{n} x {MARKS[kind]}" for kind, n in counts(records).items() if n]
    spent: dict[str, float] = {}
    for visit in visits(records):
        spent[visit.state] = spent.get(visit.state, 0.0) + visit.time_s
    longest = sorted(spent, key=lambda state: -spent[state])[:LONGEST]
    took = [f"{state} {spent[state]:.0f} s" for state in longest if spent[state] >= SHOWN_S]
    return [
        *(["crew: " + ", ".join(did)] if did else []),
        *(["longest states: " + ", ".join(took)] if len(spent) > 1 and took else []),
    ]


def times_json(records: Sequence[Record]) -> dict[str, dict[str, float] | dict[str, int]]:
    """Table 2's columns and the counts of what the crew did, for scripts."""
    times = drc_times(records)
    return {"times": {field.name: getattr(times, field.name) for field in fields(Times)}, "crew": counts(records)}
