"""A sweep as a value: the scenario, its factors, the cells of its design, how many replicates, and what is kept.

A cell is one setting of all factors; a replicate is one draw of all chance, shared by all cells (common random
numbers); a run is one of each. The plan is all that decides what a sweep's runs are; who computes them, and in which
order, does not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final, Literal

from teleop_sim.core.fingerprint import fingerprint
from teleop_sim.scenarios.files import read_scenario
from teleop_sim.scenarios.schema import Scenario
from teleop_sim.stats.factors import Range
from teleop_sim.stats.runs import Measure
from teleop_sim.stats.stopping import StopRule
from teleop_sim.sweep.factors import Factor, Value

FORMAT: Final = 1
"""Of the manifest. A reader refuses a greater one."""

Detail = Literal["full", "events", "summary"]
DETAILS: Final[Mapping[Detail, str]] = {
    "full": "one log a run, all of it: replays in 3D",
    "events": "one log a run without the robot's motion",
    "summary": "no logs, only the index",
}


@dataclass(frozen=True)
class Until:
    """When a cell has enough replicates: the interval of its measure is narrow enough."""

    measure: Measure
    rule: StopRule

    def within(self, replicates: int) -> StopRule:
        """The rule where there are no more than so many replicates."""
        return replace(self.rule, maximum=replicates, minimum=min(self.rule.minimum, replicates))


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
        return merged(self.factors, self.cells[cell])

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
        axes = tuple((f.name, f.keys, f.clears) for f in self.factors)
        return fingerprint(self.scenario, self.name, self.cells, axes, self.seed).hex()[:16]


def merged(factors: Sequence[Factor], cell: Sequence[Value]) -> dict[str, object]:
    """The scenario's keys that a cell sets."""
    keys: dict[str, object] = {}
    # What clears a whole table goes first, whatever the order of the factors.
    for factor, value in sorted(zip(factors, cell, strict=True), key=lambda pair: not pair[0].clears):
        keys |= factor.overrides(value)
    return keys


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
        until=None if until is None else Until(Measure(**until["measure"]), StopRule(**until["rule"])),
    )


def _factor(values: Mapping[str, Any]) -> Factor:
    levels = values["levels"]
    return Factor(
        name=str(values["name"]),
        keys=tuple(map(str, values["keys"])),
        levels=Range(**levels) if isinstance(levels, dict) else tuple(_value(v) for v in levels),
        clears=tuple(map(str, values["clears"])),
    )


def _value(value: Any) -> Value:
    return tuple(_value(v) for v in value) if isinstance(value, list) else value
