"""A row a cell: how often, how fast, where the time went, use of link and operator, and which runs to look at."""

from __future__ import annotations

import math
import posixpath
from collections.abc import Mapping
from numbers import Real
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import quote

from teleop_sim.reports.parts import Cell, Column, Sheet
from teleop_sim.reports.shares import SHARES
from teleop_sim.reports.sweep_view import SweepRuns, words

if TYPE_CHECKING:
    import pandas as pd

MOST_ROWS: Final = 1_000
"""Of the table: 0.6 kB each in a page. pandas has them all."""

MEANS: Final[Mapping[str, tuple[str, int, str, str]]] = {
    **{name: (words, 1, "where the time went, mean [s]", "") for name, words in SHARES.items()},
    "requests": ("requests", 1, "operator", "mean number of requests a run"),
    "operator_busy": ("busy", 2, "operator", "mean share of the run in which somebody was at work"),
    "up_busy": ("uplink busy", 2, "link", "mean share of the run in which delivered bits went out"),
    "down_busy": ("downlink busy", 2, "link", "mean share of the run in which delivered bits went out"),
    "up_queue_s": ("uplink queueing [s]", 1, "link", "time that delivered packets queued, summed, mean"),
    "down_queue_s": ("downlink queueing [s]", 1, "link", "time that delivered packets queued, summed, mean"),
    "retries": ("retries", 1, "", "failures of attempts, mean"),
}
"""Column of the index to words, decimals, group and help."""

PICKED: Final[Mapping[str, str]] = {
    "best": "completed soonest",
    "median": "half of the runs came out as well or better",
    "worst": "came out worst: failed before left, left before completed late; of these the lower score, then the later",
}
"""Run of a cell to what makes it that."""


def cells(sweep: SweepRuns) -> Sheet:
    """All cells, in the order of the plan; no rows where no run is finished."""
    table = sweep.table.head(MOST_ROWS)
    means = sweep.runs.groupby("cell")[[*MEANS]].mean().to_dict("index")
    picked = picked_runs(sweep.runs)
    rows: list[tuple[Cell, ...]] = []
    links: dict[tuple[int, int], str] = {}
    for number, row in enumerate(records(table)):
        runs = picked[row["cell"]]
        before = (*_settings(sweep, row), *_figures(row))
        looked_at = (*(cell for name in PICKED for cell in _run(runs[name])), runs["worst"]["outcome"])
        rows.append((*before, *looked_at, *(means[row["cell"]].values())))
        for n, name in enumerate(PICKED):
            if address := address_of(sweep, str(runs[name]["log"])):
                links[number, len(before) + 2 * n] = address
    return Sheet(_columns(sweep), tuple(rows), note=_note(sweep, len(table)), links=links)


def _columns(sweep: SweepRuns) -> tuple[Column, ...]:
    settings = [Column(name, words(name), group="setting") for name in sweep.factors]
    counts = [
        Column("runs", "runs", group="runs"),
        Column("completion_pct", "completed [%]", 0, "runs", "share of runs that completed"),
        Column("completion_low_pct", "from", 0, "runs", "lower end of its 95 % interval (Wilson)"),
        Column("completion_high_pct", "to", 0, "runs", "upper end"),
        Column("failed", "failed", group="runs", help="never would have completed, such as a fall"),
        Column("censored", "left", group="runs", help="left at the time limit"),
    ]
    mean = f"mean, where a run that had not completed by {sweep.limit_s:g} s, or failed, counts so much"
    median = "by which half of the runs had completed; nothing where fewer did"
    times = [
        Column(f"{name}{end}", said, 1, "completion time [s]", told)
        for name, what, told in (("mean_s", "mean", mean), ("q50_s", "median", median))
        for end, said, told in (
            ("", what, told),
            ("_low", "from", "lower end of its 95 % interval"),
            ("_high", "to", "upper end"),
        )
    ]
    means = [Column(name, said, decimals, group, told) for name, (said, decimals, group, told) in MEANS.items()]
    runs = [
        column
        for name, told in PICKED.items()
        for column in (
            Column(f"{name}_run", name, group="runs to look at", help=f"its replicate: {told}"),
            Column(f"{name}_s", "[s]", 0, "runs to look at", "when it ended"),
        )
    ]
    outcome = Column("worst_outcome", "worst", group="runs to look at", help="its outcome")
    return (*settings, *counts, *times, *runs, outcome, *means)


