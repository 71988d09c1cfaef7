"""Changing rates against closed forms, against the one-rate arithmetic, and against their own inverse."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.channel import blackouts as one_rate
from teleop_sim.channel.blackouts import Schedule
from teleop_sim.channel.rates import RateSchedule, bits_between, finish_of, light_between, rate_at, rate_problems


@st.composite
def schedules(draw: st.DrawFn) -> Schedule:
    t = 0.0
    windows = []
    for gap_s, dark_s in draw(st.lists(st.tuples(st.floats(0.0, 10.0), st.floats(0.01, 10.0)), max_size=6)):
        windows.append((t + gap_s, t + gap_s + dark_s))
        t = windows[-1][1]
    if windows and draw(st.booleans()):
        windows[-1] = (windows[-1][0], math.inf)
    return tuple(windows)


@st.composite
def rate_schedules(draw: st.DrawFn) -> RateSchedule:
    t = 0.0
    rates = [(0.0, draw(st.floats(1.0, 1e6)))]
    for step_s, rate_bps in draw(st.lists(st.tuples(st.floats(0.01, 10.0), st.floats(1.0, 1e6)), max_size=6)):
        t += step_s
        rates.append((t, rate_bps))
    return tuple(rates)


times = st.floats(0.0, 60.0)


@given(times, st.floats(0.0, 1e6), rate_schedules(), schedules())
def test_finish_is_the_inverse_of_the_bits_that_fit(start_s, bits, rates, blackouts):
    finish_s = finish_of(start_s, bits, rates, blackouts)
    # The finish and the times of the schedules are doubles: some ten of them, each within its own resolution.
    last_s = finish_s if math.isfinite(finish_s) else 200.0
    rounding_bits = 10 * math.ulp(max(last_s, 1.0)) * max(rate for _, rate in rates)
    if math.isinf(finish_s):
        assert bits_between(start_s, math.inf, rates, blackouts) <= bits * (1 + 1e-9) + rounding_bits
        return
    assert bits_between(start_s, finish_s, rates, blackouts) == pytest.approx(bits, rel=1e-9, abs=rounding_bits)


@given(times, st.floats(0.0, 1e6), st.floats(1.0, 1e6) | st.just(math.inf), schedules())
def test_one_rate_is_the_one_rate_arithmetic_to_the_last_digit(start_s, bits, rate_bps, blackouts):
    assert finish_of(start_s, bits, ((0.0, rate_bps),), blackouts) == one_rate.finish_of(
        start_s, bits, rate_bps, blackouts
    )


@given(times, st.floats(0.0, 1e5), st.floats(1.0, 1e6), schedules(), st.lists(st.floats(0.1, 60.0), max_size=5))
def test_a_change_to_the_same_rate_changes_nothing(start_s, bits, rate_bps, blackouts, changes_s):
    rates = tuple((t_s, rate_bps) for t_s in sorted({0.0, *changes_s}))
    finish_s = finish_of(start_s, bits, rates, blackouts)
    plain_s = one_rate.finish_of(start_s, bits, rate_bps, blackouts)
    # A rest of rounding may fall on either side of a blackout: compare light time, not the clock.
    if math.isinf(finish_s) or math.isinf(plain_s):
        return
    between_s = light_between(min(finish_s, plain_s), max(finish_s, plain_s), blackouts)
    assert between_s == pytest.approx(0.0, abs=1e-9)


@given(times, st.floats(0.0, 60.0), st.floats(0.0, 60.0), rate_schedules(), schedules())
def test_bits_add_up_over_adjoining_spans(a_s, first_s, second_s, rates, blackouts):
    b_s, c_s = a_s + first_s, a_s + first_s + second_s
    whole = bits_between(a_s, c_s, rates, blackouts)
    parts = bits_between(a_s, b_s, rates, blackouts) + bits_between(b_s, c_s, rates, blackouts)
    # 1e6 bit/s times some roundings of times below 200 s (3e-14 s).
    assert parts == pytest.approx(whole, rel=1e-9, abs=1e-6)


@given(times, st.floats(0.0, 1e6), st.floats(0.0, 1e6), rate_schedules(), schedules())
def test_more_bits_never_finish_earlier(start_s, few, more, rates, blackouts):
    few, more = sorted((few, more))
    early_s = finish_of(start_s, few, rates, blackouts)
    late_s = finish_of(start_s, more, rates, blackouts)
    assert start_s <= early_s
    # A rest of rounding may wait for the next light; 1e6 bits at 1 bit/s are known to some 1e-10 s.
    assert light_between(late_s, early_s, blackouts) <= 1e-9


def test_bits_out_stay_out_when_the_rate_changes():
    # 4 s at 8 bit/s are 32 bits; the other 32 of 64 take 16 s at 2 bit/s.
    assert finish_of(6.0, 64, ((0.0, 8.0), (10.0, 2.0))) == 26.0
    assert bits_between(6.0, 26.0, ((0.0, 8.0), (10.0, 2.0))) == 64.0


def test_a_rate_may_change_in_the_dark():
    # 2 s at 8 bit/s, dark from 2 to 8 s, the rate falls at 5 s: 16 bits remain and take 4 s at 4 bit/s.
    assert finish_of(0.0, 32, ((0.0, 8.0), (5.0, 4.0)), ((2.0, 8.0),)) == 12.0


def test_a_packet_that_ends_at_a_change_is_out():
    assert finish_of(0.0, 80, ((0.0, 8.0), (10.0, 1.0))) == 10.0
    assert finish_of(0.0, 80, ((0.0, 8.0), (10.0, 1.0)), ((10.0, 20.0),)) == 10.0


def test_drc_trials_halves():
    # IWL periodic26.py of 2013-12-03: 1 Mbit/s for 60 s, 100 kbit/s for 60 s; 66 Mbit fill exactly the first two.
    rates = tuple((60.0 * i, 1e5 if i % 2 else 1e6) for i in range(10))
    assert bits_between(0.0, 120.0, rates) == 66e6
    assert finish_of(0.0, 66e6, rates) == 120.0
    assert finish_of(0.0, 66e6 + 1e6, rates) == 121.0


def test_an_infinite_rate_takes_no_time_but_waits_for_light():
    rates = ((0.0, 10.0), (4.0, math.inf), (6.0, 10.0))
    assert finish_of(4.0, 1e9, rates) == 4.0
    assert finish_of(3.0, 30, rates) == 4.0
    assert finish_of(3.0, 30, rates, ((3.5, 5.0),)) == 5.0
    assert finish_of(3.0, 30, rates, ((3.5, 6.0),)) == 8.5
    assert bits_between(3.0, 6.0, rates, ((4.0, 6.0),)) == 10.0
    assert bits_between(3.0, 6.0, rates, ((4.0, 5.0),)) == math.inf


def test_endless_dark_after_some_light():
    rates = ((0.0, 8.0), (2.0, 4.0))
    assert bits_between(0.0, math.inf, rates, ((5.0, math.inf),)) == 28.0
    assert finish_of(0.0, 28, rates, ((5.0, math.inf),)) == 5.0
    assert finish_of(0.0, 29, rates, ((5.0, math.inf),)) == math.inf
    assert light_between(7.0, math.inf, ((5.0, math.inf),)) == 0.0


def test_the_rate_at_a_change_is_the_new_one():
    rates = ((0.0, 8.0), (2.0, 4.0))
    assert [rate_at(t, rates) for t in (0.0, 1.9, 2.0, 1e9)] == [8.0, 8.0, 4.0, 4.0]


@pytest.mark.parametrize(
    ("rates", "count"),
    [
        ((), 0),
        (((0.0, 1.0),), 0),
        (((0.0, 1.0), (5.0, math.inf)), 0),
        (((1.0, 1.0),), 1),
        (((math.nan, 1.0),), 1),
        (((0.0, 0.0),), 1),
        (((0.0, math.nan),), 1),
        (((0.0, 1.0), (0.0, 2.0)), 1),
        (((0.0, 1.0), (math.inf, 2.0)), 1),
        (((0.0, 1.0), (math.nan, 2.0)), 1),
        (((1.0, -1.0), (0.5, 0.0)), 4),
    ],
)
def test_every_problem_of_a_rate_schedule_is_named(rates, count):
    problems = rate_problems(rates, "link.up.rates")
    assert len(problems) == count
    assert all(p.where.startswith("link.up.rates[") and p.hint for p in problems)
