"""Presets: figures of their sources, clocks, and what every preset promises."""

import math
from pathlib import Path

import numpy as np
import pytest

from teleop_sim.channel.jitter import UniformJitter
from teleop_sim.channel.presets import PRESETS, WAYS, Preset, Way, in_simulated_time, preset
from teleop_sim.channel.settings import DirectionSettings
from teleop_sim.channel.trace import Offer, trace
from teleop_sim.core.errors import BadInput, UnknownName

EVERY = pytest.mark.parametrize("name", sorted(PRESETS))
NAMES = {
    *("src-task1-hardest", "src-task1-default", "src-task2-3-default", "src-task2-3-hard", "src-qualification"),
    *("wpi-paper-literal", "wpi-paper-likely"),
    *(f"vrc-2013-run{i}" for i in range(1, 6)),
    *("drc-trials-2013", "drc-finals-2015", "spacebot-cup", "subt-virtual"),
    *("moon", "mars-near", "mars-mean", "mars-far", "mars-as-in-paper"),
}


def drawn(name: str, way: str = "up", until_s: float = 3600.0, seed: int = 1, factor: float = 1.0) -> DirectionSettings:
    return preset(name).settings(until_s, np.random.default_rng(seed), way, factor)


def test_every_regime_is_there() -> None:
    assert set(PRESETS) == NAMES


@EVERY
def test_every_preset_says_where_it_is_from_and_what_it_does_in_the_dark(name: str) -> None:
    made = PRESETS[name]
    assert made.name == name
    assert made.title
    assert made.source
    assert made.status in ("code", "rules", "page", "paper", "constant", "computed")
    assert made.clock in ("wall", "simulated")
    assert made.on_dark in ("pause", "restart", "lose")
    assert made.on_dark_flight in ("arrive", "lose")
    assert {"up", "down"} <= set(made.ways) <= set(WAYS)
    for way in made.ways.values():
        assert (way.base.on_dark, way.base.on_dark_flight) == (made.on_dark, made.on_dark_flight)


@EVERY
def test_every_preset_delivers_on_every_way(name: str) -> None:
    for way in PRESETS[name].ways:
        link = drawn(name, way, 5000.0)
        [row] = trace([Offer(0.0, "a", 1)], link, np.random.default_rng(1), until_s=5000.0)
        assert row.outcome == "delivered", way


@EVERY
def test_the_same_stream_draws_the_same_link(name: str) -> None:
    for way in PRESETS[name].ways:
        assert drawn(name, way) == drawn(name, way)


@pytest.mark.parametrize(
    ("name", "up_bps", "down_bps", "delay_s"),
    [
        ("src-task1-hardest", 64, 50e3, 10.0),  # rules
        ("src-task1-default", 4e3, 380e3, 0.25),  # src_monitor.py
        ("src-task2-3-default", 30e3, 2e6, 0.25),  # src_monitor.py
        ("wpi-paper-literal", 380, 380, 10.0),  # section VII, literally
        ("wpi-paper-likely", 4e3, 380e3, 10.0),
        ("drc-finals-2015", 9600, 9600, 0.0),
        ("moon", math.inf, math.inf, 384400.0 / 299792.458),
        ("mars-far", math.inf, math.inf, 401e6 / 299792.458),
    ],
)
def test_figures_are_the_sources(name: str, up_bps: float, down_bps: float, delay_s: float) -> None:
    made = PRESETS[name]
    assert (made.up.rate_bps, made.down.rate_bps) == (up_bps, down_bps)
    assert made.up.delay_s == made.down.delay_s
    # Delays are given with four digits.
    assert made.up.delay_s == pytest.approx(delay_s, rel=5e-4)


def test_the_budgets_of_the_virtual_challenge_fall_by_four_and_by_two() -> None:
    ups = [PRESETS[f"vrc-2013-run{i}"].up.budget_bits for i in range(1, 6)]
    downs = [PRESETS[f"vrc-2013-run{i}"].down.budget_bits for i in range(1, 6)]
    assert ups == [29_491_200 / 4**i for i in range(5)]
    assert downs == [943_718_400 / 2**i for i in range(5)]


@pytest.mark.parametrize("run", range(1, 6))
def test_a_budget_runs_out_at_the_right_bit(run: int) -> None:
    link = drawn(f"vrc-2013-run{run}")
    whole = int(link.budget_bits) // 8
    rows = trace([Offer(0.0, "all", whole), Offer(1.0, "more", 1)], link, np.random.default_rng(1))
    assert [(row.outcome, row.reason) for row in rows] == [("delivered", ""), ("dropped", "budget")]
    [over] = trace([Offer(0.0, "too much", whole + 1)], link, np.random.default_rng(1))
    assert over.outcome == "dropped"


