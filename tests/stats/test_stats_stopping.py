"""Runs enough: looks, width, and what looking again and again costs in coverage."""

import math
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from teleop_sim.core.errors import BadInput
from teleop_sim.stats.estimate import Estimate
from teleop_sim.stats.runs import Measure
from teleop_sim.stats.stopping import StopRule, looks, narrow, progress
from teleop_sim.stats.survival import restricted_mean


def test_looks_lie_apart_by_the_growth_and_end_at_the_maximum():
    at = looks(StopRule(minimum=20, maximum=100, growth=1.2))
    assert at == (20, 24, 29, 35, 42, 51, 62, 75, 90, 100)
    assert looks(StopRule(minimum=5, maximum=8, growth=1.0)) == (5, 6, 7, 8)
    assert looks(StopRule(minimum=9, maximum=9)) == (9,)
    assert all(b > a for a, b in pairwise(looks(StopRule(minimum=2, maximum=10_000, growth=1.01))))


def test_narrow_means_within_the_share_of_the_truth():
    rule = StopRule(relative=0.05)
    # 100 within 4.76: the truth is at least 95.24, and 4.76 is 5 % of it.
    assert narrow(Estimate(100.0, 95.239, 104.761, 30), rule)
    assert not narrow(Estimate(100.0, 95.2, 104.8, 30), rule)
    assert narrow(Estimate(0.0, 0.0, 0.04, 30), StopRule(relative=0.05, absolute=0.02))
    assert not narrow(Estimate(0.0, 0.0, 0.05, 30), StopRule(relative=0.05, absolute=0.02))


def stopped(draw, rule, rng):
    """Estimate at which one cell stops."""
    times_s = draw(rng, rule.maximum)
    for n in looks(rule):
        found = restricted_mean(np.minimum(times_s[:n], 600.0), times_s[:n] <= 600.0, 600.0)
        if narrow(found, rule):
            break
    return found


SPREAD = 0.25
MEAN_S = 300.0 * math.exp(SPREAD**2 / 2) * stats.norm.cdf(math.log(2) / SPREAD - SPREAD) + 600.0 * stats.norm.sf(
    math.log(2) / SPREAD
)


def test_intervals_still_cover_after_looking_many_times(covers):
    rng = np.random.default_rng(1)
    rule = StopRule(relative=0.05, maximum=400)
    found = [stopped(lambda g, n: 300.0 * np.exp(SPREAD * g.standard_normal(n)), rule, rng) for _ in range(1000)]
    covers(e.low <= MEAN_S <= e.high for e in found)
    assert all(narrow(e, rule) for e in found)
    # What the user asked for: within 5 % of the truth, 95 times in 100.
    assert sum(abs(e.value / MEAN_S - 1.0) <= 0.05 for e in found) >= 950


def test_without_the_guards_they_do_not(covers):
    # Falls make a mixture: a few lucky runs look alike. A look after each run from the second on, at half width 20 %.
    rng = np.random.default_rng(2)

    def draw(g, n):
        return np.where(g.random(n) < 0.3, 600.1, 300.0 * np.exp(0.3 * g.standard_normal(n)))

    d = math.log(2) / 0.3
    truth_s = 0.7 * (300.0 * math.exp(0.045) * stats.norm.cdf(d - 0.3) + 600.0 * stats.norm.sf(d)) + 0.3 * 600.0
    bare, guarded = StopRule(0.2, minimum=2, maximum=300, growth=1.0), StopRule(0.2, maximum=300)
    short = sum(not e.low <= truth_s <= e.high for e in (stopped(draw, bare, rng) for _ in range(400)))
    # docs/statistics.md: 87 % cover, so 51 misses of 400; true 95 % intervals miss 20, with standard error 4.4.
    assert short > 36
    covers(e.low <= truth_s <= e.high for e in (stopped(draw, guarded, rng) for _ in range(1000)))


def cell(n):
    times_s = 300.0 + np.arange(n) % 3
    return pd.DataFrame(
        {"replicate": range(n), "status": "completed", "time_s": times_s, "score": 4.0, "limit_s": 600.0}
    )


def test_a_cell_stops_at_a_look_only():
    rule, measure = StopRule(minimum=10, maximum=40, growth=1.5), Measure("time", 600.0)
    assert progress(cell(9), measure, rule).next_look == 10
    assert not progress(cell(9), measure, rule).stop
    at_ten = progress(cell(10), measure, rule)
    assert (at_ten.stop, at_ten.reached, at_ten.next_look) == (True, True, 10)
    assert not progress(cell(11), measure, rule).stop


def test_at_the_maximum_it_stops_without_having_reached_it():
    rule, measure = StopRule(relative=0.001, minimum=10, maximum=20), Measure("success", 600.0)
    at_end = progress(cell(20), measure, rule)
    assert (at_end.stop, at_end.reached) == (True, False)
    assert progress(cell(25), measure, rule).stop


def test_cells_that_never_complete_stop_too():
    never = cell(40).assign(status="censored", time_s=600.0)
    # Half of the bound's width is 600 * z^2 / (n + z^2) / 2: 4.4 % of the mean at 40 runs, 5.7 % at 30.
    assert progress(never, Measure("time", 600.0), StopRule(minimum=40)).stop
    assert not progress(never.head(30), Measure("time", 600.0), StopRule(minimum=30)).stop


@pytest.mark.parametrize(
    "figures", [{"relative": 0.0}, {"relative": -1.0}, {"minimum": 1}, {"minimum": 9, "maximum": 8}, {"growth": 0.9}]
)
def test_a_rule_that_makes_no_sense_is_refused(figures):
    with pytest.raises(BadInput):
        StopRule(**figures)
