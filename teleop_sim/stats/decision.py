"""The decision map: for each link the level that is best, by how much, and how sure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from teleop_sim.stats.bootstrap import mean_interval, resample_weights
from teleop_sim.stats.estimate import CONFIDENCE, refuse
from teleop_sim.stats.paired import Matched, bootstrap_stream, matched
from teleop_sim.stats.runs import FloatArray, Measure, cells, check_runs

if TYPE_CHECKING:
    import pandas as pd

FEWEST = 6
"""Replicates below which nothing is called clear: a two-sided sign test of 5 cannot reach 5 % (2 / 2^5 = 6.3 %)."""


@dataclass(frozen=True, slots=True)
class Choice:
    """The best level of one cell.

    Attributes:
        best: level with the best mean; of equals the one that came first.
        value: its mean.
        second: the next best.
        second_value: its mean.
        margin: by how much the best is better, zero or more whatever the measure.
        low: lower end of the margin's paired interval (BCa and t).
        high: upper end.
        best_share: share of resamples in which it is best, equals sharing: near 1 if sure, near 1/k of k equals.
        verdict: ``clear``: better than each other; ``tie``: ``contenders`` cannot be told from it; ``too few runs``.
        contenders: levels that are not clearly worse, joined by commas.
        replicates: that all levels have in common.
        dropped: runs left out because another level lacks their replicate.

    """

    best: Any
    value: float
    second: Any
    second_value: float
    margin: float
    low: float
    high: float
    best_share: float
    verdict: str
    contenders: str
    replicates: int
    dropped: int


def choose(pairs: Matched, sign: int, rng: np.random.Generator, confidence: float = CONFIDENCE) -> Choice:
    """The best of the levels of one cell.

    Args:
        pairs: values of the measure, by level and replicate.
        sign: +1 if more is better, -1 if less.
        rng: for the resamples, which all levels share.
        confidence: of the margin's interval, and of the verdict as a whole.

    The verdict compares the best with each other level at 1 - (1 - confidence) / (k - 1) (Bonferroni), so that the
    chance of a clear verdict between equals stays below 1 - confidence however many levels there are. The margin's
    interval is for the pair as chosen: among near-equals the seemingly best is partly the luckiest, and the margin is
    then too large.

    Raises:
        BadInput: fewer than two levels or two shared replicates.

    """
    levels, replicates = pairs.values.shape
    if levels < 2 or replicates < 2:
        raise refuse("decision", f"{levels} levels, {replicates} shared replicates", "Give two or more of each.")
    gains = sign * pairs.values
    # Stable: of equals the first stays first.
    order = np.argsort(-gains.mean(axis=1), kind="stable")
    best, second = int(order[0]), int(order[1])
    weights = resample_weights(replicates, rng)
    margin, low, high = (float(x) for x in mean_interval(gains[best] - gains[second], weights, confidence))
    others = np.delete(np.arange(levels), best)
    strict = 1.0 - (1.0 - confidence) / (levels - 1)
    _, lows, _ = mean_interval(gains[best] - gains[others], weights, strict)
    near = [str(pairs.levels[i]) for i, end in zip(others.tolist(), lows.tolist(), strict=True) if not end > 0.0]
    share = float(_best_shares(gains, weights)[best])
    verdict = "too few runs" if replicates < FEWEST else "tie" if near else "clear"
    means = pairs.values.mean(axis=1)
    first, next_best = pairs.levels[best], pairs.levels[second]
    sure = (share, verdict, ", ".join(near))
    return Choice(
        first, float(means[best]), next_best, float(means[second]), margin, low, high, *sure, replicates, pairs.dropped
    )


def decision_map(
    runs: pd.DataFrame,
    link: Sequence[str],
    level: str,
    measure: Measure,
    seed: int = 0,
    confidence: float = CONFIDENCE,
) -> pd.DataFrame:
    """The best level for each link.

    Args:
        runs: a row a run, see :mod:`teleop_sim.stats.runs`.
        link: columns that make a cell of the map, such as uplink and latency.
        level: column of the choice.
        measure: what a level is judged by.
        seed: of the resamples.
        confidence: see :func:`choose`.

    Returns:
        A row a cell: the columns ``link``, then the fields of :class:`Choice`. Cells with one level or fewer than two
        shared replicates are left out.

    Raises:
        BadInput: no table of runs, other factors vary within a cell, or a measure that is not known for every run.

    """
    import pandas as pd

    check_runs(runs, (*link, level))
    found: list[dict[str, Any]] = []
    for key, rows in cells(runs, link):
        pairs = matched(rows, level, measure)
        if min(pairs.values.shape[0], pairs.values.shape[-1]) >= 2:
            choice = choose(pairs, measure.sign, bootstrap_stream(seed, pairs.values.shape[1]), confidence)
            found.append(dict(zip(link, key, strict=True)) | asdict(choice))
    return pd.DataFrame(found, columns=[*link, *Choice.__dataclass_fields__])


def _best_shares(gains: FloatArray, weights: FloatArray) -> FloatArray:
    """How often each level is best among resampled means, shape (k,); equals share the resample."""
    means = gains @ weights.T
    # Equal numbers weighted in another order differ in the last bits.
    top = means >= means.max(axis=0) - 1e-12 * np.abs(gains).max(initial=0.0)
    shares: FloatArray = (top / top.sum(axis=0)).mean(axis=1)
    return shares