def test_the_trials_alternate_minute_by_minute() -> None:
    link = drawn("drc-trials-2013", until_s=240.0)
    assert link.rates == ((0.0, 1e6), (60.0, 1e5), (120.0, 1e6), (180.0, 1e5))
    assert link.delays == ((0.0, 0.05), (60.0, 0.5), (120.0, 0.05), (180.0, 0.5))


def test_a_message_of_the_trials_has_the_delay_of_its_minute() -> None:
    """1000 bytes: 8 ms and 50 ms in a good minute, 80 ms and 500 ms in a bad one; nobody overtakes at the change."""
    offers = [Offer(t_s, "m", 1000) for t_s in (10.0, 70.0, 119.9, 120.0)]
    rows = trace(offers, drawn("drc-trials-2013", until_s=240.0), np.random.default_rng(1))
    bad, last_of_bad = 70.0 + 0.58, 119.9 + 0.58
    assert [row.arrived_s for row in rows] == pytest.approx([10.058, bad, last_of_bad, last_of_bad], abs=1e-9)


def test_bursts_of_the_finals_last_a_second_and_gaps_whole_seconds() -> None:
    link = drawn("drc-finals-2015", "burst", until_s=2600.0)
    starts, ends = np.array(link.blackouts).T
    assert starts[1:] - ends[:-1] == pytest.approx(1.0)
    gaps = np.unique((ends - starts)[:-1])
    assert gaps.min() >= 1
    assert gaps.max() <= 30
    assert np.array_equal(gaps, np.round(gaps))


def test_limits_in_wall_time_are_scaled_by_the_pace_of_the_simulation() -> None:
    # At 0.16 simulated seconds a wall second: 64 bit in 0.16 s, and 10 s of wall time are 1.6 s.
    link = drawn("src-task1-hardest", factor=0.16)
    assert (link.rate_bps, link.delay_s) == pytest.approx((400.0, 1.6))
    assert drawn("moon", factor=0.16) == drawn("moon")
    scaled = in_simulated_time(DirectionSettings(8.0, 1.0, 0, ((2.0, math.inf),), rates=((0.0, 8.0), (4.0, 2.0))), 0.5)
    assert (scaled.blackouts, scaled.rates) == (((1.0, math.inf),), ((0.0, 16.0), (2.0, 4.0)))


@pytest.mark.parametrize("factor", [0.0, -1.0, math.nan, math.inf])
def test_an_impossible_pace_is_refused(factor: float) -> None:
    with pytest.raises(BadInput, match="real_time_factor"):
        drawn("src-task1-default", factor=factor)


def test_unknown_names_are_refused_with_a_guess() -> None:
    with pytest.raises(UnknownName, match="Did you mean 'drc-finals-2015'"):
        preset("drc-final")
    with pytest.raises(UnknownName, match="direction of moon"):
        drawn("moon", "burst")


def test_a_preset_that_delivers_nothing_is_refused_with_the_reason() -> None:
    # 4 s of light at 8 bit/s carry 32 bits; the smallest packet has 40.
    base = DirectionSettings(8.0, 0.0, 4, ((4.0, math.inf),), on_dark="lose")
    bad = Preset("bad", "", "", "rules", "wall", "lose", "arrive", {"up": Way(base)})
    with pytest.raises(BadInput, match=r"bad\.up\.blackouts: the longest light, 4 s, carries 32 bits"):
        bad.settings(100.0, np.random.default_rng(1))


def test_the_model_page_lists_every_preset_with_its_source() -> None:
    page = (Path(__file__).parents[2] / "docs" / "link.md").read_text(encoding="utf-8")
    for made in PRESETS.values():
        [row] = [line for line in page.splitlines() if line.startswith(f"| `{made.name}` |")]
        assert f"| {made.clock} | {made.on_dark} | {made.source} ({made.status}) |" in row


def test_on_the_wall_s_clock_jitter_and_alternating_delays_shrink_with_the_rest() -> None:
    wall = DirectionSettings(
        64.0, 10.0, rates=((0.0, 64.0), (60.0, 32.0)), delays=((0.0, 10.0), (60.0, 5.0)), jitter=UniformJitter(0.0, 2.0)
    )
    own = in_simulated_time(wall, 0.1)
    assert np.array(own.delays) == pytest.approx(np.array([[0.0, 1.0], [6.0, 0.5]]))
    assert np.array(own.rates) == pytest.approx(np.array([[0.0, 640.0], [6.0, 320.0]]))
    assert own.jitter.mean_s == pytest.approx(0.1 * wall.jitter.mean_s)
