"""A row a cell: how often, how fast and how well."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from teleop_sim.stats.estimate import CONFIDENCE, Estimate, student_quantile, wilson
from teleop_sim.stats.logrank import LogRank, log_rank
from teleop_sim.stats.runs import FloatArray, Measure, cells, check_runs, common_limit_s, follow_up, measured
from teleop_sim.stats.survival import NO_VARIATION, kaplan_meier, quantile, restricted_mean

if TYPE_CHECKING:
    import pandas as pd


def mean_of(values: FloatArray, confidence: float = CONFIDENCE) -> Estimate:
    """Mean of independent values with Student's t interval; one run or equal ones have none, which the note says."""
    n, mean = int(values.size), float(values.mean())
    if n < 2 or np.ptp(values) == 0.0:
        return Estimate(mean, mean, mean, n, NO_VARIATION)
    half = student_quantile(confidence, n - 1) * float(values.std(ddof=1)) / n**0.5
    return Estimate(mean, mean - half, mean + half, n)


def estimate(rows: pd.DataFrame, measure: Measure, confidence: float = CONFIDENCE) -> Estimate:
    """The measure's mean over the runs of one cell: restricted mean, share of successes (Wilson), or mean score.

    Raises:
        BadInput: a measure that the runs do not tell; completion times alone may be censored early.

    """
    if measure.kind == "time":
        return restricted_mean(*follow_up(rows), measure.limit_s, confidence)
    values = measured(rows, measure)
    if measure.kind == "success":
        return wilson(int(values.sum()), int(values.size), confidence)
    return mean_of(values, confidence)


def summary(
    runs: pd.DataFrame,
    factors: Sequence[str],
    limit_s: float | None = None,
    quantiles: Sequence[float] = (0.5, 0.9),
    confidence: float = CONFIDENCE,
) -> pd.DataFrame:
    """Everything that is asked of a cell first, a row a cell.

    Args:
        runs: a row a run, see :mod:`teleop_sim.stats.runs`.
        factors: columns that make a cell.
        limit_s: to which completion times are restricted; by default the longest that all runs were watched [s].
        quantiles: of the completion time.
        confidence: of every interval.

    Returns:
        Columns: the factors; runs, completed, failed, censored (counts); for each of completion (share), failure
        (share), mean_s (restricted mean) and q50_s, q90_s, … the value and, ending in _low and _high, its interval;
        notes.

    Raises:
        BadInput: no table of runs.

    """
    import pandas as pd

    check_runs(runs, factors)
    limit = common_limit_s(runs) if limit_s is None else limit_s
    found = []
    for key, rows in cells(runs, factors):
        row: dict[str, Any] = dict(zip(factors, key, strict=True)) | _counts(rows)
        estimates = _estimates(rows, limit, quantiles, confidence)
        for name, e in estimates.items():
            row |= {name: e.value, f"{name}_low": e.low, f"{name}_high": e.high}
        row["notes"] = "; ".join(f"{name}: {e.note}" for name, e in estimates.items() if e.note)
        found.append(row)
    return pd.DataFrame(found)


def compare_levels(runs: pd.DataFrame, factor: str) -> LogRank:
    """Log-rank test between the levels of one factor, over the rows given: the caller picks a cell.

    Raises:
        BadInput: no table of runs, one level, or no completion.

    """
    check_runs(runs, (factor,))
    return log_rank([follow_up(rows) for _, rows in cells(runs, (factor,))])


def _counts(rows: pd.DataFrame) -> dict[str, int]:
    status = rows["status"]
    return {"runs": len(rows)} | {s: int((status == s).sum()) for s in ("completed", "failed", "censored")}


def _estimates(
    rows: pd.DataFrame, limit_s: float, quantiles: Sequence[float], confidence: float
) -> dict[str, Estimate]:
    counts = _counts(rows)
    times_s, done = follow_up(rows)
    curve = kaplan_meier(times_s, done, confidence)
    return {
        "completion": wilson(counts["completed"], counts["runs"], confidence),
        "failure": wilson(counts["failed"], counts["runs"], confidence),
        "mean_s": restricted_mean(times_s, done, limit_s, confidence),
    } | {f"q{100 * q:g}_s": quantile(curve, q) for q in quantiles}
