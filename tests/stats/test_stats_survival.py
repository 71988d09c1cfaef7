"""Completion curves against a textbook, against scipy, and against known truths."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from teleop_sim.core.errors import BadInput
from teleop_sim.stats.logrank import log_rank
from teleop_sim.stats.survival import completed_by, kaplan_meier, quantile, restricted_mean

# Weeks in remission of 21 + 21 leukaemia patients: Freireich et al., Blood 21 (1963), 699-716, as worked in Kleinbaum
# and Klein, Survival Analysis (3rd ed. 2012), chapters 1 and 2, and Cox and Oakes, Analysis of Survival Data (1984).
DRUG = (
    [6, 6, 6, 7, 10, 13, 16, 22, 23, 6, 9, 10, 11, 17, 19, 20, 25, 32, 32, 34, 35],
    [True] * 9 + [False] * 12,
)
PLACEBO = ([1, 1, 2, 2, 3, 4, 4, 5, 5, 8, 8, 8, 8, 11, 11, 12, 12, 15, 17, 22, 23], [True] * 21)


def test_the_curve_is_the_textbooks():
    curve = kaplan_meier(*DRUG)
    assert curve.times_s.tolist() == [6, 7, 10, 13, 16, 22, 23]
    assert curve.at_risk.tolist() == [21, 17, 15, 12, 11, 7, 6]
    assert curve.completed.tolist() == [3, 1, 1, 1, 1, 1, 1]
    # Kleinbaum and Klein, table 2.2 (four digits).
    printed = [0.8571, 0.8067, 0.7529, 0.6902, 0.6275, 0.5378, 0.4482]
    assert curve.survival.tolist() == pytest.approx(printed, abs=5e-5)


def test_the_median_of_both_groups_is_the_textbooks():
    # Kleinbaum and Klein, section 2.III: 23 and 8 weeks.
    assert quantile(kaplan_meier(*DRUG), 0.5).value == 23.0
    assert quantile(kaplan_meier(*PLACEBO), 0.5).value == 8.0


def test_the_log_rank_statistic_is_the_textbooks():
    found = log_rank([DRUG, PLACEBO])
    # Kleinbaum and Klein, section 2.IV: chi2 16.79; expected 19.25 and 10.75.
    assert found.chi2 == pytest.approx(16.79, abs=5e-3)
    assert found.expected == pytest.approx((19.25, 10.75), abs=5e-3)
    assert found.observed == (9.0, 21.0)
    assert found.freedom == 1


def test_the_restricted_mean_is_the_textbooks():
    found = restricted_mean(*DRUG, 35.0)
    assert found.value == pytest.approx(23.287, abs=5e-4)
    # Greenwood's standard error by hand; ours has m / (m - 1), m = 9 completed and 1 at week 35.
    at_risk, completed = [21, 17, 15, 12, 11, 7, 6], [3, 1, 1, 1, 1, 1, 1]
    times = [6, 7, 10, 13, 16, 22, 23, 35]
    survival = np.cumprod([1 - d / y for d, y in zip(completed, at_risk, strict=True)])
    areas = [sum(survival[j] * (times[j + 1] - times[j]) for j in range(i, 7)) for i in range(7)]
    variance = sum(a * a * d / (y * (y - d)) for a, d, y in zip(areas, completed, at_risk, strict=True))
    assert math.sqrt(variance) == pytest.approx(2.827, abs=5e-4)
    assert found.high - found.value == pytest.approx(2.2622 * math.sqrt(variance * 10 / 9), rel=1e-4)


def experiment(rng, n=40):
    """Rounded, so that there are ties, and censored both early and at a limit."""
    time_s = np.round(rng.exponential(300.0, n), -1)
    limit_s = np.where(rng.random(n) < 0.3, np.round(rng.uniform(100, 600, n), -1), 600.0)
    return np.minimum(time_s, limit_s), time_s <= limit_s


@pytest.mark.filterwarnings("ignore:The confidence interval is undefined")
@pytest.mark.parametrize("seed", range(20))
def test_curve_and_intervals_equal_scipys(seed):
    times_s, done = experiment(np.random.default_rng(seed))
    ours = kaplan_meier(times_s, done)
    theirs = stats.ecdf(stats.CensoredData(uncensored=times_s[done], right=times_s[~done])).sf
    assert ours.survival == pytest.approx(theirs.evaluate(ours.times_s), abs=1e-12)
    band = theirs.confidence_interval(method="log-log")
    inside = ours.survival > 0.0
    assert ours.low[inside] == pytest.approx(band.low.evaluate(ours.times_s[inside]), abs=1e-12)
    assert ours.high[inside] == pytest.approx(band.high.evaluate(ours.times_s[inside]), abs=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_log_rank_of_two_equals_scipys(seed):
    rng = np.random.default_rng(seed)
    groups = [experiment(rng, 25), experiment(rng, 40)]
    data = [stats.CensoredData(uncensored=t[d], right=t[~d]) for t, d in groups]
    theirs, ours = stats.logrank(*data), log_rank(groups)
    assert ours.chi2 == pytest.approx(theirs.statistic**2, rel=1e-9)
    assert ours.p_value == pytest.approx(theirs.pvalue, rel=1e-6)


def test_log_rank_of_three_does_not_depend_on_their_order_and_rejects_5_of_100_equals():
    rng = np.random.default_rng(4)
    first = [experiment(rng) for _ in range(3)]
    assert log_rank(first).chi2 == pytest.approx(log_rank(first[::-1]).chi2, rel=1e-9)
    rejected = sum(log_rank([experiment(rng) for _ in range(3)]).p_value < 0.05 for _ in range(1000))
    # Binomial(1000, 0.05): 4 standard deviations are 28.
    assert abs(rejected - 50) <= 28


def test_log_rank_of_equal_groups_is_nought_and_nothing_to_compare_is_refused():
    assert log_rank([DRUG, DRUG]).chi2 == pytest.approx(0.0, abs=1e-12)
    for groups in ([DRUG], [DRUG, ([], [])], [([5.0], [False]), ([5.0], [False])]):
        with pytest.raises(BadInput):
            log_rank(groups)


@given(st.integers(0, 10_000), st.floats(50.0, 600.0))
def test_the_restricted_mean_is_the_integral_of_the_curve(seed, limit_s):
    times_s, done = experiment(np.random.default_rng(seed))
    curve = kaplan_meier(times_s, done)
    if limit_s > curve.watched_s:
        return
    middles = (np.arange(100_000) + 0.5) * limit_s / 100_000
    steps = np.concatenate(([1.0], curve.survival))[np.searchsorted(curve.times_s, middles, side="right")]
    # The rule errs by less than one strip a jump, and jumps sum to at most 1.
    assert restricted_mean(times_s, done, limit_s).value == pytest.approx(steps.mean() * limit_s, abs=limit_s / 1e5)


@given(st.lists(st.floats(0.0, 1000.0), min_size=2, max_size=30), st.floats(1.0, 900.0))
def test_with_all_runs_watched_it_is_the_mean_and_its_t_interval(times_s, limit_s):
    restricted = np.minimum(times_s, limit_s)
    found = restricted_mean(np.minimum(times_s, 900.0), np.array(times_s) <= 900.0, limit_s)
    assert found.value == pytest.approx(restricted.mean(), rel=1e-9, abs=1e-9)
    if found.note or np.ptp(restricted) < 1e-6:
        return
    theirs = stats.ttest_1samp(restricted, 0.0).confidence_interval(0.95)
    # Sums of squares lose half of the digits where all times are nearly alike.
    assert found.low == pytest.approx(max(0.0, theirs.low), rel=1e-5, abs=1e-5 * limit_s)
    assert found.high == pytest.approx(min(limit_s, theirs.high), rel=1e-5, abs=1e-5 * limit_s)


def lognormal(rng, n):
    return 300.0 * np.exp(0.6 * rng.standard_normal(n))


def never_in_30(rng, n):
    """30 % never complete: a robot that falls."""
    return np.where(rng.random(n) < 0.3, np.inf, 300.0 * np.exp(0.3 * rng.standard_normal(n)))


def restricted_lognormal_mean(limit_s, sigma):
    """E[min(T, limit)] of 300 exp(sigma Z), by its closed form."""
    d = math.log(limit_s / 300.0) / sigma
    return 300.0 * math.exp(sigma**2 / 2) * stats.norm.cdf(d - sigma) + limit_s * stats.norm.sf(d)


CASES = {
    # draw, restricted mean to 600 s, median, share completed by 400 s
    "lognormal": (
        *(lognormal, restricted_lognormal_mean(600.0, 0.6), 300.0),
        stats.norm.cdf(math.log(400 / 300) / 0.6),
    ),
    "30 % never": (
        *(never_in_30, 0.7 * restricted_lognormal_mean(600.0, 0.3) + 0.3 * 600.0),
        300.0 * math.exp(0.3 * stats.norm.ppf(0.5 / 0.7)),
        0.7 * stats.norm.cdf(math.log(400 / 300) / 0.3),
    ),
}


def watched(time_s, censoring, rng):
    if censoring == "at the limit":
        limit_s = np.full(time_s.size, 600.0)
    else:
        limit_s = np.where(rng.random(time_s.size) < 0.25, rng.uniform(200.0, 600.0, time_s.size), 700.0)
    return np.minimum(time_s, limit_s), time_s <= limit_s


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize(("n", "censoring"), [(30, "at the limit"), (50, "at the limit"), (50, "early too")])
def test_intervals_cover_the_truth(case, censoring, n, covers):
    draw, mean_s, median_s, share = CASES[case]
    rng = np.random.default_rng(n)
    hits = []
    for _ in range(1000):
        times_s, done = watched(draw(rng, n), censoring, rng)
        curve = kaplan_meier(times_s, done)
        found = (restricted_mean(times_s, done, 600.0), quantile(curve, 0.5), completed_by(curve, 400.0))
        hits.append([e.low <= truth <= e.high for e, truth in zip(found, (mean_s, median_s, share), strict=True)])
    for one in zip(*hits, strict=True):
        covers(one)


def test_a_quantile_that_was_not_reached_says_so():
    found = quantile(kaplan_meier([100.0, 200.0, 600.0, 600.0, 600.0], [True, True, False, False, False]), 0.9)
    assert found.value == math.inf
    assert found.high == math.inf
    assert found.note == "beyond 600 s: fewer runs completed"
    assert found.low <= 600.0


def test_too_few_runs_bound_a_low_quantile_from_above_only():
    # Wilson: of 5 out of 5, at least 57 % are sure; nothing says that 10 % do not complete at once.
    found = quantile(kaplan_meier([100.0, 110.0, 120.0, 130.0, 140.0], [True] * 5), 0.1)
    assert (found.value, found.low) == (100.0, 0.0)


def test_no_completion_leaves_a_bound_and_a_note():
    found = restricted_mean([600.0] * 20, [False] * 20, 600.0)
    assert (found.value, found.high) == (600.0, 600.0)
    # Newcombe's 0 of 20: up to 16.11 % might complete, at best at once.
    assert found.low == pytest.approx(600.0 * (1 - 0.1611), abs=0.05)
    assert "alike" in found.note
    curve = kaplan_meier([600.0] * 20, [False] * 20)
    assert curve.times_s.size == 0
    assert completed_by(curve, 600.0).high == pytest.approx(0.1611, abs=5e-5)


def test_the_curve_ends_with_a_width_where_all_or_none_are_left():
    curve = kaplan_meier([1.0, 2.0, 3.0, 4.0], [True] * 4)
    assert curve.survival[-1] == 0.0
    assert 0.0 < curve.high[-1] < 1.0
    assert completed_by(curve, 9.0).value == 1.0
    assert completed_by(curve, 0.5).low == 0.0
    assert restricted_mean([1.0, 2.0, 3.0, 4.0], [True] * 4, 9.0).value == pytest.approx(2.5)


def test_one_wild_share_never_leaves_its_bounds():
    for seed in range(50):
        times_s, done = experiment(np.random.default_rng(seed), 6)
        curve = kaplan_meier(times_s, done)
        assert (curve.low <= curve.survival + 1e-12).all()
        assert (curve.survival <= curve.high + 1e-12).all()
        assert (curve.low >= 0.0).all()
        assert (curve.high <= 1.0).all()


@pytest.mark.parametrize(
    "call",
    [
        lambda: kaplan_meier([], []),
        lambda: kaplan_meier([1.0, 2.0], [True]),
        lambda: kaplan_meier([-1.0], [True]),
        lambda: kaplan_meier([math.inf], [False]),
        lambda: restricted_mean([10.0, 20.0], [True, False], 30.0),
        lambda: restricted_mean([10.0, 20.0], [True, False], 0.0),
        lambda: completed_by(kaplan_meier([10.0, 20.0], [True, False]), 30.0),
        lambda: quantile(kaplan_meier([10.0], [True]), 1.0),
    ],
)
def test_what_the_runs_cannot_tell_is_refused(call):
    with pytest.raises(BadInput):
        call()
