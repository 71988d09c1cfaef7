"""Completion times of which some are censored: Kaplan-Meier, quantiles, restricted mean.

scipy.stats.ecdf estimates the same curve, and a test holds both equal. It is computed here because the numbers at risk,
which the variance of the restricted mean needs, are private there.

Not modelled: censoring that depends on the time which would have followed. Runs are left at a limit set beforehand.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from teleop_sim.stats.estimate import CONFIDENCE, Estimate, normal_quantile, refuse, student_quantile, wilson
from teleop_sim.stats.runs import BoolArray, FloatArray

NO_VARIATION = "all runs alike: the interval is a bound, not a spread"


@dataclass(frozen=True, slots=True)
class Curve:
    """Share of runs not yet completed, as steps: ``survival[i]`` holds from ``times_s[i]`` up to the next time.

    Attributes:
        times_s: distinct completion times, ascending, shape (k,) [s]. Before the first the share is 1.
        at_risk: runs not yet completed and still watched just before each time, shape (k,).
        completed: completions at each time, shape (k,).
        survival: share not yet completed from each time on, shape (k,).
        low: pointwise lower end, shape (k,).
        high: pointwise upper end, shape (k,).
        first_low: lower end before the first time, where the curve is 1.
        greenwood: Greenwood's sum of d / (Y (Y - d)), shape (k,); infinite where the curve reaches 0.
        runs: number of runs.
        watched_s: when the last run completed or was left [s]; the curve says nothing later unless it is 0.

    """

    times_s: FloatArray
    at_risk: NDArray[np.int64]
    completed: NDArray[np.int64]
    survival: FloatArray
    low: FloatArray
    high: FloatArray
    first_low: float
    greenwood: FloatArray
    runs: int
    watched_s: float


def kaplan_meier(times_s: ArrayLike, completed: ArrayLike, confidence: float = CONFIDENCE) -> Curve:
    """The product-limit curve with log-log intervals.

    Args:
        times_s: how long each run was at risk, shape (n,) [s].
        completed: whether it then completed (else it was left), shape (n,).
        confidence: of each pointwise interval.

    Runs left at the very time of a completion count as at risk. Where the log-log interval is undefined, at 1 and 0,
    Wilson's for the runs at risk stands in, so that a curve of 30 out of 30 still has a width.

    Raises:
        BadInput: no runs, shapes that differ, or a time that is negative or not finite.

    Sources: Kaplan and Meier, J. Am. Stat. Assoc. 53 (1958), 457-481; Greenwood, Reports on Public Health and Medical
    Subjects 33 (1926); log-log: Kalbfleisch and Prentice, The Statistical Analysis of Failure Time Data (1980).

    """
    times, done = _checked(times_s, completed)
    moments, events = np.unique(times[done], return_counts=True)
    at_risk = times.size - np.searchsorted(np.sort(times), moments, side="left")
    survival = np.cumprod(1.0 - events / at_risk, dtype=np.float64)
    left = at_risk - events
    safe = np.where(left > 0, left, 1)
    greenwood = np.cumsum(np.where(left > 0, events / (at_risk * safe), np.inf), dtype=np.float64)
    low, high = _log_log(survival, greenwood, normal_quantile(confidence))
    ended = survival <= 0.0
    high[ended] = [wilson(0, int(n), confidence).high for n in at_risk[ended]]
    first_low = wilson(times.size, times.size, confidence).low
    return Curve(
        moments, at_risk, events, survival, low, high, first_low, greenwood, int(times.size), float(times.max())
    )


def completed_by(curve: Curve, deadline_s: float) -> Estimate:
    """Probability of having completed by a deadline: one minus the curve, with the curve's interval.

    Raises:
        BadInput: no run was watched that long and some had not completed.

    """
    _refuse_beyond(curve, deadline_s, "deadline")
    i = int(np.searchsorted(curve.times_s, deadline_s, side="right")) - 1
    if i < 0:
        return Estimate(0.0, 0.0, 1.0 - curve.first_low, curve.runs)
    value, low, high = (1.0 - float(steps[i]) for steps in (curve.survival, curve.high, curve.low))
    return Estimate(value, low, high, curve.runs)


def quantile(curve: Curve, share: float) -> Estimate:
    """The time by which ``share`` of the runs have completed [s], with the interval of the curve.

    The first time at which the curve is at or below ``1 - share``; the interval holds all times whose pointwise
    interval contains it. Infinite, with a note, if the curve never comes down so far; a lower end of 0 says that the
    runs are too few to bound it from below.

    Raises:
        BadInput: a share that is not strictly between 0 and 1.

    Source: Brookmeyer and Crowley, Biometrics 38 (1982), 29-41, with log-log intervals.

    """
    if not 0.0 < share < 1.0:
        raise refuse("quantile", f"a share of {share}", "Give one between 0 and 1, such as 0.5 for the median.")
    level = 1.0 - share
    value, low, high = (_first_at_or_below(curve, steps, level) for steps in (curve.survival, curve.low, curve.high))
    if curve.first_low <= level:
        low = 0.0
    note = "" if np.isfinite(value) else f"beyond {curve.watched_s:g} s: fewer runs completed"
    return Estimate(value, min(low, curve.watched_s), high, curve.runs, note)


def restricted_mean(
    times_s: ArrayLike, completed: ArrayLike, limit_s: float, confidence: float = CONFIDENCE
) -> Estimate:
    """Mean of the completion time, where later or never counts ``limit_s`` [s]: the area under the curve up to it.

    The variance is the sum over completions of (area from there to the limit)^2 d / (Y (Y - d)), times m / (m - 1)
    with m the runs whose restricted time is known; the interval is Student's with m - 1 degrees of freedom, cut at 0
    and the limit. Without early censoring this is exactly the mean of the restricted times with its usual t interval.
    If all restricted times are alike (none completed, say), the interval reaches to what the mean would be if as
    large a share as Wilson's bound allows completed at once or never.

    Raises:
        BadInput: a limit not above zero, or beyond what was watched while some had not completed.

    Sources: area and variance: Klein and Moeschberger, Survival Analysis (2nd ed. 2003), eq. 4.5.1 and 4.5.2; m / (m
    - 1): Kaplan and Meier (1958). As a summary: Royston and Parmar, BMC Med. Res. Methodol. 13 (2013), 152.

    """
    times, done = _checked(times_s, completed)
    curve = kaplan_meier(times, done, confidence)
    if not 0.0 < limit_s < float("inf"):
        raise refuse("limit_s", f"{limit_s} s", "Give a finite time above zero.")
    _refuse_beyond(curve, limit_s, "limit_s")
    used = curve.times_s < limit_s
    edges = np.concatenate(([0.0], curve.times_s[used], [limit_s]))
    strips = np.diff(edges) * np.concatenate(([1.0], curve.survival[used]))
    mean = float(strips.sum())
    known = int(((done & (times < limit_s)) | (times >= limit_s)).sum())
    spread = np.unique(np.minimum(times, limit_s)[done | (times >= limit_s)]).size > 1
    if known < 2 or not spread:
        return _bound(mean, limit_s, int(times.size), confidence)
    rest = strips[::-1].cumsum()[::-1][1:]
    left = curve.at_risk[used] - curve.completed[used]
    # The term of the last run is 0: no area is left behind it.
    terms = np.where(left > 0, curve.completed[used] / (curve.at_risk[used] * np.where(left > 0, left, 1)), 0.0)
    variance = float((rest**2 * terms).sum()) * known / (known - 1)
    half = student_quantile(confidence, known - 1) * variance**0.5
    return Estimate(mean, max(0.0, mean - half), min(limit_s, mean + half), int(times.size))


def _bound(mean: float, limit_s: float, runs: int, confidence: float) -> Estimate:
    other = wilson(0, runs, confidence).high
    return Estimate(mean, mean * (1.0 - other), mean + (limit_s - mean) * other, runs, NO_VARIATION)


def _log_log(survival: FloatArray, greenwood: FloatArray, z: float) -> tuple[FloatArray, FloatArray]:
    inside = (survival > 0.0) & (survival < 1.0)
    base = np.where(inside, survival, 0.5)
    power = np.exp(z * np.sqrt(np.where(inside, greenwood, 0.0)) / np.log(base))
    # The logarithm is negative: the smaller power gives the upper end.
    return np.where(inside, base ** (1.0 / power), survival), np.where(inside, base**power, survival)


def _first_at_or_below(curve: Curve, steps: FloatArray, level: float) -> float:
    # Products of fractions miss 1/2 by rounding: 1e-12 is far below one run in any sample.
    below = np.nonzero(steps <= level + 1e-12)[0]
    return float(curve.times_s[below[0]]) if below.size else float("inf")


def _refuse_beyond(curve: Curve, at_s: float, where: str) -> None:
    open_ended = curve.survival.size == 0 or curve.survival[-1] > 0.0
    if at_s > curve.watched_s and open_ended:
        what = f"{at_s:g} s is beyond the {curve.watched_s:g} s that runs were watched"
        raise refuse(where, what, f"Choose at most {curve.watched_s:g} s.")


def _checked(times_s: ArrayLike, completed: ArrayLike) -> tuple[FloatArray, BoolArray]:
    times, done = np.asarray(times_s, dtype=np.float64), np.asarray(completed, dtype=np.bool_)
    if times.ndim != 1 or times.shape != done.shape or not times.size:
        raise refuse("times_s", f"shapes {times.shape} and {done.shape}", "Give a time and a flag for each run.")
    if not (np.isfinite(times) & (times >= 0.0)).all():
        raise refuse("times_s", "a time that is negative or not finite", "Give zero or more seconds.")
    return times, done
