"""The schedule arithmetic against closed forms and against stepping through time."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.channel.blackouts import Schedule, dark_between, finish_of, first_light, schedule_problems


@st.composite
def schedules(draw: st.DrawFn) -> Schedule:
    """Up to six windows, with touching ones; the last may never end."""
    t = 0.0
    windows = []
    for gap, length in draw(st.lists(st.tuples(st.integers(0, 40), st.integers(1, 40)), max_size=6)):
        windows.append((t + gap / 4, t + gap / 4 + length / 4))
        t = windows[-1][1]
    if windows and draw(st.booleans()):
        windows[-1] = (windows[-1][0], math.inf)
    return tuple(windows)


def stepped_finish(start_s: float, bits: int, rate_bps: float, blackouts: Schedule) -> float:
    """Bit by bit, a bit in quarter-second ticks: rate 4 bit/s and quarters make it exact."""
    t, left = start_s, bits
    while left:
        if t > 1e3:
            return math.inf
        if not any(a <= t < b for a, b in blackouts):
            left -= 1
        t += 1 / rate_bps
    return t


@given(st.integers(0, 200), st.integers(1, 80), schedules())
def test_finish_equals_stepping_bit_by_bit(start, bits, blackouts):
    assert finish_of(start / 4, bits, 4.0, blackouts) == stepped_finish(start / 4, bits, 4.0, blackouts)


@given(st.integers(0, 200), schedules())
def test_first_light_is_light_and_no_earlier_instant_is(start, blackouts):
    light = first_light(start / 4, blackouts)
    assert light >= start / 4
    assert not any(a <= light < b for a, b in blackouts)
    assert dark_between(start / 4, light, blackouts) == light - start / 4 or math.isinf(light)


@given(st.integers(0, 200), st.integers(0, 200), schedules())
def test_dark_time_equals_counting_quarters(start, length, blackouts):
    quarters = sum(any(a <= q / 4 < b for a, b in blackouts) for q in range(start, start + length))
    assert dark_between(start / 4, (start + length) / 4, blackouts) == quarters / 4


def test_nothing_is_paused_by_a_blackout_that_starts_as_the_last_bit_leaves():
    assert finish_of(0.0, 40, 4.0, ((10.0, 20.0),)) == 10.0
    assert finish_of(0.0, 41, 4.0, ((10.0, 20.0),)) == 20.25


def test_a_packet_offered_as_a_blackout_starts_waits_even_without_bits():
    assert first_light(10.0, ((10.0, 20.0),)) == 20.0
    assert finish_of(10.0, 0, 4.0, ((10.0, 20.0),)) == 20.0
    assert finish_of(20.0, 0, 4.0, ((10.0, 20.0),)) == 20.0


@pytest.mark.parametrize(
    ("blackouts", "count"),
    [
        ((), 0),
        (((0.0, math.inf),), 0),
        (((1.0, 2.0), (2.0, 3.0)), 0),
        (((2.0, 2.0),), 1),
        (((5.0, 2.0),), 1),
        (((-1.0, 2.0),), 1),
        (((math.nan, 2.0),), 1),
        (((1.0, math.nan),), 1),
        (((math.inf, math.inf),), 1),
        (((1.0, 3.0), (2.0, 4.0)), 1),
        (((5.0, 6.0), (1.0, 2.0)), 1),
        (((0.0, math.inf), (9.0, 8.0)), 2),
    ],
)
def test_every_problem_of_a_schedule_is_named(blackouts, count):
    problems = schedule_problems(blackouts, "link.up.blackouts")
    assert len(problems) == count
    assert all(p.where.startswith("link.up.blackouts[") and p.hint for p in problems)