def _settings(sweep: SweepRuns, row: Mapping[str, Any]) -> list[Cell]:
    return [plain(row[name]) for name in sweep.factors]


def plain(value: Any) -> Cell:
    """A factor's value as a cell: numbers stay numbers, so that they sort."""
    if isinstance(value, str | bool) or not isinstance(value, Real):
        return str(value)
    number = float(value)
    return int(number) if number.is_integer() else number


def _figures(row: Mapping[str, Any]) -> list[Cell]:
    shares = [100.0 * float(row[name]) for name in ("completion", "completion_low", "completion_high")]
    times = [f"{name}{end}" for name in ("mean_s", "q50_s") for end in ("", "_low", "_high")]
    counts: list[Cell] = [int(row["runs"]), *shares, int(row["failed"]), int(row["censored"])]
    # A median that was never reached is not known, rather than infinite.
    return counts + [x if math.isfinite(x := float(row[name])) else None for name in times]


def picked_runs(runs: pd.DataFrame) -> dict[Any, dict[str, dict[str, Any]]]:
    """Cell to its best, median and worst run, each as a row of the index.

    Completed runs come first, by their time; then those that were left, then those that failed, by score and time.
    The median is the lower one of an even number.
    """
    rank = runs["status"].map({"completed": 0, "censored": 1, "failed": 2})
    score = (-runs["score"]).where(rank > 0, 0)
    keyed = runs[["cell", "replicate", "outcome", "status", "time_s", "score", "log"]].assign(_rank=rank, _score=score)
    keyed = keyed.sort_values(["cell", "_rank", "_score", "time_s", "replicate"], kind="stable")
    place, size = keyed.groupby("cell").cumcount(), keyed.groupby("cell")["cell"].transform("size")
    wanted = {"best": place == 0, "median": place == (size - 1) // 2, "worst": place == size - 1}
    found: dict[Any, dict[str, dict[str, Any]]] = {}
    for name, chosen in wanted.items():
        for row in records(keyed[chosen]):
            found.setdefault(row["cell"], {})[name] = row
    return found


def records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Rows of a table by the names of its columns."""
    return [dict(zip(map(str, table.columns), row, strict=True)) for row in table.itertuples(index=False, name=None)]


def _run(run: Mapping[str, Any]) -> tuple[Cell, Cell]:
    return f"r{run['replicate']}", float(run["time_s"])


def address_of(sweep: SweepRuns, log: str) -> str:
    """Of a run's page where there is one, else of its log; empty where none was kept."""
    if not log:
        return ""
    page = f"{log.removesuffix('.mcap')}.html"
    return quote(posixpath.normpath(sweep.to_logs + (page if page in sweep.pages else log)))


def _note(sweep: SweepRuns, shown: int) -> str:
    notes = []
    if shown < len(sweep.table):
        notes.append(f"The first {shown} of {len(sweep.table)} cells; teleop_sim.load_sweep has all.")
    notes.append("Means are over all runs, completed or not; r12 is replicate 12.")
    if sweep.detail == "summary":
        notes.append("This sweep kept no logs, so that no run can be looked at.")
    elif not sweep.pages:
        notes.append(
            "Links lead to logs, for Foxglove, Rerun and teleop-sim replay; "
            f"teleop-sim report {sweep.where} --pages writes a page of each run to look at, to which they then lead."
        )
    else:
        notes.append("Links lead to the page of a run, or to its log where it has none.")
    return " ".join(notes)
