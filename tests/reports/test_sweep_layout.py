"""By which rule the figures of a sweep choose lines, axes, panels, and what they hold."""

from itertools import pairwise

import pytest

from teleop_sim.reports.sweep_draw import number, spaced
from teleop_sim.reports.sweep_layout import axes_of, held, left_out, middle, panels, spread
from teleop_sim.reports.sweep_view import bare, logarithmic, numeric, ordered, words

RATES = (64.0, 200.0, 380.0, 1000.0, 4000.0)
DELAYS = (0.0, 2.0, 5.0, 10.0, 20.0)


def test_autonomy_is_compared_before_anything_else(make_sweep):
    sweep = make_sweep({"robot": ("atlas", "valkyrie"), "autonomy": ("full", "off"), "latency_s": DELAYS})
    assert (sweep.compared, sweep.link) == ("autonomy", ("latency_s", "robot"))
    assert sweep.levels["autonomy"] == ("off", "full")


@pytest.mark.parametrize(
    ("axes", "compared"),
    [
        ({"latency_s": DELAYS}, ""),
        ({"uplink_bps": RATES, "latency_s": DELAYS}, "latency_s"),
        ({"latency_s": DELAYS, "world.layout": (1, 2)}, "world.layout"),
        ({"latency_s": DELAYS, "preset": ("moon", "mars-near")}, "preset"),
        ({"latency_s": DELAYS, "autonomy": ("full",)}, ""),
        ({"latency_s": tuple(range(9)), "loss": tuple(n / 10 for n in range(9))}, ""),
        ({}, ""),
    ],
)
def test_without_autonomy_the_first_words_or_the_last_few_values_are_compared(make_sweep, axes, compared):
    assert make_sweep(axes, replicates=2).compared == compared


def test_what_is_asked_for_is_compared(make_sweep):
    axes = {"latency_s": (0.0, 5.0), "autonomy": ("off", "full")}
    assert make_sweep(axes, choose="latency_s").compared == "latency_s"
    # One value is no choice.
    assert make_sweep(axes | {"loss": (0.0,)}, choose="loss").compared == "autonomy"


def test_the_link_comes_first_in_its_own_order_and_numbers_are_axes(make_sweep):
    sweep = make_sweep(
        {"expertise": (0.7, 1.0), "latency_s": DELAYS, "preset": ("a", "b"), "uplink_bps": RATES,
         "autonomy": ("off", "full")},
        replicates=1,
    )  # fmt: skip
    assert sweep.varying == ("uplink_bps", "latency_s", "preset", "expertise", "autonomy")
    assert axes_of(sweep) == ("uplink_bps", "latency_s", "expertise")
    assert axes_of(make_sweep({"preset": ("a", "b"), "autonomy": ("off", "full")})) == ("preset",)


def test_what_is_not_shown_is_held_at_the_scenarios_own_value_or_the_middle(make_sweep):
    axes = {"uplink_bps": RATES, "latency_s": DELAYS, "autonomy": ("off", "full")}
    sweep = make_sweep(axes, replicates=1, base={"uplink_bps": 200.0, "latency_s": 7.0})
    assert middle(sweep, "uplink_bps") == 200.0
    assert middle(sweep, "latency_s") == 5.0
    assert held(sweep, ("uplink_bps", "autonomy")) == {"latency_s": 5.0}


def test_panels_show_first_and_last_and_say_what_they_leave_out(make_sweep):
    sweep = make_sweep({"uplink_bps": RATES, "latency_s": DELAYS}, replicates=1)
    made = panels(sweep, sweep.runs, ("uplink_bps", "latency_s"), (2, 3))
    assert [p.title for p in made][:2] == [
        "uplink 64 bit/s, one-way delay 0 s",
        "uplink 64 bit/s, one-way delay 5 s",
    ]
    assert made[-1].title == "uplink 4 kbit/s, one-way delay 20 s"
    assert all(len(p.rows) == 1 for p in made)
    said = left_out(sweep, ("uplink_bps", "latency_s"), (2, 5))
    assert said == "Shown are 2 of 5 values of uplink, evenly chosen."


def test_spread_keeps_the_ends():
    assert spread(range(10), 4) == (0, 3, 6, 9)
    assert spread((1, 2), 4) == (1, 2)
    assert spread((1, 2, 3), 1) == (1,)


def test_values_are_ordered_as_people_expect():
    assert ordered(["full", "off", "low"]) == ("off", "low", "full")
    assert ordered([3, 1.5]) == (1.5, 3)
    assert ordered(["b", "a"]) == ("b", "a")
    assert not numeric((True,))


@pytest.mark.parametrize(
    ("values", "logs"),
    [(RATES, True), (DELAYS, False), (tuple(range(1, 40)), False), ((1.0, 100.0), True), ((5.0,), False), ((), False)],
)
def test_an_axis_is_logarithmic_where_its_values_are_even_so(values, logs):
    assert logarithmic(values) is logs


def test_words_have_their_unit():
    assert words("uplink_bps") == "uplink [bit/s]"
    assert words("link.up.delay_s") == "link.up.delay [s]"
    assert words("world.layout") == "world.layout"
    assert bare("latency_s") == "one-way delay"


def test_ticks_stand_apart_and_the_ends_are_there():
    assert spaced(RATES, logs=True) == [64.0, 380.0, 1000.0, 4000.0]
    shown = spaced(DELAYS, logs=False)
    assert (shown[0], shown[-1]) == (0.0, 20.0)
    assert all(b - a >= 20.0 / 6.0 for a, b in pairwise(shown))
    assert [number(v) for v in (0.0, 64.0, 1500.0, 2e6)] == ["0", "64", "1.5k", "2M"]


def test_a_design_that_fills_space_is_no_grid(make_sweep):
    assert make_sweep({"uplink_bps": RATES, "latency_s": DELAYS}, replicates=1).grid
    assert not make_sweep({"uplink_bps": RATES, "latency_s": DELAYS}, replicates=1, design="lhs:5").grid
    # A file may hold all combinations, too.
    both = {"loss": (0.0, 0.0, 0.1, 0.1), "autonomy": ("off", "full", "off", "full")}
    assert make_sweep(both, design="cells.csv").grid
