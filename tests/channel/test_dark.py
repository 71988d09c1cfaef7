"""Models of blackouts: what every registered one promises, and the closed forms of each."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.channel.blackouts import dark_between, first_light, schedule_problems
from teleop_sim.channel.dark import DARK_MODELS, DrcFinals, Passes, Periodic, RandomGaps, Scheduled
from teleop_sim.core.errors import BadInput

every_model = pytest.mark.parametrize("name", sorted(DARK_MODELS))


def made(name):
    return DARK_MODELS[name](**DARK_MODELS[name].example)


def drawn(model, until_s, seed=7):
    return model.windows(until_s, np.random.default_rng(seed))


@every_model
@given(until_s=st.floats(0.0, 1000.0), seed=st.integers(0, 2**32))
def test_every_model_gives_a_sound_schedule_within_the_run(name, until_s, seed):
    windows = drawn(made(name), until_s, seed)
    assert schedule_problems(windows, "windows") == ()
    assert all(0.0 <= start_s < end_s <= until_s for start_s, end_s in windows)
    assert all(end_s < start_s for (_, end_s), (start_s, _) in pairwise(windows))


@every_model
def test_every_model_is_dark_and_light_at_some_time(name):
    assert 0.0 < dark_between(0.0, 500.0, drawn(made(name), 500.0)) < 500.0


@every_model
def test_every_model_gives_the_same_for_equal_generators(name):
    assert drawn(made(name), 5000.0) == drawn(made(name), 5000.0)
    assert made(name) == made(name)
    assert hash(made(name)) == hash(made(name))


@every_model
@given(short_s=st.floats(0.0, 1000.0), more_s=st.floats(0.0, 1000.0))
def test_every_model_shows_a_shorter_run_the_same_dark(name, short_s, more_s):
    longer = drawn(made(name), short_s + more_s)
    assert drawn(made(name), short_s) == tuple((a, min(b, short_s)) for a, b in longer if a < short_s)


@every_model
@pytest.mark.parametrize("until_s", [-1.0, math.inf, math.nan])
def test_every_model_wants_a_run_that_ends(name, until_s):
    with pytest.raises(BadInput, match="until_s"):
        drawn(made(name), until_s)


def test_drc_finals_has_duty_two_of_33_and_a_mean_wait_of_9_55_s():
    assert DrcFinals().duty == pytest.approx(2.0 / 33.0, rel=1e-15)
    # Sum of squares of 1 to 30 is 9455: E[G^2] / 33 = 9455 / 990.
    assert DrcFinals().mean_wait_s == pytest.approx(9455.0 / 990.0, rel=1e-15)
    assert DrcFinals().mean_wait_s == pytest.approx(9.55, abs=0.005)


def test_drc_finals_draws_meet_duty_and_mean_wait():
    until_s, arrivals = 8e6, 100_000
    model = DrcFinals(ends_after_s=math.inf)
    windows = drawn(model, until_s)
    light = 1.0 - dark_between(0.0, until_s, windows) / until_s
    at_s = np.random.default_rng(8).uniform(0.0, until_s, arrivals)
    waits_s = [first_light(t_s, windows) - t_s for t_s in at_s]
    # The wait has a standard deviation of 7.4 s: 0.25 % over 1e5 arrivals; the 5e5 gaps add 0.1 %. Duty: below 0.1 %.
    assert np.mean(waits_s) == pytest.approx(9.55, rel=0.01)
    assert light == pytest.approx(2.0 / 33.0, rel=0.01)


def test_drc_finals_gaps_are_whole_seconds_from_1_to_30_all_as_often():
    windows = drawn(DrcFinals(ends_after_s=math.inf), 1e6)
    gaps_s, counts = np.unique([b - a for a, b in windows[:-1]], return_counts=True)
    assert gaps_s.tolist() == list(range(1, 31))
    bursts_s = {b[0] - a[1] for a, b in pairwise(windows)}
    assert bursts_s == {1.0}
    # Chi-squared with 29 degrees of freedom: mean 29, standard deviation 7.6; five of them.
    expected = counts.sum() / 30
    assert np.sum((counts - expected) ** 2 / expected) < 29.0 + 5.0 * 7.6


def test_drc_finals_stays_light_after_45_minutes():
    windows = drawn(DrcFinals(), 3600.0)
    assert windows[0][0] == 1.0
    assert 2669.0 <= windows[-1][1] <= 2700.0
    assert first_light(2700.0, windows) == 2700.0


@given(st.floats(0.1, 10.0), st.integers(1, 9), st.integers(0, 9))
def test_mean_wait_equals_the_sum_over_gaps(on_s, least, width):
    gaps = range(least, least + width + 1)
    cycles_s = sum(on_s + g for g in gaps)
    assert DrcFinals(on_s, (least, least + width)).mean_wait_s == pytest.approx(sum(g * g / 2 for g in gaps) / cycles_s)


def test_random_gaps_meet_their_means():
    windows = np.array(drawn(RandomGaps(9.0, 3.0), 120_000.0))
    dark_s = windows[:-1, 1] - windows[:-1, 0]
    light_s = windows[1:, 0] - windows[:-1, 1]
    # Exponential: the standard deviation is the mean; five standard errors of some 10 000 lengths.
    assert dark_s.mean() == pytest.approx(3.0, rel=5.0 / math.sqrt(len(dark_s)))
    assert light_s.mean() == pytest.approx(9.0, rel=5.0 / math.sqrt(len(light_s)))
    assert np.mean(dark_s > 3.0) == pytest.approx(math.exp(-1.0), abs=5.0 * math.sqrt(0.25 / len(dark_s)))


def test_random_gaps_too_short_to_resolve_leave_no_empty_window():
    windows = drawn(RandomGaps(10.0, 1e-15), 200.0)
    assert all(b > a for a, b in windows)


def test_periodic_starts_on_the_beat():
    assert drawn(Periodic(60.0, 20.0, 30.0), 200.0) == ((30.0, 50.0), (90.0, 110.0), (150.0, 170.0))
    assert drawn(Periodic(0.3, 0.1, 0.0), 1e4)[30_000][0] == 30_000 * 0.3


def test_scheduled_is_cut_at_the_end_of_the_run():
    assert drawn(Scheduled(((1.0, 2.0), (5.0, math.inf))), 7.0) == ((1.0, 2.0), (5.0, 7.0))
    assert drawn(Scheduled(((1.0, 2.0), (5.0, math.inf))), 5.0) == ((1.0, 2.0),)
    assert drawn(Scheduled(()), 5.0) == ()


def test_passes_are_light_and_nothing_else_is():
    # SpaceBot Cup: three windows of 300 s in 3600 s (raumfahrer.net); where they lie is made up here.
    passes = Passes(((0.0, 300.0), (1200.0, 1500.0), (3000.0, 3300.0)))
    windows = drawn(passes, 3600.0)
    assert windows == ((300.0, 1200.0), (1500.0, 3000.0), (3300.0, 3600.0))
    assert dark_between(0.0, 3600.0, windows) == 3600.0 - 900.0


def test_touching_contacts_leave_no_dark_and_an_endless_one_stays_light():
    assert drawn(Passes(((10.0, 20.0), (20.0, math.inf))), 1e6) == ((0.0, 10.0),)


@pytest.mark.parametrize(
    ("make", "wrong"),
    [
        (lambda: Scheduled(((5.0, 2.0), (1.0, 2.0))), ["blackouts[0]", "blackouts[1]"]),
        (lambda: Periodic(0.0, -1.0, math.nan), ["period_s", "dark_s", "first_s"]),
        (lambda: Periodic(10.0, 10.0, 0.0), ["dark_s"]),
        (lambda: RandomGaps(0.0, math.inf), ["mean_light_s", "mean_dark_s"]),
        (lambda: DrcFinals(0.0, (0, 30), math.nan), ["on_s", "off_s", "ends_after_s"]),
        (lambda: DrcFinals(off_s=(30, 1)), ["off_s"]),
        (lambda: DrcFinals(off_s=(1, 2.5)), ["off_s"]),
        (lambda: DrcFinals(off_s=(1, math.inf)), ["off_s"]),
        (lambda: Passes(()), ["contacts"]),
        (lambda: Passes(((5.0, 6.0), (1.0, 0.5))), ["contacts[1]", "contacts[1]"]),
    ],
)
def test_every_impossible_pattern_is_named(make, wrong):
    with pytest.raises(BadInput) as refused:
        make()
    assert [p.where for p in refused.value.problems] == wrong
    assert all(p.hint for p in refused.value.problems)


def test_contacts_are_not_called_blackouts():
    with pytest.raises(BadInput) as refused:
        Passes(((5.0, 6.0), (1.0, 2.0), (-1.0, 9.0)))
    assert "blackout" not in str(refused.value)
