"""Bootstrap means and differences under common random numbers."""

import math

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from teleop_sim.core.errors import BadInput
from teleop_sim.stats.bootstrap import bca_mean, mean_interval, resample_weights
from teleop_sim.stats.paired import differences, matched, paired
from teleop_sim.stats.runs import Measure


def test_bca_equals_scipys_up_to_the_resamples():
    values = np.random.default_rng(1).exponential(1.0, 30)
    _, low, high = bca_mean(values, resample_weights(30, np.random.default_rng(2), 20_000), expand=False)
    theirs = stats.bootstrap(
        (values,), np.mean, n_resamples=20_000, method="BCa", rng=np.random.default_rng(3)
    ).confidence_interval
    # An end at probability 0.025 of 20,000 resamples errs by sqrt(0.025 * 0.975 / 20,000) / density = 0.019 standard
    # errors; two ends independently drawn, four standard deviations: 0.11 standard errors of the mean.
    step = 0.11 * values.std() / math.sqrt(30)
    assert (float(low), float(high)) == pytest.approx((theirs.low, theirs.high), abs=step)


def test_expanded_ends_are_students_where_the_means_are_normal():
    values = stats.norm.ppf((np.arange(40) + 0.5) / 40)
    mean, low, high = bca_mean(values, resample_weights(40, np.random.default_rng(4), 100_000))
    theirs = stats.ttest_1samp(values, 0.0).confidence_interval(0.95)
    assert float(mean) == pytest.approx(0.0, abs=1e-12)
    # Monte-Carlo error of an end: 0.008 standard errors at 100,000; four of them.
    step = 0.035 * values.std() / math.sqrt(40)
    assert (float(low), float(high)) == pytest.approx((theirs.low, theirs.high), abs=step)


# E[min(X, 2)] for X exponential of mean 1, less the same of mean 0.8.
CLIPPED = 1.0 - math.exp(-2.0) - 0.8 * (1.0 - math.exp(-2.5))
# A fall in 15 % of the runs costs 1,100 s less the work of 300 e^(0.2 Z) s; otherwise 60 s are saved.
FALLS = 0.15 * (1100.0 - 300.0 * math.exp(0.02)) - 0.85 * 60.0


def clipped(rng, n):
    """Two restricted times: in 7 of 10 replicates the same luck, else their own. Many small differences, few large."""
    luck = rng.exponential(1.0, (1000, n))
    other = np.where(rng.random((1000, n)) < 0.7, luck, rng.exponential(1.0, (1000, n)))
    return np.minimum(luck, 2.0) - np.minimum(0.8 * other, 2.0)


def flags(rng, n):
    return (rng.random((1000, n)) < 0.8).astype(float) - (rng.random((1000, n)) < 0.7)


def falls(rng, n):
    cost = 1100.0 - 300.0 * np.exp(0.2 * rng.standard_normal((1000, n)))
    return np.where(rng.random((1000, n)) < 0.15, cost, -60.0 + 10.0 * rng.standard_normal((1000, n)))


def hits(draw, truth, n, interval):
    rng = np.random.default_rng(n)
    # One set of weights serves all experiments: what it adds to an end is under 0.4 % of probability.
    _, low, high = interval(draw(rng, n), resample_weights(n, rng))
    return ((low <= truth) & (truth <= high)).tolist()


@pytest.mark.parametrize(
    ("draw", "truth", "n"),
    [
        (lambda rng, n: rng.standard_normal((1000, n)), 0.0, 20),
        (lambda rng, n: rng.standard_normal((1000, n)), 0.0, 50),
        (lambda rng, n: rng.exponential(1.0, (1000, n)), 1.0, 30),
        (clipped, CLIPPED, 30),
        (clipped, CLIPPED, 50),
        (flags, 0.1, 20),
        (flags, 0.1, 50),
    ],
)
def test_means_of_differences_cover(draw, truth, n, covers):
    covers(hits(draw, truth, n, mean_interval))


def test_bca_alone_covers_only_where_the_skewness_is_real(covers):
    # Why mean_interval exists: docs/statistics.md gives 85 %; 4 standard errors of 1,000 are 5 %.
    covers(hits(lambda rng, n: rng.standard_normal((1000, n)), 0.0, 50, bca_mean))
    assert sum(hits(clipped, CLIPPED, 20, bca_mean)) < 900


@pytest.mark.parametrize("n", [20, 30, 50, 100])
def test_a_few_falls_make_the_interval_wide_never_short(n):
    # 95.4 to 98.2 % in docs/statistics.md: the price of covering the other shapes.
    assert sum(hits(falls, FALLS, n, mean_interval)) >= 930


