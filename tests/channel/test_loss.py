"""Loss models: what every registered one promises, and the burst model's closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.channel.loss import LOSS_MODELS, Bernoulli, GilbertElliott, NoLoss
from teleop_sim.core.errors import BadInput

DRAWS, BATCHES = 200_000, 200

every_model = pytest.mark.parametrize("name", sorted(LOSS_MODELS))


def made(name):
    return LOSS_MODELS[name](**LOSS_MODELS[name].example)


def losses(model, count, seed=7):
    rng, bad, lost = np.random.default_rng(seed), False, np.empty(count)
    for i in range(count):
        bad, lost[i] = model.step(bad, rng)
    return lost


@every_model
def test_every_loss_model_meets_its_own_mean(name):
    model = made(name)
    batches = losses(model, DRAWS).reshape(BATCHES, -1).mean(axis=1)
    # Batches of 1000 packets are long against a burst, so their means are nearly independent: five standard errors.
    tolerance = 5.0 * batches.std(ddof=1) / math.sqrt(BATCHES)
    assert batches.mean() == pytest.approx(model.mean_loss, abs=tolerance + 1e-12)


@every_model
def test_every_loss_model_takes_two_draws_a_packet(name):
    model, rng, counted = made(name), np.random.default_rng(3), np.random.default_rng(3)
    bad = False
    for _ in range(100):
        bad, lost = model.step(bad, rng)
        assert (type(bad), type(lost)) == (bool, bool)
        counted.random(2)
    assert rng.bit_generator.state == counted.bit_generator.state


@every_model
def test_every_loss_model_is_a_frozen_value(name):
    assert made(name) == made(name)
    assert hash(made(name)) == hash(made(name))


def test_a_run_of_bad_luck_lasts_as_long_as_gilbert_says():
    lost = losses(GilbertElliott(0.02, 0.25), DRAWS)
    starts = int(np.sum((lost[1:] == 1) & (lost[:-1] == 0)) + lost[0])
    # Geometric with mean 1/p_leave = 4 and standard deviation sqrt(12) over some 3700 bursts: five sigma.
    assert lost.sum() / starts == pytest.approx(4.0, abs=5.0 * math.sqrt(12.0 / starts))


@given(st.floats(0.0, 0.9), st.floats(0.0, 0.9), st.integers(0, 2**32))
def test_a_greater_chance_loses_the_same_packets_and_more(p, q, seed):
    few, many = sorted((p, q))
    assert np.all(losses(Bernoulli(few), 50, seed) <= losses(Bernoulli(many), 50, seed))
    gentle, harsh = GilbertElliott(0.2, 0.2, few), GilbertElliott(0.2, 0.2, many)
    assert np.all(losses(gentle, 50, seed) <= losses(harsh, 50, seed))


def test_without_loss_nothing_is_lost():
    assert not losses(NoLoss(), 1000).any()
    assert not losses(Bernoulli(0.0), 1000).any()
    assert not losses(GilbertElliott(0.5, 0.5, 0.0), 1000).any()


def test_a_certain_alternation():
    # Enters at once, leaves at once: bad, good, bad, good.
    assert losses(GilbertElliott(1.0, 1.0), 6).tolist() == [1, 0, 1, 0, 1, 0]


@pytest.mark.parametrize(
    ("make", "wrong"),
    [
        (lambda: Bernoulli(1.0), ["p"]),
        (lambda: Bernoulli(-0.1), ["p"]),
        (lambda: Bernoulli(math.nan), ["p"]),
        (lambda: GilbertElliott(0.0, 0.5), ["p_enter"]),
        (lambda: GilbertElliott(0.5, 1.5, 2.0), ["p_leave", "p_lose"]),
        (lambda: GilbertElliott(math.nan, 0.0, -1.0), ["p_enter", "p_leave", "p_lose"]),
    ],
)
def test_every_impossible_probability_is_named(make, wrong):
    with pytest.raises(BadInput) as refused:
        make()
    assert [p.where for p in refused.value.problems] == wrong
    assert all(p.hint for p in refused.value.problems)
