"""A sweep's directory as the value that its report is made of."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from teleop_sim.reports.sweep_view import SweepRuns
from teleop_sim.sweep.designs import SENSITIVITY
from teleop_sim.sweep.folder import SweepFolder
from teleop_sim.sweep.index import load_sweep, load_sweep_states, load_sweep_times
from teleop_sim.sweep.plan import Plan
from teleop_sim.sweep.sensitivity import sensitivity


def sweep_runs(directory: Path | str, to_logs: str = "", choose: str = "") -> SweepRuns:
    """What is finished of a sweep.

    Args:
        directory: of the sweep.
        to_logs: from the report's folder to the sweep's directory.
        choose: factor whose levels are compared; empty: by the rule of ``SweepRuns.compared``.

    Raises:
        SweepBroken: it is no sweep, or a file of it does not read.

    """
    path = Path(directory)
    plan, _ = SweepFolder(path).read()
    runs = load_sweep(path)
    scenario = tomllib.loads(plan.scenario)
    pages = frozenset(page for log in runs["log"] if log and (path / (page := page_of(log))).is_file())
    return SweepRuns(
        name=plan.name,
        question=str(scenario.get("question", "")),
        task=str(scenario.get("task", "")),
        runs=runs,
        factors=tuple(factor.name for factor in plan.factors),
        base=_base(plan, scenario),
        design=plan.design,
        planned=plan.runs,
        cells=len(plan.cells),
        until=plan.until is not None,
        seed=plan.seed,
        detail=plan.detail,
        where=str(directory),
        to_logs=to_logs,
        pages=pages,
        states=load_sweep_states(path),
        times=load_sweep_times(path),
        effects=sensitivity(path) if _analysed(plan, len(runs)) else None,
        choose=choose,
    )


def page_of(log: str) -> str:
    """Where the page of a run is, from its log."""
    return f"{log.removesuffix('.mcap')}.html"


def _analysed(plan: Plan, runs: int) -> bool:
    kind, colon, _ = plan.design.partition(":")
    return kind in SENSITIVITY and bool(colon) and runs == plan.runs


def _base(plan: Plan, scenario: Mapping[str, Any]) -> dict[str, Any]:
    """Factor to what the scenario says itself, where all its keys say the same."""
    found = {}
    for factor in plan.factors:
        values = [_at(scenario, key) for key in factor.keys]
        if values[0] is not None and all(value == values[0] for value in values):
            found[factor.name] = str(values[0]) if isinstance(values[0], list) else values[0]
    return found


def _at(tables: Mapping[str, Any], key: str) -> Any:
    """The value of a dotted key; None where there is none."""
    value: Any = tables
    for part in key.split("."):
        value = value.get(part) if isinstance(value, Mapping) else None
    return value
