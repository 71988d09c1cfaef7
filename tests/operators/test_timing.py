"""Times are sums of the cited elements; their spread is the lognormal's closed form."""

import math
import tomllib
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

from teleop_sim.core.errors import BadInput
from teleop_sim.operators.timing import OperatorTiming, load_timing, lognormal_factor, words_in

TIMING = load_timing()


def test_confirming_is_the_sum_worked_out_by_hand():
    # "DETECT PANEL COARSE DETECTED PANEL": look .55, five words at .26, think 1.25, verify 1.25; then two keys at .28.
    assert TIMING.judge_s(5) == pytest.approx(0.55 + 1.30 + 1.25 + 1.25)
    assert TIMING.press_s() == pytest.approx(0.56)


def test_typing_restart_is_the_sum_worked_out_by_hand():
    # Mental 1.35, eight characters and Enter at .28 = 2.52, verify 1.25.
    assert TIMING.type_s("/RESTART") == pytest.approx(5.12)
    assert TIMING.plan_s(2) == pytest.approx(0.55 + 0.52 + 0.55 + 1.25)


def test_reading_and_repeating_are_sums():
    assert TIMING.read_line_s(10) == pytest.approx(3.15)
    assert TIMING.read_image_s() == pytest.approx(1.80)
    assert TIMING.repeat_s() == pytest.approx(0.55 + 1.25 + 0.56)


@pytest.mark.parametrize("spread", [0.0, 0.1, 0.3, 1.0])
def test_lognormal_factor_has_mean_one_and_the_stated_spread(spread):
    # Gauss-Hermite quadrature over z integrates exp(s z) to rounding.
    z, weight = np.polynomial.hermite_e.hermegauss(60)
    factors = np.array([lognormal_factor(float(x), spread) for x in z])
    weight = weight / weight.sum()
    mean = float(weight @ factors)
    assert mean == pytest.approx(1.0, rel=1e-9)
    # The root of a difference of squares halves the digits.
    assert math.sqrt(max(0.0, float(weight @ factors**2) - mean**2)) == pytest.approx(spread, abs=1e-6)


def test_samples_keep_the_mean_and_scale_with_expertise():
    rng, n = np.random.default_rng(7), 20_000
    mean = np.mean([TIMING.sample_s(4.0, rng) for _ in range(n)])
    # sd of the mean is 4 * 0.3 / sqrt(n) = 0.0085; four of them.
    assert mean == pytest.approx(4.0, abs=0.034)
    slow, usual = (t.sample_s(4.0, np.random.default_rng(3)) for t in (replace(TIMING, expertise=1.5), TIMING))
    assert slow == pytest.approx(1.5 * usual)


def test_no_act_is_faster_than_one_cycle_of_eye_mind_and_hand():
    hasty = replace(TIMING, expertise=1e-6)
    assert hasty.sample_s(4.0, np.random.default_rng(0)) == TIMING.floor_s == pytest.approx(0.1 + 0.07 + 0.07)


def test_a_sample_draws_exactly_once_whatever_the_spread():
    for spread in (0.0, 0.3):
        used, one = np.random.default_rng(5), np.random.default_rng(5)
        replace(TIMING, spread=spread).sample_s(1.0, used)
        one.standard_normal()
        assert used.random() == one.random()


def test_every_figure_has_a_source_and_a_status():
    text = resources.files("teleop_sim.operators").joinpath("timing.toml").read_text()
    table = tomllib.loads(text)
    assert set(table) == set(OperatorTiming.__dataclass_fields__)
    for entry in table.values():
        assert entry["source"]
        assert entry["status"] in {"read", "page", "paper", "remembered", "computed", "assumed"}


def test_all_bad_figures_are_refused_at_once():
    with pytest.raises(BadInput) as caught:
        load_timing(look_s=0.0, spread=-1.0, patience_growth=1.0, keystroke_s=math.nan)
    said = str(caught.value)
    assert all(name in said for name in ("look_s", "spread", "patience_growth", "keystroke_s"))
    assert len(caught.value.problems) == 4


@pytest.mark.parametrize(
    ("text", "words"),
    [("/DETECTED_PANEL_FINE", 3), ("", 0), ("pelvis 0.12 m from goal", 5), ("STATE_INIT: /REGULAR", 3)],
)
def test_words_are_what_a_person_reads(text, words):
    assert words_in(text) == words
