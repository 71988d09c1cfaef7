"""What ``teleop-sim sweep`` and ``decide`` print: progress, how each cell came out, the decision map."""

from __future__ import annotations

import shlex
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rich.table import Table

from teleop_sim.cli_show import Paper
from teleop_sim.core.errors import BadInput, Problem, UnknownName
from teleop_sim.core.units import format_quantity, format_time

if TYPE_CHECKING:
    import pandas as pd

    from teleop_sim.stats.runs import Measure
    from teleop_sim.sweep.plan import Plan
    from teleop_sim.sweep.study import SweepProgress

Watch = Callable[["SweepProgress"], None]

COMPUTED_S: Final = 2.7
"""CPU time of a run that computes its physics, about (measured: docs/sweeps.md)."""

REMEMBERED_S: Final = 0.044
"""Of one whose robot did the same in another cell of its replicate, about (measured: docs/sweeps.md)."""

LOG_BYTES: Final = {"full": 325_000, "events": 35_000, "summary": 0}
"""Of a run by level of detail, about (measured: docs/sweeps.md)."""

INDEX_BYTES: Final = 2_000
"""Of a run in journal and index, about (measured: docs/sweeps.md)."""

MOST_ROWS: Final = 40
"""Of a table on a terminal (assumed): more is for pandas."""


def dry_run_words(plan: Plan, workers: int) -> str:
    """How many runs, about how long and how large."""
    cells, replicates = len(plan.cells), plan.replicates
    worlds = len({_physical(plan, cell) for cell in range(cells)})
    computed = worlds * replicates
    most_s = (computed * COMPUTED_S + (plan.runs - computed) * REMEMBERED_S) / min(workers, replicates)
    size_mb = plan.runs * (LOG_BYTES[plan.detail] + INDEX_BYTES) / 1e6
    at_most = "at most " if plan.until else ""
    lines = [
        f"{plan.name}: {cells:,} cells x {at_most}{replicates:,} replicates = {at_most}{plan.runs:,} runs",
        *(f"  {f.name}: {_levels(plan, n)}" for n, f in enumerate(plan.factors)),
        f"  about {computed:,} of them compute physics if nobody steps in; the others remember it",
        f"  about {format_time(most_s)} with {workers} workers, about {size_mb:,.0f} MB ({plan.detail})",
    ]
    return "\n".join(lines)


_NOT_PHYSICAL = ("link", "operator", "autonomy", "time_limit_s")


def _physical(plan: Plan, cell: int) -> str:
    """What of a cell makes another world or another robot: cells that have it in common share their physics."""
    overrides = plan.overrides(cell).items()
    return repr(sorted((key, value) for key, value in overrides if key.split(".")[0] not in _NOT_PHYSICAL))


def _levels(plan: Plan, factor: int) -> str:
    values = list(dict.fromkeys(cell[factor] for cell in plan.cells))
    shown = ", ".join(format_quantity(plan.factors[factor].name, value) for value in values[:8])
    return shown + (f", ... ({len(values)} in all)" if len(values) > 8 else "")


@contextmanager
def watch_sweep(plan: Plan, quiet: bool) -> Iterator[Watch]:
    """What to hand to ``run_sweep``: a live line on a terminal, nothing elsewhere."""
    if quiet or not sys.stderr.isatty():
        yield lambda _at: None
        return
    from rich.console import Console
    from rich.live import Live
    from rich.text import Text

    started_s = time.monotonic()
    with Live(Text("starting"), console=Console(stderr=True), refresh_per_second=4, transient=True) as live:
        yield lambda at: live.update(Text(live_words(plan.name, at, time.monotonic() - started_s)))


def live_words(name: str, at: SweepProgress, spent_s: float) -> str:
    """Runs done, rate, time left, failures so far, memo hits."""
    rate = (at.done - at.resumed) / spent_s if spent_s > 0.0 else 0.0
    left = format_time((at.runs - at.done) / rate) if rate > 0.0 else "unknown"
    full = round(30 * at.done / at.runs) if at.runs else 30
    asked = at.found + at.made
    memo = f", memo {at.found / asked:.0%}" if asked else ""
    bar = "█" * full + "░" * (30 - full)
    return f"{name} {bar} {at.done:,} of {at.runs:,} runs, {rate:.1f}/s, {left} left, {at.bad} not completed{memo}"


