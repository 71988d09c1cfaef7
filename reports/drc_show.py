"""One door or valve for a terminal: Table 2's columns beside the paper's, and what the crew did. Pure functions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, fields
from typing import TYPE_CHECKING

from teleop_sim.core.records import Record, RunStarted
from teleop_sim.reports.captions import task
from teleop_sim.reports.drc_marks import MARKS, counts
from teleop_sim.reports.drc_times import COLUMNS, Times, completed, drc_times, paper_rows
from teleop_sim.reports.visits import visits

if TYPE_CHECKING:
    from rich.table import Table

HEADINGS = {"alignment_s": "alignment", "motion_s": "motion"}
"""Shorter than the paper's."""
LONGEST = 3
"""How many states the summary names (a choice of layout)."""
SHOWN_S = 1.0
"""The least time that makes a state worth naming (a choice of layout)."""


def is_drc(records: Sequence[Record]) -> bool:
    """Whether a run's task is one of the DARPA Robotics Challenge."""
    return task(records).startswith("drc-")


def rich_times(records: Sequence[Record], narrow: bool = False) -> Table:
    """The columns of Table 2 for a terminal; ``narrow``: a row a column, for one of 40 columns."""
    from rich.table import Table

    shown = _shown(records)
    caption = "From when the robot had stopped walking. Columns overlap, and leave out what people only look at."
    table = Table(title="Columns of the ViGIR paper's Table 2 [s]", caption=caption, caption_justify="left")
    if narrow:
        for n, name in enumerate(("", *shown)):
            table.add_column(name, justify="right" if n else "left", overflow="fold")
        for field, words in COLUMNS.items():
            table.add_row(words, *(_cell(getattr(times, field)) for times in shown.values()))
        return table
    for n, name in enumerate(("", *(HEADINGS.get(field, words) for field, words in COLUMNS.items()))):
        table.add_column(name, justify="right" if n else "left", no_wrap=True)
    for name, times in shown.items():
        table.add_row(name, *map(_cell, astuple(times)))
    return table


def _shown(records: Sequence[Record]) -> dict[str, Times]:
    started = next((r for r in records if isinstance(r, RunStarted)), None)
    paper = paper_rows().get(started.scenario if started else "")
    rows = {"this run" if completed(records) else "this run, not completed": drc_times(records)}
    return rows | ({f"paper, {paper.name}": paper.times} if paper else {})


def _cell(value: float) -> str:
    return "in reset" if math.isnan(value) else f"{value:.1f}"


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
