"""Wilson's interval and the checks on tables of runs."""

import pickle

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom, binomtest

from teleop_sim.core.errors import BadInput, UnknownName
from teleop_sim.stats.estimate import student_quantile, wilson
from teleop_sim.stats.runs import Measure, cells, check_runs, common_limit_s, follow_up, measured


@pytest.mark.parametrize(
    ("successes", "runs", "low", "high"),
    # Newcombe, Statist. Med. 17 (1998), 857-872, Table I, method 3.
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_wilson_gives_newcombes_figures(successes, runs, low, high):
    found = wilson(successes, runs)
    assert (found.low, found.high) == pytest.approx((low, high), abs=5e-5)


@pytest.mark.parametrize("confidence", [0.8, 0.95, 0.99])
def test_wilson_equals_scipys_for_every_count(confidence):
    for k in range(31):
        theirs = binomtest(k, 30).proportion_ci(confidence, method="wilson")
        ours = wilson(k, 30, confidence)
        assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high), abs=1e-12)


@pytest.mark.parametrize("n", [20, 30, 50, 100, 200])
def test_wilson_covers_shares_drawn_at_random(n, covers):
    rng = np.random.default_rng(n)
    p = rng.random(1000)
    found = [wilson(int(k), n) for k in rng.binomial(n, p)]
    covers(e.low <= q <= e.high for e, q in zip(found, p, strict=True))


@pytest.mark.parametrize(("p", "n"), [(0.1, 20), (0.5, 30), (0.8, 50), (0.05, 50), (0.5, 100), (0.9, 200), (0.3, 200)])
def test_wilson_covers_a_fixed_share(p, n, covers):
    found = [wilson(int(k), n) for k in np.random.default_rng(11).binomial(n, p, 1000)]
    covers(e.low <= p <= e.high for e in found)


def test_exact_coverage_of_wilson_swings_with_the_share_round_its_level():
    # docs/statistics.md names these figures: counts are whole, so no interval covers every share alike.
    n, ends = 50, [wilson(k, 50) for k in range(51)]
    exact = {
        p: sum(binom.pmf(k, n, p) for k, e in enumerate(ends) if e.low <= p <= e.high) for p in (0.02, 0.1, 0.2, 0.5)
    }
    assert exact == pytest.approx({0.02: 0.922, 0.1: 0.970, 0.2: 0.951, 0.5: 0.935}, abs=5e-4)


def test_a_t_quantile_of_the_tables():
    # Any table of Student's t: 9 degrees of freedom, two-sided 95 %.
    assert student_quantile(0.95, 9) == pytest.approx(2.262, abs=5e-4)


@pytest.mark.parametrize("call", [lambda: wilson(3, 2), lambda: wilson(0, 0), lambda: wilson(1, 2, 1.0)])
def test_what_is_no_share_is_refused(call):
    with pytest.raises(BadInput) as caught:
        call()
    assert pickle.loads(pickle.dumps(caught.value)).problems == caught.value.problems


def table(**changes):
    rows = {
        "replicate": [0, 1, 2, 3],
        "status": ["completed", "failed", "censored", "completed"],
        "time_s": [100.0, 50.0, 600.0, 550.0],
        "score": [4.0, 1.0, 3.0, 4.0],
        "limit_s": [600.0] * 4,
        "level": ["full"] * 4,
    }
    return pd.DataFrame(rows | changes)


def test_a_failed_run_is_at_risk_until_its_limit_and_never_completes():
    times_s, done = follow_up(table())
    assert times_s.tolist() == [100.0, 600.0, 600.0, 550.0]
    assert done.tolist() == [True, False, False, True]


def test_measures_of_each_run():
    assert measured(table(), Measure("time", 500.0)).tolist() == [100.0, 500.0, 500.0, 500.0]
    assert measured(table(), Measure("success", 560.0)).tolist() == [1.0, 0.0, 0.0, 1.0]
    assert measured(table(), Measure("success")).tolist() == [1.0, 0.0, 0.0, 1.0]
    assert measured(table(), Measure("score")).tolist() == [4.0, 1.0, 3.0, 4.0]
    assert common_limit_s(table()) == 600.0


def test_a_measure_beyond_what_was_watched_says_how_far_it_may_go():
    for kind in ("time", "success"):
        with pytest.raises(BadInput, match=r"1 of 4 runs: left before 700 s\n.*at most 600 s"):
            measured(table(), Measure(kind, 700.0))
    with pytest.raises(BadInput, match="2 of 4 runs: no score"):
        measured(table(score=[1.0, np.nan, np.nan, 2.0]), Measure("score"))


def test_a_failed_run_is_known_for_any_limit():
    assert measured(table().query("status == 'failed'"), Measure("time", 5000.0)).tolist() == [5000.0]


@pytest.mark.parametrize("make", [lambda: Measure("time"), lambda: Measure("success", 0.0)])
def test_a_limit_must_be_a_time(make):
    with pytest.raises(BadInput, match="above zero"):
        make()


def test_an_unknown_measure_is_named():
    with pytest.raises(UnknownName, match="Did you mean 'time'"):
        Measure("tme", 1.0)


def test_a_table_with_everything_wrong_names_everything():
    wrong = table(status=["done"] * 4, time_s=[-1.0, np.nan, 1.0, np.inf], replicate=[0, 0, 1, 2])
    with pytest.raises(BadInput) as caught:
        check_runs(wrong, ("level",))
    assert [p.where for p in caught.value.problems] == ["runs: status", "runs: time_s", "runs"]
    with pytest.raises(BadInput, match="no column 'uplink'"):
        check_runs(table(), ("uplink",))
    with pytest.raises(BadInput, match="no rows"):
        check_runs(table().head(0))


def test_cells_keep_the_order_of_the_table():
    rows = table(level=["off", "full", "off", "low"])
    assert [(key, len(found)) for key, found in cells(rows, ["level"])] == [
        (("off",), 2),
        (("full",), 1),
        (("low",), 1),
    ]
    assert [key for key, _ in cells(rows, [])] == [()]
