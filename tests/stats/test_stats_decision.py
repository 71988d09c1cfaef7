"""The decision map on cases whose answer is known, and the table a cell."""

import numpy as np
import pandas as pd
import pytest

from teleop_sim.core.errors import BadInput
from teleop_sim.stats.decision import choose, decision_map
from teleop_sim.stats.paired import Matched
from teleop_sim.stats.runs import Measure
from teleop_sim.stats.summary import compare_levels, estimate, summary

LEVELS = ("off", "low", "high", "full")
TRUTH = np.array([0.0, 0.3, 0.5, 0.9])


def experiments(rng, means, n, own):
    """1,000 experiments of four levels on n replicates which share most of their luck, shape (1000, 4, n)."""
    shared = rng.normal(size=(1000, 1, n))
    return means[:, None] + shared + own * rng.normal(size=(1000, means.size, n))


def test_the_margins_interval_covers_and_a_clear_verdict_is_right(covers):
    choices = [
        choose(Matched(LEVELS, values, 0), 1, np.random.default_rng(i))
        for i, values in enumerate(experiments(np.random.default_rng(1), TRUTH, 20, 0.5))
    ]
    truth = dict(zip(LEVELS, TRUTH, strict=True))
    covers(c.low <= truth[c.best] - truth[c.second] <= c.high for c in choices)
    # The 0.4 between first and second are 2.5 standard errors (0.5 sqrt(2 / 20) = 0.16): 99.4 % find the best.
    assert sum(c.best == "full" for c in choices) >= 985
    clear = [c for c in choices if c.verdict == "clear"]
    assert len(clear) > 400
    # A wrong one needs the best to seem worse by 2.4 standard errors after being better by 2.5.
    assert all(c.best == "full" for c in clear)
    # Shares of resamples are no posterior, but near one: those which say 90 to 98 % are right that often.
    likely = [c.best == "full" for c in choices if 0.9 <= c.best_share <= 0.98]
    assert np.mean(likely) >= 0.9


@pytest.mark.parametrize("levels", [2, 4])
def test_equal_levels_are_called_clear_at_most_5_times_in_100(levels):
    data = experiments(np.random.default_rng(2), np.zeros(levels), 20, 0.7)
    clear = sum(
        choose(Matched(LEVELS[:levels], values, 0), 1, np.random.default_rng(i)).verdict == "clear"
        for i, values in enumerate(data)
    )
    # Binomial(1000, 0.05): 50 and 4 standard deviations. With four levels the best of chance is rarely clear.
    assert clear <= 78


def test_equal_levels_share_the_resamples():
    choice = choose(Matched(("a", "b"), np.array([[1.0, 2.0, 3.0, 4.0] * 2] * 2), 0), 1, np.random.default_rng(0))
    assert (choice.best, choice.margin, choice.low, choice.high) == ("a", 0.0, 0.0, 0.0)
    assert choice.best_share == pytest.approx(0.5)
    assert (choice.verdict, choice.contenders) == ("tie", "b")
    assert choice.replicates == 8


def test_five_replicates_are_too_few_to_be_clear():
    values = np.array([[1.0] * 6, [2.0] * 6])
    assert choose(Matched(("a", "b"), values[:, :5], 0), 1, np.random.default_rng(0)).verdict == "too few runs"
    assert choose(Matched(("a", "b"), values, 0), 1, np.random.default_rng(0)).verdict == "clear"


def sweep(seed=1, replicates=40):
    """Full autonomy costs a fall in 4; off waits for the link: 60 s a second of delay. They cross at 3.3 s."""
    rng = np.random.default_rng(seed)
    rows = []
    for r in range(replicates):
        work, falls = 300.0 * np.exp(0.2 * rng.standard_normal()), rng.random() < 0.25
        for delay in (0.0, 2.0, 5.0, 10.0):
            rows.append((r, "completed", work + 60.0 * delay, 4.0, 2000.0, delay, "off"))
            full = ("failed", 100.0, 1.0) if falls else ("completed", work, 4.0)
            rows.append((r, full[0], full[1], full[2], 1100.0, delay, "full"))
    columns = ["replicate", "status", "time_s", "score", "limit_s", "delay_s", "autonomy"]
    return pd.DataFrame(rows, columns=columns)


