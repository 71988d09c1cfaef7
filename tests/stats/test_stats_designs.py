"""Factors, designs and sensitivities."""

import math
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.core.errors import BadInput
from teleop_sim.core.units import parse_rate_bps, parse_time_s
from teleop_sim.stats.designs import cells_at, full_grid, latin_hypercube, sobol_cells
from teleop_sim.stats.factors import Factor, Range, at, grid_levels, parse_levels, spaced
from teleop_sim.stats.sensitivity import morris_analyse, morris_design, sobol_analyse, sobol_design

WORDS = ("off", "low", "high", "full")


def word(text, where):
    return text


def whole(text, where):
    return int(text)


def test_ranges_and_lists_are_read():
    assert parse_levels("64bps,380bps, 4kbps", "--uplink", parse_rate_bps) == (64.0, 380.0, 4000.0)
    assert parse_levels("1kbps:4kbps:4", "--uplink", parse_rate_bps) == Range(1000.0, 4000.0, 4)
    assert parse_levels("64bps:4kbps:7:log", "--uplink", parse_rate_bps) == Range(64.0, 4000.0, 7, "log")
    assert parse_levels("0s:10s", "--latency", parse_time_s) == Range(0.0, 10.0)
    assert parse_levels("0s,1s:3s:3,10s", "--latency", parse_time_s) == (0.0, 1.0, 2.0, 3.0, 10.0)
    assert parse_levels("off,full", "--autonomy", word) == ("off", "full")
    assert parse_levels("380bps", "--uplink", parse_rate_bps) == (380.0,)


def test_points_of_ranges():
    assert spaced(Range(1000.0, 4000.0, 4)) == (1000.0, 2000.0, 3000.0, 4000.0)
    assert spaced(Range(1.0, 1000.0, 4, "log")) == (1.0, 10.0, 100.0, 1000.0)
    assert spaced(Range(2, 6, 3)) == (2, 4, 6)
    assert all(isinstance(v, int) for v in spaced(Range(2, 7, 3)))
    assert spaced(Range(0.0, 0.3, 4)) == (0.0, 0.1, 0.2, 0.3)


@given(st.floats(1e-3, 1e3), st.floats(1.001, 1e4), st.integers(2, 40), st.sampled_from(["lin", "log"]))
def test_a_range_keeps_its_ends_and_rises(low, ratio, points, scale):
    found = spaced(Range(low, low * ratio, points, scale)) if ratio > 1.0 + 1e-6 * points else (low, low * ratio)
    assert (found[0], found[-1]) == (low, low * ratio)
    assert all(b > a for a, b in pairwise(found))


@pytest.mark.parametrize(
    "text",
    ["", "1kbps:", "1kbps:4kbps:x", "1kbps:4kbps:3:cubic", "1kbps:4kbps:3:log:9", "4kbps:1kbps:3", "1kbps:4kbps:1"],
)
def test_what_is_no_list_and_no_range_is_refused(text):
    with pytest.raises(BadInput):
        parse_levels(text, "--uplink", parse_rate_bps)


@pytest.mark.parametrize("text", ["off:full:3", "off,off"])
def test_words_make_no_range_and_come_once(text):
    with pytest.raises(BadInput):
        parse_levels(text, "--autonomy", word)


@pytest.mark.parametrize("text", ["0:10:3:log", "1:3:5"])
def test_a_range_that_has_no_such_points_is_refused(text):
    with pytest.raises(BadInput):
        parse_levels(text, "--boxes", whole)


def test_a_range_without_points_makes_no_grid_but_a_cube():
    factor = Factor("latency_s", Range(0.0, 10.0))
    with pytest.raises(BadInput, match=r"latency_s: .*\n.*0:10:4"):
        full_grid([factor])
    assert len(latin_hypercube([factor], 5, np.random.default_rng(0))) == 5