def test_weights_are_whole_counts_that_sum_to_one():
    weights = resample_weights(7, np.random.default_rng(0), 500)
    assert weights.sum(axis=1) == pytest.approx(np.ones(500))
    assert (7 * weights) == pytest.approx(np.rint(7 * weights))
    # A count has variance n * 1/n * (1 - 1/n) = 6/7; 3,500 of them: 4 sigma of the variance is under 0.12.
    assert (7 * weights).var() == pytest.approx(6 / 7, abs=0.12)


def test_equal_values_have_no_width_and_many_samples_go_at_once():
    weights = resample_weights(5, np.random.default_rng(0))
    values = np.array([[0.1] * 5, [1.0, 2.0, 3.0, 4.0, 5.0]])
    mean, low, high = bca_mean(values, weights)
    assert (mean[0], low[0], high[0]) == (pytest.approx(0.1),) * 3
    one = bca_mean(values[1], weights)
    assert (float(one[0]), float(one[1]), float(one[2])) == (mean[1], low[1], high[1])
    assert low[1] < 3.0 < high[1]


def test_variance_reduction_is_that_of_the_model():
    # X + A and X + B with Var X = 9, Var A = Var B = 1: (10 + 10) / 2 = 10, correlation 0.9.
    rng = np.random.default_rng(5)
    x, a, b = 3.0 * rng.standard_normal(4000), rng.standard_normal(4000), rng.standard_normal(4000)
    found = paired(x + a, x + b + 0.5, np.random.default_rng(6), 0.95)
    # Relative standard error of a variance of 4,000: sqrt(2 / 4,000) = 2.2 %; four of a ratio of two: 13 %.
    assert found.variance_reduction == pytest.approx(10.0, rel=0.13)
    assert found.correlation == pytest.approx(0.9, abs=0.02)
    assert found.difference.low < 0.5 < found.difference.high


def test_what_never_varies_is_said():
    found = paired([1.0, 2.0, 3.0], [2.0, 3.0, 4.0], np.random.default_rng(0))
    assert found.difference.note == "the same in every replicate"
    assert (found.difference.low, found.difference.high, found.variance_reduction) == (1.0, 1.0, math.inf)
    flat = paired([1.0, 1.0], [1.0, 1.0], np.random.default_rng(0))
    assert math.isnan(flat.variance_reduction)
    assert math.isnan(flat.correlation)


def runs(replicates, levels=("off", "full"), links=("64bps", "4kbps")):
    """Times of 100 r + 50 for off and + 10 for full, one link twice as slow."""
    own_s = {"off": 50.0, "full": 10.0}
    rows = [
        (r, "completed", (100.0 * r + own_s[v]) * (2.0 if k == "64bps" else 1.0), 4.0, 2000.0, v, k)
        for r in replicates
        for v in levels
        for k in links
    ]
    return pd.DataFrame(rows, columns=["replicate", "status", "time_s", "score", "limit_s", "autonomy", "uplink"])


def test_differences_pair_by_replicate_whatever_the_order_of_rows():
    shuffled = runs(range(8)).sample(frac=1.0, random_state=1)
    found = differences(shuffled, "autonomy", "off", "full", Measure("time", 2000.0), by=["uplink"]).set_index("uplink")
    assert found["difference"].to_dict() == {"64bps": -80.0, "4kbps": -40.0}
    assert (found["low"] == found["difference"]).all()
    assert (found["replicates"] == 8).all()


def test_only_shared_replicates_count_and_the_rest_is_named():
    table = runs(range(8), links=("4kbps",)).drop(index=[0, 3])
    found = matched(table, "autonomy", Measure("time", 2000.0))
    assert found.levels == ("full", "off")
    assert found.values.shape == (2, 6)
    assert found.dropped == 2


def test_a_cell_does_not_depend_on_which_others_are_there():
    rng = np.random.default_rng(9)
    table = runs(range(30))
    table["time_s"] += rng.normal(0.0, 20.0, len(table)).round() + 100.0
    both = differences(table, "autonomy", "off", "full", Measure("time", 2000.0), by=["uplink"], seed=3)
    alone = differences(
        table[table["uplink"] == "64bps"], "autonomy", "off", "full", Measure("time", 2000.0), by=["uplink"], seed=3
    )
    pd.testing.assert_frame_equal(both[both["uplink"] == "64bps"].reset_index(drop=True), alone)


def test_a_factor_that_was_forgotten_is_noticed():
    with pytest.raises(BadInput, match="repeat a replicate"):
        differences(runs(range(3)), "autonomy", "off", "full", Measure("time", 2000.0))


@pytest.mark.parametrize("values", [([1.0], [1.0]), ([1.0, 2.0], [1.0])])
def test_what_makes_no_pairs_is_refused(values):
    with pytest.raises(BadInput):
        paired(*values, np.random.default_rng(0))
