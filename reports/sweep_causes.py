"""Why runs did not complete: causes counted, with one run each to look at."""

from __future__ import annotations

import re
from typing import Final

from teleop_sim.reports.parts import Cell, Column, Sheet
from teleop_sim.reports.sweep_cells import address_of, records
from teleop_sim.reports.sweep_layout import shown_levels
from teleop_sim.reports.sweep_view import SweepRuns, bare

MOST_ROWS: Final = 60
"""Causes of the table, the most frequent first."""

_MEASURED = re.compile(r"-?\d+\.\d+")


def causes(sweep: SweepRuns) -> Sheet | None:
    """A row a cause of runs that did not complete; None where all did, or none is finished."""
    bad = sweep.runs[sweep.runs["status"] != "completed"]
    if not len(bad):
        return None
    bad = bad.assign(_kind=[kind(cause) for cause in bad["cause"]]).sort_values(["cell", "replicate"])
    levels = shown_levels(sweep) if sweep.compared else ()
    rows: list[tuple[Cell, ...]] = []
    links: dict[tuple[int, int], str] = {}
    groups = sorted(bad.groupby(["outcome", "_kind"], sort=False), key=lambda group: -len(group[1]))
    for number, (_, found) in enumerate(groups[:MOST_ROWS]):
        first = records(found.head(1))[0]
        by_level = [int((found[sweep.compared] == level).sum()) for level in levels]
        share = 100.0 * len(found) / len(sweep.runs)
        example = f"c{first['cell']} r{first['replicate']}"
        # One wording: as it is. Several that differ by what was measured: without it.
        cause = str(first["cause"]) if found["cause"].nunique() == 1 else str(first["_kind"])
        rows.append(
            (
                str(first["outcome"]),
                cause,
                len(found),
                share,
                found["cell"].nunique(),
                *by_level,
                example,
                first["time_s"],
            )
        )
        if address := address_of(sweep, str(first["log"])):
            links[number, 5 + len(levels)] = address
    columns = (
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
    share = 100.0 * len(bad) / len(sweep.runs)
    total = ("all", "", len(bad), share, bad["cell"].nunique(), *[None] * (len(levels) + 2))
    notes = [
        "Failed: it never would have completed. Censored: left at the time limit. Refused: nothing could ever get "
        "across its link. Numbers that differ from run to run are left out of a cause (…).",
        f"The {MOST_ROWS} most frequent of {len(groups)}." if len(groups) > MOST_ROWS else "",
    ]
    return Sheet(columns, tuple(rows), total, " ".join(filter(None, notes)), links)


def kind(cause: str) -> str:
    """A cause without what was measured in its run."""
    return _MEASURED.sub("…", cause)
