"""A plan from what people write: options of the command line, or a call from Python. All that is wrong at once."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final, TypeVar, cast

from teleop_sim.core.errors import BadInput, Problem, UnknownName
from teleop_sim.scenarios.files import load_scenario, read_scenario, scenario_to_toml
from teleop_sim.scenarios.schema import Scenario
from teleop_sim.stats.runs import KINDS, Measure
from teleop_sim.stats.stopping import StopRule
from teleop_sim.sweep.designs import SAMPLED, grid, sampled
from teleop_sim.sweep.factors import AXES, Factor, Value, axis_factor, set_factor
from teleop_sim.sweep.plan import DETAILS, Detail, Plan, Until, merged

T = TypeVar("T")
RUNS: Final = 20
"""Replicates of each cell unless asked otherwise (assumed): enough for a first look at a mean."""


def plan_sweep(
    scenario: str | Path,
    axes: Mapping[str, str] | None = None,
    settings: Sequence[str] = (),
    *,
    runs: int = RUNS,
    seed: int | None = None,
    design: str = "grid",
    detail: str = "full",
    until: str = "",
    measure: str = "time",
    deadline_s: float | None = None,
) -> Plan:
    """The plan of a sweep, checked.

    Args:
        scenario: name or path.
        axes: option of ``factors.AXES`` to text, such as ``{"--uplink": "64bps,4kbps"}``.
        settings: texts such as ``link.up.loss.p=0,0.05``.
        runs: replicates of each cell, or with ``until`` at most.
        seed: of all chance; None: the scenario's own.
        design: ``grid``, ``lhs:64``, ``sobol:64``, ``morris:10``, ``saltelli:64``, or the path of a CSV file whose
            columns are options without dashes (``uplink``) or keys of the scenario, a row a cell.
        detail: of ``plan.DETAILS``.
        until: such as ``ci=5%``: a cell is done when the 95 % interval of its measure is that narrow.
        measure: of the stopping rule: ``time``, ``success`` or ``score``.
        deadline_s: of ``time`` and ``success``; None: the time limit, the shortest of all cells.

    Raises:
        BadInput: every problem of the arguments.

    """
    found = _Found()
    base = found.keep(lambda: load_scenario(scenario))
    factors = _factors(axes or {}, settings, found)
    if runs < 1:
        found.problems.append(Problem("--runs", f"{runs} runs of each cell", "Give one or more."))
    if detail not in DETAILS:
        found.keep(lambda: _refuse("--detail", detail, tuple(DETAILS)))
    rule = found.keep(lambda: _until(until, measure)) if until else None
    the_seed = seed if seed is not None else base.seed if base else 0
    made = found.keep(lambda: _cells(factors, design, the_seed))
    if base is None or made is None or found.problems:
        if base is not None:
            _check_values(base, made[0] if made else factors, found)
        raise BadInput(tuple(dict.fromkeys(found.problems)))
    plan = Plan(
        scenario=scenario_to_toml(base),
        name=base.name,
        source=str(scenario),
        factors=made[0],
        cells=made[1],
        design=design,
        replicates=runs,
        seed=the_seed,
        detail=cast(Detail, detail),
    )
    limit_s = _checked(plan, base, found)
    if rule is None:
        return plan
    return replace(plan, until=Until(Measure(measure, limit_s if deadline_s is None else deadline_s), rule))


def _checked(plan: Plan, base: Scenario, found: _Found) -> float:
    """Make every cell's scenario once; the shortest time limit [s] of them.

    A value may be wrong only beside another, so cells decide; but what is wrong with one is said once.
    """
    try:
        return min(plan.scenario_of(cell).time_limit_s for cell in range(len(plan.cells)))
    except BadInput as error:
        _check_values(base, plan.factors, found)
        raise BadInput(tuple(dict.fromkeys(found.problems)) or error.problems) from None


class _Found:
    """Keeps what is wrong and goes on."""

    def __init__(self) -> None:
        self.problems: list[Problem] = []

    def keep(self, make: Callable[[], T]) -> T | None:
        try:
            return make()
        except BadInput as error:
            self.problems += error.problems
            return None


def _factors(axes: Mapping[str, str], settings: Sequence[str], found: _Found) -> tuple[Factor, ...]:
    makers = [partial(axis_factor, option, text) for option, text in axes.items()]
    makers += [partial(set_factor, text) for text in settings]
    made = tuple(factor for make in makers if (factor := found.keep(make)) is not None)
    seen: dict[str, str] = {}
    for factor in made:
        for key in factor.keys:
            if key in seen:
                what = f"{key} is set by {seen[key]} and by {factor.name}"
                found.problems.append(Problem("sweep", what, "Give one of the two."))
            seen[key] = factor.name
    return made


def _check_values(base: Scenario, factors: Sequence[Factor], found: _Found) -> None:
    """Each value beside the first ones of the other factors: what is wrong with it is said once, not for each cell."""
    text = scenario_to_toml(base)
    first = [_levels(factor)[0] for factor in factors]
    labels = {key: factor.name for factor in factors for key in (*factor.keys, *factor.clears)}
    for n, factor in enumerate(factors):
        for value in _levels(factor):
            cell = (*first[:n], value, *first[n + 1 :])
            overrides = merged(factors, cell)
            found.keep(partial(read_scenario, text, "the scenario", base.name, overrides, labels))


def _levels(factor: Factor) -> tuple[Value, ...]:
    return factor.levels if isinstance(factor.levels, tuple) else (factor.levels.low, factor.levels.high)


def _cells(
    factors: tuple[Factor, ...], design: str, seed: int
) -> tuple[tuple[Factor, ...], tuple[tuple[Value, ...], ...]]:
    kind, colon, count = design.partition(":")
    if design == "grid":
        return factors, grid(factors)
    if kind in SAMPLED and colon:
        if not count.isdecimal() or not int(count):
            raise BadInput((Problem("--design", f"{design!r} has no count", f"Give one, such as {kind}:64."),))
        if not factors:
            raise BadInput((Problem("--design", f"{design} has nothing to vary", "Add --uplink, --set, ..."),))
        return factors, sampled(factors, kind, int(count), seed)
    if Path(design).suffix == ".csv":
        if factors:
            hint = "Put their values into the file's columns, or leave the file out."
            raise BadInput((Problem("--design", "a design file names its own factors, and others were given", hint),))
        return _read_design(Path(design))
    names = ("grid", *(f"{name}:N" for name in SAMPLED), "FILE.csv")
    raise UnknownName("--design", design, names)


def _read_design(path: Path) -> tuple[tuple[Factor, ...], tuple[tuple[Value, ...], ...]]:
    """A CSV file: a header of factors, a row a cell."""
    try:
        rows = [row for row in csv.reader(path.read_text(encoding="utf-8-sig").splitlines()) if row]
    except OSError as error:
        raise BadInput((Problem("--design", f"{path} cannot be read: {error.strerror}"),)) from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise BadInput((Problem("--design", f"{path} is no CSV file: {error}"),)) from None
    if len(rows) < 2:
        raise BadInput((Problem(str(path), "has no cells", "Give a header and a row a cell."),))
    names, found = [name.strip() for name in rows[0]], _Found()
    for number, row in enumerate(rows[1:], 2):
        if len(row) != len(names):
            found.problems.append(Problem(f"{path}:{number}", f"{len(row)} values for {len(names)} factors"))
    if found.problems:
        raise BadInput(tuple(found.problems))
    columns = [[found.keep(partial(_one, name, row[i])) for row in rows[1:]] for i, name in enumerate(names)]
    if found.problems:
        raise BadInput(tuple(dict.fromkeys(found.problems)))
    factors, cells = [], []
    for column in columns:
        values = [factor.levels[0] for factor in column if factor is not None and isinstance(factor.levels, tuple)]
        first = next(factor for factor in column if factor is not None)
        factors.append(Factor(first.name, first.keys, tuple(dict.fromkeys(values)), first.clears))
        cells.append(values)
    return tuple(factors), tuple(zip(*cells, strict=True))


def _one(name: str, text: str) -> Factor:
    """The factor of one value of a design file."""
    option = f"--{name}"
    factor = axis_factor(option, text.strip()) if option in AXES else set_factor(f"{name}={text.strip()}")
    if not isinstance(factor.levels, tuple) or len(factor.levels) != 1:
        raise BadInput((Problem(name, f"{text!r} is more than one value", "Give a row a cell."),))
    return factor


def _until(text: str, measure: str) -> StopRule:
    found = re.fullmatch(r"ci=(\d+\.?\d*|\.\d+)%", text.replace(" ", ""))
    share = float(found[1]) / 100.0 if found else 0.0
    problems = []
    if not 0.0 < share < 1.0:
        problems.append(Problem("--until", f"{text!r} is not understood", "Give a half width, such as ci=5%."))
    if measure not in KINDS:
        problems += UnknownName("--measure", measure, KINDS).problems
    if problems:
        raise BadInput(tuple(problems))
    return StopRule(relative=share)


def _refuse(where: str, name: str, choices: tuple[str, ...]) -> None:
    raise UnknownName(where, name, choices)