def test_the_map_shows_where_the_levels_cross():
    # Truth of the built case: off 306 + 60 d (mean of work: 300 e^0.02), full 0.75 * 306 + 0.25 * 1100 = 505: crossing
    # at 3.3 s.
    found = decision_map(sweep(), ["delay_s"], "autonomy", Measure("time", 1100.0), seed=1)
    assert found["delay_s"].tolist() == [0.0, 2.0, 5.0, 10.0]
    assert found["best"].tolist() == ["off", "off", "full", "full"]
    assert found["verdict"].tolist()[0] == "clear"
    assert found["verdict"].tolist()[3] == "clear"
    assert (found["margin"] >= 0.0).all()
    assert ((found["low"] <= found["margin"]) & (found["margin"] <= found["high"])).all()
    assert found["replicates"].tolist() == [40] * 4


def test_another_measure_may_choose_otherwise():
    # A score asks for no haste. By 400 s off completes with probability 0.925 at no delay (normal, ln(4 / 3) / 0.2),
    # 0.365 at 2 s; full with 0.75 * 0.925 = 0.69 at any.
    score = decision_map(sweep(), ["delay_s"], "autonomy", Measure("score"), seed=1)
    assert score["best"].tolist() == ["off"] * 4
    success = decision_map(sweep(), ["delay_s"], "autonomy", Measure("success", 400.0), seed=1)
    assert success["best"].tolist() == ["off", "full", "full", "full"]


def test_the_map_of_a_shuffled_table_is_the_same_but_for_its_order():
    table = sweep()
    first = decision_map(table, ["delay_s"], "autonomy", Measure("time", 1100.0), seed=1)
    other = decision_map(table.iloc[::-1], ["delay_s"], "autonomy", Measure("time", 1100.0), seed=1)
    pd.testing.assert_frame_equal(first, other.sort_values("delay_s").reset_index(drop=True))


def test_cells_without_a_choice_are_left_out():
    table = sweep().query("delay_s > 0 or autonomy == 'off'")
    found = decision_map(table, ["delay_s"], "autonomy", Measure("time", 1100.0))
    assert found["delay_s"].tolist() == [2.0, 5.0, 10.0]
    none = decision_map(table.query("autonomy == 'off'"), ["delay_s"], "autonomy", Measure("time", 1100.0))
    assert none.empty
    assert "best" in none.columns


def test_one_level_is_no_choice():
    with pytest.raises(BadInput):
        choose(Matched(("a",), np.ones((1, 9)), 0), 1, np.random.default_rng(0))


def test_the_table_a_cell():
    found = summary(sweep(), ["delay_s", "autonomy"]).set_index(["delay_s", "autonomy"])
    off, full = found.loc[(0.0, "off")], found.loc[(0.0, "full")]
    assert (off["runs"], off["completed"], off["failed"]) == (40, 40, 0)
    assert full["completed"] + full["failed"] == 40
    assert full["failure_low"] < 0.25 < full["failure_high"]
    # The common limit is 1,100 s: a fall counts as that.
    assert full["mean_s"] == pytest.approx((off["mean_s"] * 40 - _lost(sweep())) / 40, rel=1e-9)
    assert off["q50_s_low"] < off["q50_s"] < off["q50_s_high"]
    assert found.loc[(0.0, "full"), "q90_s"] == np.inf
    assert "q90_s: beyond" in full["notes"]


def _lost(table):
    """What the falls save less what they cost, by hand: sum of the work of those who fell, less 1,100 s each."""
    cell = table.query("delay_s == 0.0").pivot(index="replicate", columns="autonomy", values=["time_s", "status"])
    fell = cell["status"]["full"] == "failed"
    return float((cell["time_s"]["off"][fell].astype(float) - 1100.0).sum())


def test_estimates_by_measure():
    cell = sweep().query("delay_s == 0.0 and autonomy == 'full'")
    assert estimate(cell, Measure("success", 1100.0)).value == pytest.approx((cell["status"] == "completed").mean())
    assert estimate(cell, Measure("score")).value == pytest.approx(cell["score"].mean())
    assert estimate(cell.query("status == 'completed'"), Measure("score")).note


def test_levels_are_compared_by_log_rank():
    # Link of 10 s: off needs 600 s more. Link of 0 s: what completes does so at the same times.
    completed = sweep().query("status == 'completed'")
    assert compare_levels(completed.query("delay_s == 10.0"), "autonomy").p_value < 1e-6
    same = completed.query("delay_s == 0.0")
    assert compare_levels(same, "autonomy").p_value > 0.05