def sweep_json(plan: Plan, directory: Path, at: SweepProgress) -> dict[str, Any]:
    """What a machine wants to know of a finished call."""
    return {
        "directory": str(directory),
        "scenario": plan.name,
        "cells": len(plan.cells),
        "replicates": plan.replicates,
        "runs": at.done,
        "resumed": at.resumed,
        "not_completed": at.bad,
        "computed": at.computed,
        "computed_s": at.computed_s,
        "remembered": at.remembered,
        "remembered_s": at.remembered_s,
        "episodes_found": at.found,
        "episodes_made": at.made,
        "lost": [{"replicate": lost.replicate, "cause": lost.cause} for lost in at.lost],
    }


def print_sweep(plan: Plan, directory: Path, at: SweepProgress) -> None:
    """A row a cell, and what to type next."""
    from teleop_sim.stats.summary import summary
    from teleop_sim.sweep.index import load_sweep

    paper, runs = Paper(), load_sweep(directory)
    factors = [factor.name for factor in plan.factors]
    if len(plan.cells) <= MOST_ROWS and len(runs):
        paper.print(_cells_table(summary(runs, factors), factors))
    asked = f"{at.computed} computed, {at.remembered} remembered" if at.computed or at.remembered else "none new"
    paper.print(f"{at.done:,} runs ({asked}), {at.bad} not completed: {directory}", soft_wrap=True)
    where = shlex.quote(str(directory))
    paper.print(
        f"  next: teleop-sim report {where}; teleop-sim decide {where}; "
        f"in Python teleop_sim.load_sweep({str(directory)!r})",
        soft_wrap=True,
    )


def _cells_table(rows: pd.DataFrame, factors: list[str]) -> Table:
    table = Table(
        title="Cells", caption="Mean: completion time up to the limit, which a run that never completes counts whole."
    )
    for name in (*factors, "runs", "completed", "95 %", "mean s", "95 %"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in rows.to_dict("records"):
        share = f"{row['completion_low']:.0%} - {row['completion_high']:.0%}"
        mean = f"{row['mean_s_low']:.1f} - {row['mean_s_high']:.1f}"
        cells = (format_quantity(name, row[name]) for name in factors)
        table.add_row(*cells, str(row["runs"]), f"{row['completion']:.0%}", share, f"{row['mean_s']:.1f}", mean)
    return table


@dataclass(frozen=True)
class Decision:
    """A decision map and what it was asked."""

    map: pd.DataFrame
    link: list[str]
    choose: str
    measure: Measure


def decision_rows(directory: Path, choose: str, kind: str, deadline: str | None) -> Decision:
    """The decision map of a sweep.

    Raises:
        BadInput: no such factor or measure, nothing to choose. SweepBroken: no sweep.

    """
    from teleop_sim.cli_sweep_options import seconds
    from teleop_sim.stats.decision import decision_map
    from teleop_sim.stats.runs import Measure, common_limit_s
    from teleop_sim.sweep.folder import SweepFolder
    from teleop_sim.sweep.index import load_sweep

    plan, _ = SweepFolder(directory).read()
    runs, factors = load_sweep(directory), [factor.name for factor in plan.factors]
    if choose not in factors:
        raise UnknownName("--choose", choose, tuple(factors))
    if not len(runs):
        raise BadInput((Problem(str(directory), "has no finished run", "Go on with teleop-sim sweep --resume."),))
    deadline_s = seconds(deadline)
    measure = Measure(kind, common_limit_s(runs) if deadline_s is None else deadline_s)
    # An axis with one value is no axis of the map.
    link = [name for name in factors if name != choose and runs[name].nunique() > 1]
    return Decision(decision_map(runs, link, choose, measure, plan.seed), link, choose, measure)


def print_decision(found: Decision) -> None:
    """The map as a table."""
    table = Table(title=f"Best {found.choose} by {measure_words(found.measure)}")
    for name in (*found.link, "best", "value", "second", "better by", "95 %", "sure", "verdict"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in found.map.to_dict("records"):
        cells = [format_quantity(name, row[name]) for name in found.link]
        span, verdict = f"{row['low']:.3g} - {row['high']:.3g}", row["verdict"]
        also = f" with {row['contenders']}" if verdict == "tie" else ""
        shown = (f"{row['value']:.4g}", str(row["second"]), f"{row['margin']:.3g}", span, f"{row['best_share']:.0%}")
        table.add_row(*cells, str(row["best"]), *shown, verdict + also)
    Paper().print(table)


def measure_words(measure: Measure) -> str:
    """A measure for people, with its unit."""
    limit = format_time(measure.limit_s)
    words = {"time": f"completion time up to {limit} [s]", "success": f"share completed by {limit}", "score": "score"}
    return words[measure.kind]
