"""Differences between two ways of doing things that were tried on the same replicates.

Under common random numbers the same seed gives both the same world, people and losses. What differs is then the way
alone, and the mean of the differences is known better than the difference of the means.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from teleop_sim.core.streams import stream
from teleop_sim.stats.bootstrap import mean_interval, resample_weights
from teleop_sim.stats.estimate import CONFIDENCE, Estimate, refuse
from teleop_sim.stats.runs import FloatArray, Measure, cells, check_runs, measured

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, slots=True)
class Paired:
    """What changes from one way to the other.

    Attributes:
        difference: mean of second minus first, with its interval.
        first: mean of the first.
        second: mean of the second.
        correlation: between the two over replicates; not a number if one does not vary.
        variance_reduction: Var(first) + Var(second) over Var(second - first): how many times as many independent runs
            would be needed. Below 1 where the pairing harms; infinite where every difference is the same.

    """

    difference: Estimate
    first: float
    second: float
    correlation: float
    variance_reduction: float


@dataclass(frozen=True, slots=True)
class Matched:
    """A measure on the replicates that all levels have in common.

    Attributes:
        levels: values of the factor, in the order in which they first appear; k of them.
        values: shape (k, n).
        dropped: rows of the table left out, because another level lacks their replicate.

    """

    levels: tuple[Any, ...]
    values: FloatArray
    dropped: int


def paired(first: ArrayLike, second: ArrayLike, rng: np.random.Generator, confidence: float = CONFIDENCE) -> Paired:
    """Compare two samples whose i-th values share replicate i.

    The interval is that of :func:`teleop_sim.stats.bootstrap.mean_interval`.

    Raises:
        BadInput: shapes that differ, or fewer than two replicates.

    Source of the figure of merit: Law, Simulation Modeling and Analysis (5th ed. 2015), section 11.2.

    """
    a, b = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    if a.ndim != 1 or a.shape != b.shape or a.size < 2:
        raise refuse("paired", f"shapes {a.shape} and {b.shape}", "Give two values for each of two or more replicates.")
    mean, low, high = mean_interval(b - a, resample_weights(a.size, rng), confidence)
    note = "the same in every replicate" if np.ptp(b - a) == 0.0 else ""
    difference = Estimate(float(mean), float(low), float(high), int(a.size), note)
    apart, spread = float(np.var(b - a, ddof=1)), float(np.var(a, ddof=1) + np.var(b, ddof=1))
    steady = np.ptp(a) == 0.0 or np.ptp(b) == 0.0
    correlation = float("nan") if steady else float(np.corrcoef(a, b)[0, 1])
    reduction = spread / apart if apart > 0.0 else float("nan") if spread == 0.0 else float("inf")
    return Paired(difference, float(a.mean()), float(b.mean()), correlation, reduction)


def matched(rows: pd.DataFrame, factor: str, measure: Measure) -> Matched:
    """The measure of one cell's runs by level and replicate, for the replicates that every level has.

    Raises:
        BadInput: see :func:`teleop_sim.stats.runs.measured`.

    """
    values = measured(rows, measure)
    by_level: dict[Any, dict[int, float]] = {}
    for level, replicate, value in zip(rows[factor], rows["replicate"], values, strict=True):
        by_level.setdefault(level, {})[int(replicate)] = float(value)
    shared = sorted(set.intersection(*(set(found) for found in by_level.values())))
    table = np.array([[found[r] for r in shared] for found in by_level.values()], dtype=np.float64)
    return Matched(tuple(by_level), table, len(rows) - table.size)


def differences(
    runs: pd.DataFrame,
    factor: str,
    first: object,
    second: object,
    measure: Measure,
    by: Sequence[str] = (),
    seed: int = 0,
    confidence: float = CONFIDENCE,
) -> pd.DataFrame:
    """``second`` minus ``first`` of one factor, in each cell of the others.

    Returns:
        A row a cell that has both: the columns ``by``, then first, second, difference, low, high, correlation,
        variance_reduction, replicates, note. The draws of a cell depend on ``seed`` and its number of replicates only.

    Raises:
        BadInput: no table of runs, or a measure that is not known for every run.

    """
    import pandas as pd

    check_runs(runs, (*by, factor))
    found = []
    for key, rows in cells(runs[runs[factor].isin([first, second])], by):
        pair = matched(rows, factor, measure)
        if len(pair.levels) < 2 or pair.values.shape[1] < 2:
            continue
        a, b = (pair.values[pair.levels.index(level)] for level in (first, second))
        result = paired(a, b, bootstrap_stream(seed, a.size), confidence)
        found.append((*key, *_row(result)))
    return pd.DataFrame(found, columns=[*by, *_COLUMNS])


def bootstrap_stream(seed: int, replicates: int) -> np.random.Generator:
    """The draws for all cells of that many replicates: what a cell says does not depend on which others there are."""
    return stream(seed, replicates, "stats.bootstrap")


_COLUMNS = (
    *("first", "second", "difference", "low", "high"),
    *("correlation", "variance_reduction", "replicates", "note"),
)


def _row(result: Paired) -> tuple[Any, ...]:
    d = result.difference
    spread = (result.correlation, result.variance_reduction)
    return (result.first, result.second, d.value, d.low, d.high, *spread, d.runs, d.note)