def test_a_full_grid_is_every_combination_in_order():
    cells = full_grid([Factor("rate_bps", (64.0, 380.0)), Factor("autonomy", WORDS)])
    assert len(cells) == 8
    assert cells[1] == {"rate_bps": 64.0, "autonomy": "low"}
    assert len({tuple(c.values()) for c in cells}) == 8
    assert grid_levels(Factor("autonomy", WORDS)) == WORDS


@given(st.integers(1, 60), st.integers(0, 100))
def test_a_latin_hypercube_has_one_cell_in_each_part(cells, seed):
    factors = [Factor("rate_bps", Range(64.0, 4000.0, scale="log")), Factor("delay_s", Range(0.0, 10.0))]
    found = latin_hypercube(factors, cells, np.random.default_rng(seed))
    rates = sorted(math.log(float(c["rate_bps"]) / 64.0) / math.log(4000.0 / 64.0) for c in found)
    delays = sorted(float(c["delay_s"]) / 10.0 for c in found)
    for places in (rates, delays):
        # Values are rounded to nine digits: a point within 1e-8 of a border may cross it.
        assert all(i / cells - 1e-8 <= u <= (i + 1) / cells + 1e-8 for i, u in enumerate(places))


def test_a_list_gets_equal_shares_of_a_hypercube():
    found = latin_hypercube([Factor("autonomy", WORDS), Factor("x", Range(0.0, 1.0))], 20, np.random.default_rng(1))
    assert [sum(c["autonomy"] == w for c in found) for w in WORDS] == [5] * 4


def test_a_sobol_sequence_fills_every_dyadic_box():
    # A property of the sequence: of 16 points in two dimensions one lies in each box of 1/4 by 1/4.
    factors = [Factor("x", Range(0.0, 1.0)), Factor("y", Range(0.0, 1.0))]
    found = sobol_cells(factors, 16, np.random.default_rng(2))
    boxes = {(int(4 * float(c["x"])), int(4 * float(c["y"]))) for c in found}
    assert len(boxes) == 16
    with pytest.raises(BadInput, match="Give 8 or 16"):
        sobol_cells(factors, 12, np.random.default_rng(2))
    assert len(sobol_cells(factors, 1, np.random.default_rng(2))) == 1


def test_places_of_lists_reach_both_ends():
    assert [at(("a", "b", "c"), u) for u in (0.0, 1 / 3, 2 / 3, 1.0)] == ["a", "b", "c", "c"]
    assert at(("a", "b", "c"), np.nextafter(2 / 3, 0.0)) == "c"


@pytest.mark.parametrize("factors", [[], [Factor("x", (1,)), Factor("x", (2,))]], ids=["no factor", "two of a name"])
def test_a_design_needs_factors_with_names_of_their_own(factors):
    for make in (full_grid, lambda f: latin_hypercube(f, 3, np.random.default_rng(0))):
        with pytest.raises(BadInput):
            make(factors)


def test_factors_have_values():
    for levels in ((), (1, 1)):
        with pytest.raises(BadInput):
            Factor("x", levels)
    with pytest.raises(BadInput):
        latin_hypercube([Factor("x", Range(0.0, 1.0))], 0, np.random.default_rng(0))


CUBE = [Factor(name, Range(-math.pi, math.pi)) for name in ("x1", "x2", "x3")]


def ishigami(unit):
    x1, x2, x3 = (-math.pi + 2.0 * math.pi * unit).T
    return np.sin(x1) + 7.0 * np.sin(x2) ** 2 + 0.1 * x3**4 * np.sin(x1)


