"""Footsteps and plans: geometry and closed forms."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.robot import gait as g
from teleop_sim.robot import law
from teleop_sim.robot.footsteps import STILL_M

GAIT = g.Gait()
FEET = ((0.0, 0.13, 0.0), (0.0, -0.13, 0.0))
places = st.floats(-5.0, 5.0)
angles = st.floats(-3.1, 3.1)


@given(st.lists(st.tuples(places, places, angles), min_size=1, max_size=4), angles)
def test_a_walk_ends_at_its_goal_with_both_feet_together(path, yaw):
    bodies = g.walk_bodies((0.0, 0.0, yaw), path, GAIT)
    steps = g.steps_along(bodies, g.LEFT, GAIT)
    if not steps:
        return
    last = {step.foot: step for step in steps[-2:]}
    assert set(last) == {g.LEFT, g.RIGHT}
    x, y, turn = g.body_between([(last[i].x, last[i].y, last[i].yaw) for i in (g.LEFT, g.RIGHT)])
    # Legs shorter than 2 cm are not walked.
    assert np.hypot(x - path[-1][0], y - path[-1][1]) < 0.02 + 1e-9
    assert g.wrap(turn - path[-1][2]) == pytest.approx(0.0, abs=1e-9)


@given(st.lists(st.tuples(places, places, angles), min_size=1, max_size=4), angles)
def test_no_step_is_longer_or_turns_further_than_the_gait_allows(path, yaw):
    bodies = [(0.0, 0.0, yaw), *g.walk_bodies((0.0, 0.0, yaw), path, GAIT)]
    for a, b in pairwise(bodies):
        assert np.hypot(b[0] - a[0], b[1] - a[1]) <= GAIT.stride_m + 1e-9
        assert abs(b[2] - a[2]) <= GAIT.turn_rad + 1e-9


@given(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6))
def test_a_shift_moves_the_stance_by_what_was_asked(forward_m, left_m):
    bodies = g.shift_bodies((1.0, 2.0, np.pi / 2), forward_m, left_m, GAIT, 0.05)
    assert bool(bodies) == (np.hypot(forward_m, left_m) >= STILL_M)
    if bodies:
        assert bodies[-1] == pytest.approx((1.0 - left_m, 2.0 + forward_m, np.pi / 2 + 0.05), abs=1e-9)


@given(st.floats(-0.199, 0.199), st.floats(0.5, 3.0))
def test_a_small_turn_at_the_end_of_a_walk_takes_no_step_of_its_own(turn_rad, far_m):
    # Without the bound a rounding error at the goal's heading took two steps.
    straight = g.walk_bodies((0.0, 0.0, 0.0), [(far_m, 0.0, 0.0)], GAIT)
    turned = g.walk_bodies((0.0, 0.0, 0.0), [(far_m, 0.0, turn_rad)], GAIT)
    assert len(turned) == len(straight)
    assert turned[-1] == pytest.approx((far_m, 0.0, turn_rad), abs=1e-9)


@given(st.floats(0.2, 2.8), st.floats(-0.2, 0.2))
def test_where_a_path_bends_does_not_change_how_many_steps_it_takes(bend_m, aside_m):
    path = [(bend_m, aside_m, 0.0), (3.0, 0.0, 0.0)]
    bends = np.abs([np.arctan2(aside_m, bend_m), np.arctan2(aside_m, 3.0 - bend_m)])
    if bends.max() > GAIT.turn_walking_rad or bends.sum() > 3 * GAIT.turn_walking_rad:
        return
    length_m = np.hypot(bend_m, aside_m) + np.hypot(3.0 - bend_m, aside_m)
    bodies = g.walk_bodies((0.0, 0.0, 0.0), path, GAIT)
    assert len(bodies) == int(np.ceil(length_m / GAIT.stride_m - 1e-9))
    # All of them on the path.
    for x, y, _ in bodies:
        along = bend_m if x <= bend_m else bend_m - 3.0
        assert y == pytest.approx(aside_m * (x if x <= bend_m else x - 3.0) / along, abs=1e-9)


def test_a_turn_that_feet_cannot_make_takes_no_step():
    assert g.turn_bodies((0.0, 0.0, 0.0), 0.009, GAIT) == []
    assert len(g.turn_bodies((0.0, 0.0, 0.0), -0.011, GAIT)) == 2


def test_the_reference_dcm_solves_the_pendulum_between_ticks():
    rng = np.random.default_rng(3)
    zmp, omega, tick_s = rng.normal(size=(50, 2)), 3.1, 0.02
    xi = g.reference_dcm(zmp, omega, tick_s)
    # Closed form of xi' = omega (xi - z) over one tick, forwards.
    forwards = zmp[:-1] + (xi[:-1] - zmp[:-1]) * np.exp(omega * tick_s)
    assert forwards == pytest.approx(xi[1:], abs=1e-12)
    assert xi[-1] == pytest.approx(zmp[-1], abs=1e-12)


def test_a_plan_keeps_the_zmp_under_the_feet_and_ends_at_rest_between_them():
    steps = g.steps_along(g.walk_bodies((0.0, 0.0, 0.0), [(1.2, 0.0, 0.0)], GAIT), g.RIGHT, GAIT)
    plan = g.make_plan(FEET, np.zeros(2), 1.03, 0.0, steps, GAIT, 0.02)
    rows = plan.rows
    for i in (0, 1):
        alone = rows[:, law.STANCE] == i
        foot = rows[alone][:, law.FOOT + 12 * i : law.FOOT + 12 * i + 2]
        assert rows[alone][:, law.ZMP : law.ZMP + 2] == pytest.approx(foot, abs=1e-12)
    assert rows[-1, law.ZMP : law.ZMP + 2] == pytest.approx([1.2, 0.0], abs=1e-9)
    assert rows[-1, law.XI : law.XI + 2] == pytest.approx([1.2, 0.0], abs=1e-9)
    assert len(plan.step_ends) == len(steps)


def test_a_plan_begins_where_the_body_is():
    steps = g.steps_along(g.walk_bodies((0.0, 0.0, 0.0), [(1.2, 0.0, 0.0)], GAIT), g.RIGHT, GAIT)
    com = np.array([0.004, -0.003])
    plan = g.make_plan(FEET, com, 1.03, 0.0, steps, GAIT, 0.02)
    assert plan.rows[0, law.XI : law.XI + 2] == pytest.approx(com, abs=1e-12)
    # To fall towards the standing foot the body first pushes off the other; both soles are 13 cm aside.
    assert np.abs(plan.rows[:, law.ZMP + 1]).max() <= 0.13 + 1e-9


def test_a_swing_foot_starts_and_ends_still_and_on_the_ground():
    steps = (g.Footstep(g.LEFT, 0.3, 0.13, 0.2),)
    rows = g.make_plan(FEET, np.zeros(2), 1.03, 0.0, steps, GAIT, 0.02).rows
    swing = rows[rows[:, law.STANCE] == g.RIGHT]
    heights, speeds = swing[:, law.FOOT + 2], swing[:, law.FOOT + 3 : law.FOOT + 6]
    # The quintic is flat to third order at both ends: within one tick of 35 less than a millimetre.
    assert max(heights[0], heights[-1]) < 1e-3
    assert heights.max() == pytest.approx(GAIT.lift_m, abs=2e-3)
    assert np.abs(speeds[[0, -1]]).max() < 0.05
