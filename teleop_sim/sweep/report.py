"""A sweep's directory as the value that its report is made of, and its report."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from teleop_sim.core.errors import BadInput, UnknownName
from teleop_sim.reports.formats.files import PAGE
from teleop_sim.reports.sweep_cells import MEANS
from teleop_sim.reports.sweep_page import write_sweep_view
from teleop_sim.reports.sweep_view import SweepRuns
from teleop_sim.stats.runs import COLUMNS
from teleop_sim.sweep.designs import SENSITIVITY
from teleop_sim.sweep.folder import SweepBroken, SweepFolder
from teleop_sim.sweep.index import load_sweep, load_sweep_states, load_sweep_times
from teleop_sim.sweep.plan import Plan
from teleop_sim.sweep.sensitivity import sensitivity

if TYPE_CHECKING:
    import pandas as pd


def write_sweep(
    directory: Path | str, out: Path | str | None = None, formats: Sequence[str] = (PAGE,), choose: str = ""
) -> list[Path]:
    """Write the report of a sweep: of one that was killed, of what is finished.

    Args:
        directory: of the sweep.
        out: folder for the files, made if it is missing; None: the sweep's own.
        formats: of ``reports.formats.files.FORMATS``.
        choose: factor whose levels are compared; empty: by the rule of ``SweepRuns.compared``.

    Returns:
        the files: ``<directory's name>.html``, and of other formats ``<directory's name>.<part>.<ending>``.

    Raises:
        SweepBroken: it is no sweep, or a file of it does not read.
        UnknownName: no such factor.
        OSError: a file cannot be written.

    """
    path = Path(directory)
    folder = path if out is None else Path(out)
    return write_sweep_view(sweep_runs(path, folder, choose), folder, path.absolute().name, formats)


def sweep_runs(directory: Path | str, out: Path | None = None, choose: str = "") -> SweepRuns:
    """What is finished of a sweep.

    Args:
        directory: of the sweep.
        out: folder of the report, from which it links to logs; None: the sweep's own.
        choose: factor whose levels are compared; empty: by the rule of ``SweepRuns.compared``.

    Raises:
        SweepBroken: it is no sweep, or a file of it does not read.
        UnknownName: no such factor.

    """
    path = Path(directory)
    folder = SweepFolder(path)
    plan, versions = folder.read()
    factors = tuple(factor.name for factor in plan.factors)
    if choose and choose not in factors:
        raise UnknownName("--choose", choose, factors)
    runs = _checked(folder, load_sweep(path), factors)
    scenario = _scenario(folder, plan)
    return SweepRuns(
        name=plan.name,
        question=str(scenario.get("question", "")),
        task=str(scenario.get("task", "")),
        runs=runs,
        factors=factors,
        base=_base(plan, scenario),
        design=plan.design,
        planned=plan.runs,
        cells=len(plan.cells),
        # The index is written when all is done that was to be done.
        finished=folder.index.exists() or len(runs) == plan.runs,
        until=plan.until is not None,
        seed=plan.seed,
        detail=plan.detail,
        where=str(directory),
        scenario=plan.scenario,
        versions=", ".join(f"{name} {versions[name]}" for name in ("teleop-sim", "mujoco") if name in versions),
        to_logs=_from(folder.path if out is None else out, folder.path),
        pages=frozenset(page for log in runs["log"] if log and (path / (page := page_of(log))).is_file()),
        states=load_sweep_states(path),
        times=load_sweep_times(path),
        effects=_effects(path, plan, len(runs)),
        choose=choose,
    )


def _checked(folder: SweepFolder, runs: pd.DataFrame, factors: Sequence[str]) -> pd.DataFrame:
    """Refuse an index that is none.

    Raises:
        SweepBroken: it lacks columns.

    """
    wanted = ("cell", *COLUMNS, "outcome", "cause", "log", *factors, *MEANS)
    missing = [name for name in wanted if name not in runs.columns]
    if missing:
        hint = "If it is of another version, remove it: teleop-sim sweep --resume writes it again."
        raise SweepBroken(str(folder.index), f"has no column {', '.join(missing)}", hint)
    return runs


def _scenario(folder: SweepFolder, plan: Plan) -> dict[str, Any]:
    try:
        return tomllib.loads(plan.scenario)
    except tomllib.TOMLDecodeError as error:
        hint = "It is written by teleop-sim sweep; put it back."
        raise SweepBroken(str(folder.manifest), f"its scenario does not read: {error}", hint) from None


def _from(out: Path, directory: Path) -> str:
    """The way from one folder to another, for addresses."""
    way = Path(os.path.relpath(directory.absolute(), out.absolute())).as_posix()
    return "" if way == "." else f"{way}/"


def page_of(log: str) -> str:
    """Where the page of a run is, from its log."""
    return f"{log.removesuffix('.mcap')}.html"


def _effects(path: Path, plan: Plan, runs: int) -> pd.DataFrame | None:
    """Of a finished design of sensitivity; None of others, and where its measure did not vary."""
    kind, colon, _ = plan.design.partition(":")
    if kind not in SENSITIVITY or not colon or runs != plan.runs:
        return None
    try:
        return sensitivity(path)
    except BadInput:
        return None


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
