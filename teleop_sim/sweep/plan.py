"""A sweep as a value: the scenario, its factors, the cells of its design, how many replicates, and what is kept.

A cell is one setting of all factors; a replicate is one draw of all chance, shared by all cells (common random numbers);
a run is one of each. The plan is all that decides what a sweep's runs are; who computes them, and in which order, does not.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from typing import Any, Final, Literal

import numpy as np

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.core.fingerprint import fingerprint
from teleop_sim.core.streams import stream
from teleop_sim.scenarios.files import read_scenario
from teleop_sim.scenarios.schema import Scenario
from teleop_sim.sweep.factors import Factor, Value

FORMAT: Final = 1
"""Of the manifest. A reader refuses a greater one."""

Detail = Literal["full", "events", "summary"]
DETAILS: Final[Mapping[Detail, str]] = {
    "full": "one log a run, all of it: replays in 3D",
    "events": "one log a run without the robot's motion",
    "summary": "no logs, only the index",
}

MOST_RUNS: Final = 10_000_000
"""Of one sweep: more is a slip of the finger (assumed)."""


@dataclass(frozen=True)
class Until:
    """When a cell has enough replicates: its interval is narrow enough.

    Attributes:
        half_width: of the 95 % interval, as a share of the estimate.
        measure: of ``teleop_sim.sweep.stopping.MEASURES``.
        least: replicates before the rule is asked, and between two questions.

    """

    half_width: float
    measure: str = "time"
    least: int = 10


@dataclass(frozen=True)
class Plan:
    """What a sweep runs.

    Attributes:
        scenario: canonical TOML of the base scenario.
        name: of the scenario.
        source: name or path that the user gave.
        factors: the axes; of a design file without values of their own.
        cells: one tuple of values a cell, in the order of the factors.
        design: ``grid``, ``lhs``, ``sobol``, ``file``, ...: how the cells came about.
        replicates: of each cell; with ``until`` at most.
        seed: of all chance.
        detail: what is kept of a run.
        until: when to stop early; None: never.

    """

    scenario: str
    name: str
    source: str
    factors: tuple[Factor, ...]
    cells: tuple[tuple[Value, ...], ...]
    design: str
    replicates: int
    seed: int
    detail: Detail = "full"
    until: Until | None = None

    @property
    def runs(self) -> int:
        """How many there are, at most."""
        return len(self.cells) * self.replicates

    def overrides(self, cell: int) -> dict[str, object]:
        """The scenario's keys that a cell sets."""
        merged: dict[str, object] = {}
        # What clears a whole table goes first, whatever the order of the factors.
        for factor, value in sorted(zip(self.factors, self.cells[cell], strict=True), key=lambda fv: not fv[0].clears):
            merged |= factor.overrides(value)
        return merged

    def scenario_of(self, cell: int) -> Scenario:
        """The scenario of a cell.

        Raises:
            BadInput: its values do not fit; each problem names the factor.

        """
        labels = {key: factor.name for factor in self.factors for key in (*factor.keys, *factor.clears)}
        where = f"cell {cell} ({self.words(cell)})"
        overrides = self.overrides(cell) | {"seed": self.seed}
        return read_scenario(self.scenario, where, self.name, overrides, labels)

    def words(self, cell: int) -> str:
        """A cell for people: ``uplink_bps=380.0, autonomy=full``."""
        return ", ".join(f"{f.name}={v}" for f, v in zip(self.factors, self.cells[cell], strict=True)) or "as it is"

    def digest(self) -> str:
        """Of all that decides what the runs are, 16 hexadecimal digits; not of how many there are."""
        decides = (self.scenario, self.name, self.cells, tuple((f.name, f.keys, f.clears) for f in self.factors), self.seed)
        return fingerprint(*decides).hex()[:16]


def grid(factors: Sequence[Factor]) -> tuple[tuple[Value, ...], ...]:
    """All combinations, the last factor fastest. Without factors one cell."""
    refuse_ranges(factors)
    count = math.prod(len(f.values) for f in factors)
    if count > MOST_RUNS:
        raise BadInput((Problem("sweep", f"the grid has {count:,} cells", "Give fewer values, or a sampled design."),))
    return tuple(product(*(f.values for f in factors)))


def refuse_ranges(factors: Sequence[Factor]) -> None:
    """A grid needs values, not ranges."""
    problems = [
        Problem(f.name, "is a range to sample from, and the design is a grid", "Add a count: 1kbps:4kbps:4, or --design.")
        for f in factors
        if f.sampled
    ]
    if problems:
        raise BadInput(tuple(problems))


def sampled(factors: Sequence[Factor], kind: str, count: int, seed: int) -> tuple[tuple[Value, ...], ...]:
    """``count`` cells of a space-filling design; lists are sampled by equal shares.

    Args:
        kind: ``lhs`` (Latin hypercube) or ``sobol`` (scrambled Sobol points; ``count`` a power of two fills best).

    Source: ``scipy.stats.qmc``.

    """
    from scipy.stats import qmc

    rng = stream(seed, 0, f"sweep.design.{kind}")
    width = len(factors)
    if kind == "lhs":
        shares = qmc.LatinHypercube(width, rng=rng).random(count)
    else:
        exponent = max(0, math.ceil(math.log2(count)))
        shares = qmc.Sobol(width, rng=rng).random_base2(exponent)[:count]
    return tuple(tuple(f.at(float(s)) for f, s in zip(factors, row, strict=True)) for row in np.asarray(shares))


def to_json(plan: Plan) -> dict[str, Any]:
    """Plain values, for the manifest."""
    return {"format": FORMAT} | asdict(plan)


def from_json(values: Mapping[str, Any]) -> Plan:
    """The plan that ``to_json`` wrote.

    Raises:
        KeyError, TypeError, ValueError: it is no plan.

    """
    if values["format"] != FORMAT:
        raise ValueError(f"manifest format {values['format']}; this version reads {FORMAT}")
    until = values["until"]
    if values["detail"] not in DETAILS:
        raise ValueError(f"unknown level of detail {values['detail']!r}")
    return Plan(
        scenario=str(values["scenario"]),
        name=str(values["name"]),
        source=str(values["source"]),
        factors=tuple(_factor(f) for f in values["factors"]),
        cells=tuple(tuple(_value(v) for v in cell) for cell in values["cells"]),
        design=str(values["design"]),
        replicates=int(values["replicates"]),
        seed=int(values["seed"]),
        detail=values["detail"],
        until=None if until is None else Until(float(until["half_width"]), str(until["measure"]), int(until["least"])),
    )


def _factor(values: Mapping[str, Any]) -> Factor:
    return Factor(
        name=str(values["name"]),
        keys=tuple(map(str, values["keys"])),
        values=tuple(_value(v) for v in values["values"]),
        scale=str(values["scale"]),
        clears=tuple(map(str, values["clears"])),
    )


def _value(value: Any) -> Value:
    return tuple(_value(v) for v in value) if isinstance(value, list) else value
