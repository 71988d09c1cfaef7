"""Jitter: what every registered model promises, and the shapes of each."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.channel.jitter import JITTERS, EmpiricalJitter, NoJitter, NormalJitter, UniformJitter
from teleop_sim.core.errors import BadInput

DRAWS = 50_000

every_model = pytest.mark.parametrize("name", sorted(JITTERS))


def made(name):
    return JITTERS[name](**JITTERS[name].example)


def draws(model, count=DRAWS, seed=7):
    rng = np.random.default_rng(seed)
    return np.array([model.draw_s(rng) for _ in range(count)])


@every_model
def test_every_jitter_meets_its_own_mean_and_its_least(name):
    model, drawn_s = made(name), draws(made(name))
    # Independent draws: five standard errors.
    tolerance_s = 5.0 * drawn_s.std(ddof=1) / math.sqrt(DRAWS)
    assert drawn_s.mean() == pytest.approx(model.mean_s, abs=tolerance_s + 1e-12)
    assert drawn_s.min() >= model.least_s


@every_model
def test_every_jitter_takes_one_draw_a_packet(name):
    model, rng, counted = made(name), np.random.default_rng(3), np.random.default_rng(3)
    for _ in range(100):
        assert type(model.draw_s(rng)) is float
        counted.random()
    assert rng.bit_generator.state == counted.bit_generator.state


@every_model
def test_every_jitter_is_a_frozen_value(name):
    assert made(name) == made(name)
    assert hash(made(name)) == hash(made(name))


def test_without_jitter_nothing_is_added():
    assert not draws(NoJitter(), 100).any()
    assert not draws(UniformJitter(0.0, 0.0), 100).any()
    assert not draws(NormalJitter(0.0, 1.0), 100).any()
    assert not draws(NormalJitter(1.0, 0.0), 100).any()


def test_uniform_has_its_variance():
    # (high - low)^2 / 12; the variance of n uniform draws' variance is 1/180 of the width to the fourth over n.
    drawn_s = draws(UniformJitter(1.0, 3.0))
    assert drawn_s.var() == pytest.approx(4.0 / 12.0, abs=5.0 * 4.0 * math.sqrt(1 / 180 / DRAWS))
    assert drawn_s.max() <= 3.0


def test_normal_has_the_shares_of_a_normal_distribution():
    drawn_s = draws(NormalJitter(2.0, 4.0))
    # P(|z| < 1) = 0.6827; P(|z| > 2) = 0.0455, all of it at the clip. Five sigma of a binomial share.
    for share, chance in ((np.mean(np.abs(drawn_s) < 2.0), 0.6827), (np.mean(np.abs(drawn_s) == 4.0), 0.0455)):
        assert share == pytest.approx(chance, abs=5.0 * math.sqrt(chance * (1 - chance) / DRAWS))
    assert np.abs(drawn_s).max() == 4.0


def test_empirical_draws_every_sample_as_often():
    drawn_s = draws(EmpiricalJitter((0.1, 0.2, 0.2, 0.7)))
    for value_s, chance in ((0.1, 0.25), (0.2, 0.5), (0.7, 0.25)):
        share = np.mean(drawn_s == value_s)
        assert share == pytest.approx(chance, abs=5.0 * math.sqrt(chance * (1 - chance) / DRAWS))


class Edge:
    """The uniform draw at one end of its range."""

    def __init__(self, u):
        self.u = u

    def random(self):
        return self.u


@pytest.mark.parametrize("u", [0.0, 1.0 - 2.0**-53])
@given(samples_s=st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=9))
def test_the_ends_of_a_draw_are_in_range(u, samples_s):
    assert EmpiricalJitter(tuple(samples_s)).draw_s(Edge(u)) == samples_s[0 if u == 0.0 else -1]
    assert abs(NormalJitter(1.0, 50.0).draw_s(Edge(u))) < 9.0
    low_s, high_s = min(samples_s), max(samples_s)
    assert low_s <= UniformJitter(low_s, high_s).draw_s(Edge(u)) <= high_s


@pytest.mark.parametrize(
    ("make", "wrong"),
    [
        (lambda: UniformJitter(math.nan, math.inf), ["low_s", "high_s"]),
        (lambda: UniformJitter(2.0, 1.0), ["high_s"]),
        (lambda: NormalJitter(-1.0, math.inf), ["sd_s", "clip_s"]),
        (lambda: EmpiricalJitter(()), ["samples_s"]),
        (lambda: EmpiricalJitter((math.nan, 0.0, math.inf)), ["samples_s[0]", "samples_s[2]"]),
    ],
)
def test_every_impossible_jitter_is_named(make, wrong):
    with pytest.raises(BadInput) as refused:
        make()
    assert [p.where for p in refused.value.problems] == wrong
    assert all(p.hint for p in refused.value.problems)
