"""Occupancy from made-up clouds whose grid is known, and from a cast one."""

from __future__ import annotations

import numpy as np
import pytest

from teleop_sim.robot.commands import Cloud
from teleop_sim.robot.occupancy import CELL_M, HEAD_ROOM_M, LEVEL_M, STOOD_M, occupancy, widened
from teleop_sim.robot.perception import gridpath

EYE = (0.0, 0.0, 1.5)


def made(points, split_m=1.0, stood=()):
    return occupancy([Cloud(np.array(points, float), EYE)], (0.0, 0.0), 3.0, split_m, stood)


def cell_of(seen, x, y):
    return seen.grid.cell(x, y)


@pytest.mark.parametrize(
    ("z", "kind"),
    [
        (-LEVEL_M - 0.01, "drop"),
        (-LEVEL_M + 0.01, "free"),
        (LEVEL_M - 0.01, "free"),
        (LEVEL_M + 0.01, "legs"),
        (0.99, "legs"),
        (1.01, "arms"),
        (HEAD_ROOM_M - 0.01, "arms"),
        (HEAD_ROOM_M + 0.01, "unknown"),
    ],
)
def test_height_decides_what_a_cell_holds(z, kind):
    seen = made([(2.0, 0.5, z)] * 2)
    at = cell_of(seen, 2.0, 0.5)
    assert [name for name in ("legs", "arms", "drop", "free", "unknown") if getattr(seen, name)[at]] == [kind]


def test_one_stray_point_is_nothing():
    seen = made([(2.0, 0.5, 0.5)])
    assert seen.unknown[cell_of(seen, 2.0, 0.5)]


def test_a_beam_clears_what_it_passes_lower_than_a_foot_and_nothing_before_or_behind():
    # From 1.5 m down to 0 at 2 m: it is 0.3 m high at 1.6 m.
    seen = made([(2.0, 0.0, 0.0)] * 2)
    row = cell_of(seen, 0.0, 0.0)[1]
    free = [i for i in range(seen.grid.count) if seen.free[i, row] or seen.free[i, row - 1]]
    # The end's cell itself is floor; the beam is marked a cell at a time.
    assert seen.grid.centres(np.array([[free[0], row]]))[0, 0] == pytest.approx(1.6, abs=1.5 * CELL_M)
    assert seen.grid.centres(np.array([[free[-1], row]]))[0, 0] == pytest.approx(2.0, abs=CELL_M)
    assert len(free) == free[-1] - free[0] + 1


def test_the_ground_that_the_robot_stands_on_is_free_whatever_was_seen():
    seen = made([(0.2, 0.1, 0.5)] * 5, stood=((0.0, 0.0, 0.0),))
    assert seen.free[cell_of(seen, 0.2, 0.1)]
    assert not seen.legs.any()
    # Area of a disc, less than a cell's diagonal at its edge.
    edge = 2 * np.pi * STOOD_M * CELL_M
    assert seen.free.sum() * CELL_M**2 == pytest.approx(np.pi * STOOD_M**2, abs=edge)


def test_every_cell_is_of_one_kind_but_legs_and_arms():
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-3, 3, (20_000, 2)), rng.uniform(-0.2, 2.5, 20_000)])
    seen = made(points, stood=((1.0, 1.0, 0.0),))
    total = (seen.legs | seen.arms).astype(int) + (seen.drop & ~(seen.legs | seen.arms)) + seen.free + seen.unknown
    assert (total == 1).all()


def test_clouds_from_two_places_add_up():
    ahead, behind = Cloud(np.array([[1.0, 0.0, 0.0]] * 2), EYE), Cloud(np.array([[-1.0, 0.0, 0.0]] * 2), EYE)
    both = occupancy([ahead, behind], (0.0, 0.0), 2.0, 1.0)
    one, other = (occupancy([cloud], (0.0, 0.0), 2.0, 1.0) for cloud in (ahead, behind))
    assert (both.free == (one.free | other.free)).all()


@pytest.mark.parametrize("radius", [0.0, 1.0, 2.5, 7.3])
def test_widening_equals_the_distance_to_the_nearest_set_cell(radius):
    mask = np.random.default_rng(int(radius)).random((40, 33)) < 0.03
    mask[10:16, 8:20] = True
    cells = np.argwhere(mask)
    i, j = np.indices(mask.shape)
    away = np.min([np.hypot(i - a, j - b) for a, b in cells], axis=0)
    assert (widened(mask, radius) == (away <= radius)).all()
    assert (gridpath.widen(mask, radius) == widened(mask, radius)).all()
