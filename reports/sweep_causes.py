"""Why runs did not complete: causes counted, with one run each to look at."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from teleop_sim.reports.parts import Cell, Column, Sheet
from teleop_sim.reports.sweep_cells import address_of, records
from teleop_sim.reports.sweep_layout import shown_levels
from teleop_sim.reports.sweep_view import SweepRuns, bare

if TYPE_CHECKING:
    import pandas as pd

MOST_ROWS: Final = 60
"""Causes of the table, the most frequent first."""

_MEASURED = re.compile(r"-?\d+\.\d+")


def causes(sweep: SweepRuns) -> Sheet | None:
    """A row a cause of runs that did not complete; None where all did, or none is finished."""
    groups = _groups(sweep)
    if not groups:
        return None
    levels = shown_levels(sweep) if sweep.compared else ()
    rows: list[tuple[Cell, ...]] = []
    links: dict[tuple[int, int], str] = {}
    for number, found in enumerate(groups[:MOST_ROWS]):
        first = records(found.head(1))[0]
        by_level = [int((found[sweep.compared] == level).sum()) for level in levels]
        share = 100.0 * len(found) / len(sweep.runs)
        # One wording: as it is. Several that differ by what was measured: without it.
        cause = str(first["cause"]) if found["cause"].nunique() == 1 else str(first["_kind"])
        counts = (len(found), share, found["cell"].nunique(), *by_level)
        example = f"c{first['cell']} r{first['replicate']}"
        rows.append((str(first["outcome"]), cause, *counts, example, first["time_s"]))
        if address := address_of(sweep, str(first["log"])):
            links[number, 5 + len(levels)] = address
    bad = sweep.runs[sweep.runs["status"] != "completed"]
    share = 100.0 * len(bad) / len(sweep.runs)
    total = ("all", "", len(bad), share, bad["cell"].nunique(), *[None] * (len(levels) + 2))
    notes = [
        "Failed: it never would have completed. Censored: left at the time limit. Refused: nothing could ever get "
        "across its link. Numbers that differ from run to run are left out of a cause (…).",
        f"The {MOST_ROWS} most frequent of {len(groups)}." if len(groups) > MOST_ROWS else "",
    ]
    return Sheet(_columns(sweep, levels), tuple(rows), total, " ".join(filter(None, notes)), links)


def examples(sweep: SweepRuns) -> list[dict[str, Any]]:
    """The run that stands for each cause of the table, as a row of the index."""
    return [records(found.head(1))[0] for found in _groups(sweep)[:MOST_ROWS]]


def _groups(sweep: SweepRuns) -> list[pd.DataFrame]:
    """The runs of each outcome and kind of cause that did not complete, the most frequent first."""
    bad = sweep.runs[sweep.runs["status"] != "completed"]
    bad = bad.assign(_kind=[kind(cause) for cause in bad["cause"]]).sort_values(["cell", "replicate"])
    return sorted((found for _, found in bad.groupby(["outcome", "_kind"], sort=False)), key=len, reverse=True)


def _columns(sweep: SweepRuns, levels: Sequence[Any]) -> tuple[Column, ...]:
    return (
        Column("outcome", "outcome"),
        Column("cause", "cause"),
        Column("runs", "runs"),
        Column("share_pct", "share [%]", 1, help="of all finished runs"),
        Column("cells", "cells", help="in which it came about"),
        *(
            Column(f"runs_{level}", sweep.says(sweep.compared, level), group=f"runs by {bare(sweep.compared)}")
            for level in levels
        ),
        Column("example", "example", help="the first such run: its cell and replicate"),
        Column("time_s", "ended [s]", 0, help="when the example ended"),
    )


def kind(cause: str) -> str:
    """A cause without what was measured in its run."""
    return _MEASURED.sub("…", cause)