def test_sobol_indices_of_ishigami_are_its_closed_form():
    # Ishigami and Homma, Proc. ISUMA (1990), 398-403: with a = 7, b = 0.1.
    a, b = 7.0, 0.1
    v1, v2 = (1 + b * math.pi**4 / 5) ** 2 / 2, a**2 / 8
    v13 = b**2 * math.pi**8 * (1 / 18 - 1 / 50)
    total = v1 + v2 + v13
    found = sobol_analyse(CUBE, ishigami(sobol_design(CUBE, 2048, 1)), 1)
    assert found["factor"].tolist() == ["x1", "x2", "x3"]
    # Twice the half widths that the bootstrap gives at 2,048.
    assert (found["first_half"] < 0.06).all()
    assert found["first"].tolist() == pytest.approx([v1 / total, v2 / total, 0.0], abs=0.04)
    assert found["total"].tolist() == pytest.approx([(v1 + v13) / total, v2 / total, v13 / total], abs=0.04)


def test_morris_of_a_linear_function_is_its_slopes():
    slopes = np.array([3.0, -2.0, 0.0])
    unit = morris_design(CUBE, 10, 4)
    assert unit.shape == (40, 3)
    found = morris_analyse(CUBE, unit, unit @ slopes, 4)
    assert found["mu"].tolist() == pytest.approx([3.0, -2.0, 0.0], abs=1e-12)
    assert found["mu_star"].tolist() == pytest.approx([3.0, 2.0, 0.0], abs=1e-12)
    assert found["sigma"].tolist() == pytest.approx([0.0] * 3, abs=1e-12)


def test_each_step_of_a_morris_trajectory_moves_one_factor():
    unit = morris_design(CUBE, 10, 4).reshape(10, 4, 3)
    moved = np.diff(unit, axis=1)
    assert ((np.abs(moved) > 1e-9).sum(axis=2) == 1).all()
    # Four levels: steps of 2/3 (Morris 1991: p / (2 (p - 1))).
    assert np.abs(moved).max(axis=2) == pytest.approx(np.full((10, 3), 2 / 3))


def test_sensitivities_take_lists_and_logarithms():
    factors = [Factor("rate_bps", Range(64.0, 4000.0, scale="log")), Factor("autonomy", WORDS)]
    unit = morris_design(factors, 20, 1)
    cells = cells_at(factors, unit)
    assert {c["autonomy"] for c in cells} == set(WORDS)
    time_s = [1e5 / float(c["rate_bps"]) + (0.0 if c["autonomy"] == "full" else 1.0) for c in cells]
    effects = morris_analyse(factors, unit, time_s, 1)
    assert effects["mu_star"][0] > effects["mu_star"][1] > 0.0


def told_of_seed_nought():
    factors = [Factor(name, Range(0.0, 1.0)) for name in "ab"]
    unit, steps = sobol_design(factors, 8, 0), morris_design(factors, 4, 0)
    sobol = sobol_analyse(factors, unit[:, 0] + unit[:, 1] ** 2, 0)
    morris = morris_analyse(factors, steps, steps[:, 0] * steps[:, 1], 0)
    return "\n".join(str(a.tolist()) for a in (unit, steps, sobol.to_numpy(), morris.to_numpy()))


def test_seed_nought_is_a_seed_in_any_process():
    # SALib takes a number 0 for no seed at all.
    code = (
        f"import importlib.util as u; s = u.spec_from_file_location('designs', {__file__!r})\n"
        "m = u.module_from_spec(s); s.loader.exec_module(m); print(m.told_of_seed_nought())\n"
    )
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert other.stdout.strip() == told_of_seed_nought()


def test_outputs_that_fit_no_design_are_refused():
    unit = morris_design(CUBE, 3, 0)
    with pytest.raises(BadInput, match="for 12 places"):
        morris_analyse(CUBE, unit, np.zeros(11), 0)
    with pytest.raises(BadInput, match="not finite"):
        morris_analyse(CUBE, unit, np.full(12, np.nan), 0)
    with pytest.raises(BadInput, match="alike"):
        sobol_analyse(CUBE, np.ones(40), 0)
    with pytest.raises(BadInput):
        sobol_analyse(CUBE, np.arange(7.0), 0)
    for base in (0, 12):
        with pytest.raises(BadInput):
            sobol_design(CUBE, base, 0)
    with pytest.raises(BadInput):
        morris_design([], 3, 0)
