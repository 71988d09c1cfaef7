"""Units at the edge: text to SI and back, and nothing but BadInput for anything else."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.core.errors import BadInput
from teleop_sim.core.units import RATE_UNITS, TIME_UNITS, format_rate, format_time, parse_rate_bps, parse_time_s

# Far from the ends of a double, so that no unit over- or underflows.
numbers = st.floats(1e-290, 1e290)
blanks = st.sampled_from(["", " ", "  "])


def any_case(unit: str) -> st.SearchStrategy[str]:
    return st.sampled_from([unit, unit.upper(), unit.capitalize()])


@given(numbers, st.sampled_from(sorted(RATE_UNITS)).flatmap(lambda u: st.tuples(st.just(u), any_case(u))), blanks)
def test_a_rate_is_its_number_times_its_unit(number, unit, blank):
    known, written = unit
    # repr gives every double back; one product, rounded once.
    assert parse_rate_bps(f"{number!r}{blank}{written}", "--uplink") == number * RATE_UNITS[known]


@given(numbers, st.sampled_from(sorted(TIME_UNITS)), blanks)
def test_a_time_is_its_number_times_its_unit(number, unit, blank):
    assert parse_time_s(f"{blank}{number!r}{unit}", "--latency") == number * TIME_UNITS[unit]


@pytest.mark.parametrize(
    ("text", "rate_bps"), [("380bps", 380.0), ("4kbps", 4000.0), ("0.38Mbps", 380_000.0), ("1_000 bit/s", 1000.0)]
)
def test_rates_as_people_write_them(text, rate_bps):
    assert parse_rate_bps(text, "x") == rate_bps


@pytest.mark.parametrize(("text", "time_s"), [("250ms", 0.25), ("3 min", 180.0), ("40µs", 40e-6), ("0s", 0.0)])
def test_times_as_people_write_them(text, time_s):
    # One product, rounded once.
    assert parse_time_s(text, "x") == pytest.approx(time_s, rel=1e-15)


@pytest.mark.parametrize("text", ["", "380", "bps", "1_bps", "1__0bps", "_1bps", "380 furlongs", "1e400bps", "nanbps"])
def test_what_is_no_rate_is_refused_with_an_example(text):
    with pytest.raises(BadInput) as refused:
        parse_rate_bps(text, "--uplink")
    (problem,) = refused.value.problems
    assert problem.where == "--uplink"
    assert "380bps" in problem.hint


@pytest.mark.parametrize(
    ("parse", "text"), [(parse_rate_bps, "0bps"), (parse_rate_bps, "-4kbps"), (parse_time_s, "-1s")]
)
def test_a_rate_of_nothing_and_a_negative_time_are_refused(parse, text):
    with pytest.raises(BadInput, match=text):
        parse(text, "x")


@given(st.text(max_size=12))
def test_any_text_is_a_quantity_or_bad_input(text):
    for parse in (parse_rate_bps, parse_time_s):
        try:
            value = parse(text, "x")
        except BadInput:
            continue
        assert math.isfinite(value)
        assert value >= 0.0


@given(st.floats(1.0, 1e12))
def test_a_formatted_rate_reads_back_to_four_digits(rate_bps):
    number, unit = format_rate(rate_bps).split(" ")
    assert "e" not in number
    scale = {"bit/s": 1.0, "kbit/s": 1e3, "Mbit/s": 1e6, "Gbit/s": 1e9}[unit]
    # Half a unit of the fourth digit.
    assert float(number) * scale == pytest.approx(rate_bps, rel=0.0005)


@given(st.floats(1e-6, 119.0))
def test_a_formatted_time_reads_back_to_three_digits(time_s):
    text = format_time(time_s)
    assert "e" not in text.replace("e-", "")
    # Half a unit of the third digit.
    assert parse_time_s(text, "x") == pytest.approx(time_s, rel=0.005)


@given(st.integers(120, 10**6))
def test_long_times_are_minutes_and_seconds(time_s):
    minutes, _, seconds = format_time(float(time_s)).partition(" min")
    assert 60 * int(minutes) + int(seconds.strip().removesuffix(" s") or 0) == time_s
    assert bool(seconds) == bool(time_s % 60)


@pytest.mark.parametrize("no_time", [math.nan, math.inf])
def test_no_time_is_never(no_time):
    assert format_time(no_time) == "never"
