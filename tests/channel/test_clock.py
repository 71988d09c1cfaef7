"""Wall time to simulated time: the cited case, and that the same bits fit on either clock."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.channel.clock import (
    SRC_REAL_TIME_FACTOR,
    simulated_bps,
    simulated_rates,
    simulated_s,
    simulated_schedule,
)
from teleop_sim.channel.jitter import JITTERS
from teleop_sim.channel.rates import bits_between, finish_of
from teleop_sim.core.errors import BadInput

factors = st.floats(0.01, 10.0)
RATES = ((0.0, 64.0), (30.0, 380.0), (60.0, 4000.0))
DARK = ((10.0, 20.0), (25.0, 40.0))


def test_the_hardest_src_link_at_a_factor_of_0_16():
    assert simulated_bps(64.0, SRC_REAL_TIME_FACTOR) == pytest.approx(400.0, rel=1e-15)
    assert simulated_s(10.0, SRC_REAL_TIME_FACTOR) == pytest.approx(1.6, rel=1e-15)


def test_at_a_factor_of_one_nothing_changes():
    assert (simulated_s(10.0, 1.0), simulated_bps(64.0, 1.0)) == (10.0, 64.0)
    assert (simulated_schedule(DARK, 1.0), simulated_rates(RATES, 1.0)) == (DARK, RATES)


def test_no_limit_and_no_end_stay_so():
    assert simulated_bps(math.inf, 0.16) == math.inf
    assert simulated_schedule(((1.0, math.inf),), 0.5) == ((0.5, math.inf),)


@given(factors, st.floats(0.0, 100.0), st.floats(0.0, 100.0))
def test_the_same_bits_fit_on_either_clock(factor, a_s, length_s):
    rates, dark = simulated_rates(RATES, factor), simulated_schedule(DARK, factor)
    simulated = bits_between(simulated_s(a_s, factor), simulated_s(a_s + length_s, factor), rates, dark)
    # Times below 200 s are rounded a few times (3e-14 s each), at 4000 bit/s.
    assert simulated == pytest.approx(bits_between(a_s, a_s + length_s, RATES, DARK), rel=1e-9, abs=1e-8)


@given(factors, st.floats(0.0, 100.0), st.integers(1, 10_000))
def test_a_packet_is_out_at_the_same_instant_of_the_wall(factor, start_s, bits):
    rates, dark = simulated_rates(RATES, factor), simulated_schedule(DARK, factor)
    out_s = finish_of(simulated_s(start_s, factor), bits, rates, dark)
    wall_s = finish_of(start_s, bits, RATES, DARK)
    # Where the last bit leaves as a blackout starts, rounding may keep it until the light: bits agree, not instants.
    if not any(abs(wall_s - a_s) < 1e-9 for window in DARK for a_s in window):
        assert out_s == pytest.approx(simulated_s(wall_s, factor), rel=1e-9)


@pytest.mark.parametrize("name", sorted(JITTERS))
def test_every_jitter_scales_draw_by_draw(name):
    jitter = JITTERS[name](**JITTERS[name].example)
    scaled = jitter.scaled(0.16)
    rngs = np.random.default_rng(5), np.random.default_rng(5)
    for _ in range(100):
        assert scaled.draw_s(rngs[1]) == pytest.approx(0.16 * jitter.draw_s(rngs[0]), rel=1e-12, abs=1e-15)
    assert scaled.mean_s == pytest.approx(0.16 * jitter.mean_s)
    assert scaled.least_s == pytest.approx(0.16 * jitter.least_s)


@pytest.mark.parametrize("factor", [0.0, -1.0, math.inf, math.nan])
@pytest.mark.parametrize(
    "convert",
    [
        lambda f: simulated_s(1.0, f),
        lambda f: simulated_bps(1.0, f),
        lambda f: simulated_schedule(DARK, f),
        lambda f: simulated_rates(RATES, f),
    ],
)
def test_an_impossible_factor_is_refused(convert, factor):
    with pytest.raises(BadInput, match="real_time_factor") as refused:
        convert(factor)
    assert refused.value.problems[0].hint
