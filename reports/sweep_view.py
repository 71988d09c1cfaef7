"""A sweep as its report sees it: a table of runs, its factors, and what is compared along which axis.

``teleop_sim.sweep.report`` fills it. The rules by which figures choose their axes are here and in
``sweep_layout.py``, and are written down in docs/sweeps.md.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

from teleop_sim.core.units import format_quantity
from teleop_sim.reports.state_counts import COLUMNS, StateCount, entries
from teleop_sim.reports.table import Entry

if TYPE_CHECKING:
    import pandas as pd

WORDS: Final[Mapping[str, str]] = {
    "uplink_bps": "uplink [bit/s]",
    "downlink_bps": "downlink [bit/s]",
    "latency_s": "one-way delay [s]",
    "loss": "packet loss",
    "preset": "link",
    "delivery": "delivery",
    "autonomy": "autonomy level",
    "layer": "control layer",
    "robot": "robot",
    "pacing": "pacing",
    "policy": "crew policy",
    "team": "crew size",
    "expertise": "factor on people's times",
}
"""Column of a factor to words, with its unit."""

UNITS: Final[Mapping[str, str]] = {"bps": "bit/s", "s": "s", "m": "m", "rad": "rad", "n": "N", "nm": "Nm", "kg": "kg"}
"""Ending of a key to its unit."""

CHOICES: Final = ("autonomy", "layer", "policy", "team", "robot", "pacing", "expertise", "delivery")
"""Factors that people choose between, the first that varies first."""

LINK: Final = ("uplink_bps", "downlink_bps", "latency_s", "loss", "preset", "delivery")
"""Factors of the link, in the order in which figures take them for an axis."""

LEVELS: Final = ("off", "low", "high", "full")
"""Of autonomy, in their order."""

MOST_COMPARED: Final = 6
"""Levels that one figure tells apart: so many colours there are."""

LOG_RATIO: Final = 16.0
"""From this ratio of the greatest to the least value on, an axis is logarithmic (a choice of layout)."""


@dataclass(frozen=True)
class SweepRuns:
    """The finished runs of a sweep, and its plan as far as a report needs it.

    Attributes:
        name: of the scenario.
        question: of the scenario.
        task: of the scenario, such as ``src-dish``.
        runs: see ``teleop_sim.sweep.index.load_sweep``.
        factors: all columns that the plan varies, in its order.
        base: factor to the scenario's own value, where it has one.
        design: how the cells came about: ``grid``, ``lhs:40``, the name of a file, ...
        planned: runs that there will be, at most.
        cells: that there will be.
        finished: whether all of them are.
        until: whether cells stop when they are known well enough.
        seed: of all chance.
        detail: what is kept of a run.
        where: the sweep's directory, as people type it.
        scenario: that was varied, as TOML.
        versions: with which it was run, in words.
        to_logs: from the report's folder to the sweep's directory: empty, or with a stroke at its end.
        pages: of runs, beside their logs, from the sweep's directory.
        states: see ``load_sweep_states``; None: not kept.
        times: see ``load_sweep_times``; None: neither door nor valve, or not kept.
        effects: see ``teleop_sim.sweep.sensitivity``; None: another design.
        choose: the factor to compare, by name; empty: by ``CHOICES``.

    """

    name: str
    question: str
    task: str
    runs: pd.DataFrame
    factors: tuple[str, ...]
    base: Mapping[str, Any]
    design: str
    planned: int
    cells: int
    finished: bool
    until: bool
    seed: int
    detail: str
    where: str
    scenario: str = ""
    versions: str = ""
    to_logs: str = ""
    pages: frozenset[str] = frozenset()
    states: pd.DataFrame | None = field(default=None, repr=False)
    times: pd.DataFrame | None = field(default=None, repr=False)
    effects: pd.DataFrame | None = field(default=None, repr=False)
    choose: str = ""

    __hash__ = object.__hash__

    def __eq__(self, other: object) -> bool:
        """Only itself: tables have no equality."""
        return self is other

    @cached_property
    def levels(self) -> Mapping[str, tuple[Any, ...]]:
        """Factor to its values in finished runs: numbers ascending, levels of autonomy in order, others as planned."""
        return {name: ordered(list(self.runs[name].unique())) for name in self.factors}

    @cached_property
    def varying(self) -> tuple[str, ...]:
        """Factors with more than one value: of the link first, in the order of ``LINK``, then as planned."""
        many = [name for name in self.factors if len(self.levels[name]) > 1]
        return tuple([name for name in LINK if name in many] + [name for name in many if name not in LINK])

    @cached_property
    def grid(self) -> bool:
        """Whether the cells are all combinations of the values, so that one factor varies while others stand still."""
        settings = len(self.runs.drop_duplicates([*self.factors])) if self.factors else len(self.runs[:1])
        whole = math.prod(len(self.levels[name]) for name in self.factors)
        return self.design == "grid" or self.cells == whole == settings

    @cached_property
    def compared(self) -> str:
        """The factor whose levels are the lines of a figure; empty: none.

        The one that was asked for; else the first of ``CHOICES`` that varies; else the first with values in words; else
        the last. Always one with at most ``MOST_COMPARED`` values, and none if no other varies but a numeric one.
        """
        if self.choose in self.varying:
            return self.choose
        few = [name for name in self.varying if len(self.levels[name]) <= MOST_COMPARED]
        named = [name for name in CHOICES if name in few] + [name for name in few if not numeric(self.levels[name])]
        return (named or (few[-1:] if len(self.varying) > 1 else []) or [""])[0]

    @cached_property
    def link(self) -> tuple[str, ...]:
        """Varying factors but the compared one."""
        return tuple(name for name in self.varying if name != self.compared)

    @cached_property
    def limit_s(self) -> float:
        """To which completion times are restricted: the longest that every run was watched [s]; NaN: no run.

        That is the shortest time limit, or earlier where a run was left before it.
        """
        if not len(self.runs):
            return math.nan
        left_s = self.runs.loc[self.runs["status"] == "censored", "time_s"].min()
        limit_s = float(self.runs["limit_s"].min())
        return limit_s if math.isnan(left_s) else min(limit_s, float(left_s))

    @cached_property
    def summary(self) -> pd.DataFrame:
        """A row a cell, see ``stats.summary.summary``, with the column ``cell``; empty without runs."""
        import pandas as pd

        from teleop_sim.stats.summary import summary

        return summary(self.runs, ["cell"], self.limit_s) if len(self.runs) else pd.DataFrame(columns=["cell"])

    @cached_property
    def table(self) -> pd.DataFrame:
        """``summary`` with the factors of each cell."""
        first = self.runs.drop_duplicates("cell")[["cell", *self.factors]]
        return first.merge(self.summary, on="cell").sort_values("cell", ignore_index=True)

    @cached_property
    def entries(self) -> Mapping[tuple[int, int], Mapping[str, Entry]]:
        """Cell and replicate of each run to what it did in each row of Table II; empty where states were not kept."""
        if self.states is None:
            return {}
        found: dict[tuple[int, int], list[StateCount]] = {}
        columns = [self.states[name].tolist() for name in ("cell", "replicate", *COLUMNS)]
        for cell, replicate, *count in zip(*columns, strict=True):
            found.setdefault((cell, replicate), []).append(StateCount(*count))
        return {run: entries(counts) for run, counts in found.items()}

    def says(self, name: str, value: Any) -> str:
        """A value of a factor for people: ``380 bit/s``."""
        return format_quantity(name, float(value) if numeric((value,)) else value)

    def setting(self, held: Mapping[str, Any]) -> str:
        """Values of some factors for people."""
        return ", ".join(f"{bare(name)} {self.says(name, value)}" for name, value in held.items())


def ordered(values: Sequence[Any]) -> tuple[Any, ...]:
    """Numbers ascending, levels of autonomy from off to full, others as they come."""
    if numeric(values):
        return tuple(sorted(values))
    if all(value in LEVELS for value in values):
        return tuple(sorted(values, key=LEVELS.index))
    return tuple(values)


def numeric(values: Sequence[Any]) -> bool:
    """Whether all values are numbers."""
    from numbers import Real

    return all(isinstance(value, Real) and not isinstance(value, bool) for value in values)


def logarithmic(values: Sequence[Any]) -> bool:
    """Whether an axis of these values is logarithmic: they span ``LOG_RATIO``, and are more even so than without."""
    if not numeric(values) or len(values) < 2 or not min(values) > 0.0 or max(values) < LOG_RATIO * min(values):
        return False
    return len(values) == 2 or _uneven([math.log(v) for v in values]) < _uneven([float(v) for v in values])


def _uneven(values: Sequence[float]) -> float:
    """Coefficient of variation of the gaps between ascending values."""
    gaps = [b - a for a, b in pairwise(sorted(values))]
    mean = sum(gaps) / len(gaps)
    return math.sqrt(sum((gap - mean) ** 2 for gap in gaps) / len(gaps)) / mean


def words(name: str) -> str:
    """A factor for people, with its unit: ``uplink [bit/s]``, ``link.up.delay [s]``."""
    stem, _, unit = name.rpartition("_")
    return WORDS.get(name) or (f"{stem} [{UNITS[unit]}]" if stem and unit in UNITS else name)


def bare(name: str) -> str:
    """A factor for people, without its unit."""
    return words(name).split(" [")[0]
