"""Options of ``teleop-sim sweep`` as a plan, a directory and a crew; all that is wrong with them at once."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from teleop_sim.cli_options import out_problems
from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.core.units import parse_time_s

if TYPE_CHECKING:
    from teleop_sim.sweep.plan import Plan
    from teleop_sim.sweep.workers import Crew

T = TypeVar("T")
PLANNED = ("runs", "seed", "design", "detail", "until", "measure", "deadline", "settings", "out")
"""Options that a resumed sweep has from its manifest."""


def chosen_sweep(given: Mapping[str, Any]) -> tuple[Plan, Path, Crew]:
    """What is to be run, where and by whom.

    Args:
        given: the command's parameters by name.

    Raises:
        BadInput: every problem of the options. SweepBroken: ``--resume`` of what cannot be gone on with.

    """
    from teleop_sim.sweep.factors import AXES

    problems: list[Problem] = []
    axes = {option: text for option in AXES if (text := given[option.removeprefix("--")]) is not None}
    crew = _kept(problems, lambda: _crew(given["workers"], given["scheduler"]))
    plan = _kept(problems, lambda: _resumed(given, axes) if given["resume"] is not None else _planned(given, axes))
    directory = given["resume"]
    if plan is not None and directory is None:
        directory = given["out"] or Path("runs") / f"{plan.name}_sweep"
        if not given["dry_run"]:
            problems += out_problems(directory) or _there_already(directory)
    if problems or plan is None or crew is None:
        raise BadInput(tuple(problems))
    return plan, directory, crew


def _kept(problems: list[Problem], make: Callable[[], T]) -> T | None:
    try:
        return make()
    except BadInput as error:
        problems += error.problems
        return None


def _planned(given: Mapping[str, Any], axes: Mapping[str, str]) -> Plan:
    from teleop_sim.sweep.planning import RUNS, plan_sweep

    problems: list[Problem] = []
    if given["scenario"] is None:
        problems.append(Problem("sweep", "no scenario was given", "Give one, such as src-dish, or --resume DIR."))
    if given["force"]:
        problems.append(Problem("--force", "there is nothing to force", "It goes with --resume DIR."))
    runs = _kept(problems, lambda: whole(given["runs"], "--runs", 1)) if given["runs"] is not None else RUNS
    seed = _kept(problems, lambda: whole(given["seed"], "--seed", 0)) if given["seed"] is not None else None
    deadline_s = _kept(problems, lambda: seconds(given["deadline"]))
    plan = None
    if given["scenario"] is not None:
        keys = ("design", "detail", "until", "measure")
        plan = _kept(
            problems,
            lambda: plan_sweep(
                given["scenario"],
                axes,
                given["settings"] or (),
                runs=runs or RUNS,
                seed=seed,
                deadline_s=deadline_s,
                **{key: given[key] for key in keys},
            ),
        )
    if problems or plan is None:
        raise BadInput(tuple(problems))
    return plan


def _resumed(given: Mapping[str, Any], axes: Mapping[str, str]) -> Plan:
    from teleop_sim.scenarios.files import load_scenario, scenario_to_toml
    from teleop_sim.sweep.study import resumed_plan

    left_out = {"design": "grid", "detail": "full", "until": "", "measure": "time"}
    also = [*axes, *(f"--{name}" for name in PLANNED if given[name] != left_out.get(name))]
    also = ["SCENARIO", *also] if given["scenario"] is not None else also
    if also:
        hint = "Leave them out: the sweep's manifest says what it is."
        raise BadInput((Problem("--resume", f"goes alone, and {', '.join(also)} came with it", hint),))

    def text(source: str) -> str | None:
        try:
            return scenario_to_toml(load_scenario(source))
        except BadInput:
            return None

    return resumed_plan(given["resume"], text, given["force"])


def _crew(workers: str | None, scheduler: str | None) -> Crew:
    from teleop_sim.sweep.workers import Processes

    count = whole(workers, "--workers", 1) if workers is not None else len(os.sched_getaffinity(0))
    if scheduler is None:
        return Processes(count)
    from teleop_sim.sweep.cluster import Cluster

    if scheduler != "local" and workers is not None:
        hint = "Start workers there, or leave one of the two out."
        raise BadInput((Problem("--workers", f"{scheduler} has workers of its own", hint),))
    return Cluster(scheduler, count)


def _there_already(directory: Path) -> list[Problem]:
    from teleop_sim.sweep.folder import SweepFolder

    if not SweepFolder(directory).manifest.exists():
        return []
    hint = f"Go on with it: teleop-sim sweep --resume {directory}; or give another --out."
    return [Problem("--out", f"{directory} holds a sweep already", hint)]


def whole(text: str, where: str, least: int) -> int:
    """A whole number from text.

    Raises:
        BadInput: it is none, or too small.

    """
    value = int(text) if text.strip().isdecimal() else -1
    if value < least:
        shown = repr(text if len(text) <= 40 else f"{text[:37]}...")
        raise BadInput((Problem(where, f"{shown} is no whole number from {least}", f"Give one, such as {least + 1}."),))
    return value


def seconds(text: str | None) -> float | None:
    """A deadline from text.

    Raises:
        BadInput: no time above zero.

    """
    if text is None:
        return None
    value_s = parse_time_s(text, "--deadline")
    if value_s <= 0.0:
        raise BadInput((Problem("--deadline", "nothing is done in no time", "Give above zero, such as 10min."),))
    return value_s
