"""Do completion curves differ? The log-rank test for two or more groups."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtrc

from teleop_sim.stats.estimate import refuse
from teleop_sim.stats.runs import BoolArray, FloatArray


@dataclass(frozen=True, slots=True)
class LogRank:
    """Result of a log-rank test.

    Attributes:
        chi2: test statistic, with ``freedom`` degrees of freedom.
        freedom: groups less one.
        p_value: chance of a statistic as large if all groups complete alike; exact for many runs only.
        observed: completions in each group.
        expected: completions that each would have if all were alike.

    """

    chi2: float
    freedom: int
    p_value: float
    observed: tuple[float, ...]
    expected: tuple[float, ...]


def log_rank(groups: Sequence[tuple[ArrayLike, ArrayLike]]) -> LogRank:
    """Test whether groups complete at the same rate at all times.

    Args:
        groups: for each ``(times_s, completed)`` as :func:`teleop_sim.stats.survival.kaplan_meier` takes them.

    The groups are taken as independent. Under common random numbers they are not: the test then is conservative where
    the runs of a replicate go together, and :mod:`teleop_sim.stats.paired` sees more.

    Raises:
        BadInput: fewer than two groups, an empty one, or no completion at all.

    Sources: Mantel, Cancer Chemother. Rep. 50 (1966), 163-170; k groups: Kalbfleisch and Prentice (1980), section 1.4.

    """
    arrays = [(np.asarray(t, dtype=np.float64), np.asarray(d, dtype=np.bool_)) for t, d in groups]
    if len(arrays) < 2 or any(t.size == 0 or t.shape != d.shape for t, d in arrays):
        raise refuse("log_rank", f"{len(arrays)} groups", "Give two or more groups with a time and a flag a run.")
    moments = np.unique(np.concatenate([t[d] for t, d in arrays]))
    if not moments.size:
        raise refuse("log_rank", "no run completed", "Compare scores, or watch longer.")
    at_risk, events = (np.stack(rows) for rows in zip(*[_counts(t, d, moments) for t, d in arrays], strict=True))
    total, completed = at_risk.sum(axis=0), events.sum(axis=0)
    shares = at_risk / total
    expected = (shares * completed).sum(axis=1)
    tied = completed * (total - completed) / np.maximum(total - 1, 1)
    covariance = np.diag((shares * tied).sum(axis=1)) - (shares * tied) @ shares.T
    observed = events.sum(axis=1).astype(np.float64)
    # One group is what the others leave: the matrix has rank groups - 1.
    excess = (observed - expected)[:-1]
    chi2 = float(excess @ np.linalg.pinv(covariance[:-1, :-1]) @ excess)
    freedom = len(arrays) - 1
    return LogRank(chi2, freedom, float(chdtrc(freedom, chi2)), tuple(observed.tolist()), tuple(expected.tolist()))


def _counts(times: FloatArray, done: BoolArray, moments: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    ordered, ends = np.sort(times), np.sort(times[done])
    at_risk = times.size - np.searchsorted(ordered, moments, side="left")
    return at_risk, np.searchsorted(ends, moments, side="right") - np.searchsorted(ends, moments, side="left")
