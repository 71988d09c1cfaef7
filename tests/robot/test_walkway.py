"""The finish detector on clouds cast in the real scene of task 1, and its parts on small maps."""

import itertools
import math
from collections import deque

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.core.streams import stream
from teleop_sim.robot.perception import gridpath, lidar, walkway
from teleop_sim.world import dish_layout as lay
from teleop_sim.world.console import SQUARE_M
from teleop_sim.world.dish import add_dish_world
from teleop_sim.world.dish_draw import DishSettings, draw_dish_world

HEAD_M = 1.7
START = (0.0, 0.0, 0.0)


class World:
    """A drawn world and where the robot stands after it worked on the console."""

    def __init__(self, layout_id, seed):
        self.drawn = draw_dish_world(lambda name: stream(seed, 0, name), DishSettings(layout_id=layout_id))
        spec = mujoco.MjSpec()
        add_dish_world(spec, self.drawn)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self.rng = stream(seed, layout_id, "test.lidar")
        # 0.6 m before the wheels and up to 0.3 m aside, then two strides of 0.25 m back.
        self.stance = lay.compose(self.drawn.console, (-0.6, float(self.rng.uniform(-0.3, 0.3)), 0.0))
        self.back = lay.compose(self.stance, (-0.5, 0.0, float(self.rng.normal(0.0, 0.03))))
        self.visited = (START, self.stance)

    def turned(self, turn_deg):
        return (*self.back[:2], self.back[2] + math.radians(turn_deg))

    def sweep(self, here, pitch_rad):
        """Half a turn of the LIDAR from head height: 157 scans of 1081 rays over 270 degrees, 1 cm noise."""
        c, s, p, q = math.cos(here[2]), math.sin(here[2]), math.cos(pitch_rad), math.sin(pitch_rad)
        head = np.array([[c * p, -s, c * q], [s * p, c, s * q], [-q, 0.0, p]])
        eye, ways = np.array([here[0], here[1], HEAD_M]), lidar.half_turn_directions() @ head.T
        n = len(ways)
        geoms, away = np.empty(n, np.int32), np.empty(n)
        mujoco.mj_multiRay(self.model, self.data, eye, ways.ravel(), None, 1, -1, geoms, away, None, n, 30.0)
        hit = away > 0.1
        return eye + ways[hit] * (away[hit] + self.rng.normal(0.0, 0.01, hit.sum()))[:, None]

    def off(self, fix):
        return math.dist(fix.centre[:2], self.drawn.finish[:2])

    def clearance(self, path, here):
        """Least distance from the way to the walkway's edge [m], sampled every 5 cm."""
        points = np.array([here[:2], *(pose[:2] for pose in path)])
        fine = np.concatenate([np.linspace(a, b, 40) for a, b in itertools.pairwise(points)])
        # The robot starts where it stands, which may be nearer to an edge than it walks.
        fine = fine[np.hypot(*(fine - here[:2]).T) > 0.4]
        steps = np.arange(-0.6, 0.61, 0.05)
        ring = np.array([(a, b) for a in steps for b in steps])
        probe = (fine[:, None] + ring).reshape(-1, 2)
        on = np.zeros(len(probe), bool)
        for slab in lay.layout(self.drawn.layout_id).slabs:
            c, s = math.cos(slab.pose[2]), math.sin(slab.pose[2])
            d = probe - slab.pose[:2]
            u, v = d @ (c, s), d @ (-s, c)
            on |= (np.abs(u) <= slab.half_along_m) & (np.abs(v) <= slab.half_across_m)
        away = np.tile(np.hypot(*ring.T), len(fine))[~on]
        return float(away.min()) if len(away) else math.inf


def sees_finish(world, turn_deg):
    """Whether the finish's centre is out of the LIDAR's blind cone, 45 degrees round its back, with room to spare."""
    here = world.turned(turn_deg)
    u, v, _ = lay.compose(lay.inverse(here), world.drawn.finish)
    return abs(math.atan2(v, u)) < math.radians(100.0)


def check(layout_id, seed, turn_deg):
    world = World(layout_id, seed)
    here = world.turned(turn_deg)
    fix, why = walkway.find_finish(world.sweep(here, 0.2 * (seed % 3)), here, world.visited)
    if fix is None:
        assert not sees_finish(world, turn_deg), why
        return None
    # The finish is 3.05 m wide: half a metre off the robot still stands well inside.
    assert world.off(fix) < 0.5
    # 0.35 m by design; cells of 5 cm and closing of 15 cm blur an edge by up to a cell.
    assert world.clearance(fix.path, here) > 0.3
    assert lay.inside(world.drawn.finish, SQUARE_M - 1.0, *fix.path[-1][:2])
    return world.off(fix)


@pytest.mark.parametrize("layout_id", lay.LAYOUT_IDS)
@pytest.mark.parametrize("turn_deg", [-90, 90, 180])
def test_the_finish_is_found_when_it_can_be_seen_and_never_elsewhere(layout_id, turn_deg):
    check(layout_id, 1 + layout_id, turn_deg)


@pytest.mark.slow
@pytest.mark.parametrize("layout_id", lay.LAYOUT_IDS)
@pytest.mark.parametrize("turn_deg", [-90, 0, 90, 180])
def test_study_ten_seeds(layout_id, turn_deg):
    errors = [check(layout_id, seed, turn_deg) for seed in range(10)]
    assert turn_deg != 180 or None not in errors


def test_a_turn_to_the_way_back_shows_every_finish():
    for layout_id in lay.LAYOUT_IDS:
        assert check(layout_id, 0, 180) is not None


def test_several_sweeps_together_do_as_well_and_give_the_same_twice():
    world = World(4, 2)
    here = world.turned(180)
    points = np.vstack([world.sweep(START, 0.3), world.sweep(world.stance, 0.5), world.sweep(here, 0.2)])
    first, second = (walkway.find_finish(points, here, world.visited) for _ in range(2))
    assert first == second
    assert first[0] is not None
    assert world.off(first[0]) < 0.3


def test_the_start_square_is_not_the_finish():
    world = World(2, 3)
    # From the start square only that square is near and whole: forgetting the start would find it.
    cloud = world.sweep((1.0, 0.0, math.pi), 0.3)
    cloud = cloud[cloud[:, 0] < 2.5]
    far = ((3.0, 0.0, 0.0),)
    here = (2.2, 0.0, math.pi)
    forgot, _ = walkway.find_finish(cloud, here, far)
    assert forgot is not None
    assert math.dist(forgot.centre[:2], lay.START[:2]) < 0.3
    assert walkway.find_finish(cloud, here, (START,)) == (None, "no unvisited square of walkway seen")


def test_nothing_seen_is_nothing_found():
    assert walkway.find_finish(np.empty((0, 3)), START, (START,)) == (None, "no unvisited square of walkway seen")


def test_a_square_beyond_a_gap_has_no_way():
    x, y = np.meshgrid(np.arange(2.5, 5.548, 0.03), np.arange(-1.524, 1.524, 0.03))
    square = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=-1)
    x, y = np.meshgrid(np.arange(-2.0, 2.4, 0.03), np.arange(-2.0, 2.0, 0.03))
    soil = np.stack([x.ravel(), y.ravel(), np.full(x.size, -0.1)], axis=-1)
    found = walkway.find_finish(np.vstack([square, soil]), START, (START,))
    assert found == (None, "no way over the walkway to the square")


MASKS = st.lists(st.lists(st.booleans(), min_size=9, max_size=9), min_size=9, max_size=9).map(np.array)


@settings(deadline=None)
@given(MASKS, st.floats(1.0, 4.0))
def test_widen_is_every_cell_within_the_radius(mask, radius):
    i, j = np.indices(mask.shape)
    expected = np.zeros_like(mask)
    for a, b in np.argwhere(mask):
        expected |= (i - a) ** 2 + (j - b) ** 2 <= int(radius * radius)
    assert (gridpath.widen(mask, radius) == expected).all()


def reachable(free, start):
    seen, todo = {start}, deque([start])
    while todo:
        i, j = todo.popleft()
        for cell in ((i + a, j + b) for a in (-1, 0, 1) for b in (-1, 0, 1)):
            if 0 <= cell[0] < 9 and 0 <= cell[1] < 9 and free[cell] and cell not in seen:
                seen.add(cell)
                todo.append(cell)
    return seen


@settings(max_examples=50, deadline=None)
@given(MASKS)
def test_a_way_is_found_exactly_if_there_is_one_and_stays_free(free):
    free[0, 0] = free[8, 8] = True
    way = gridpath.search(free, (0, 0), (8, 8))
    assert (way is not None) == ((8, 8) in reachable(free, (0, 0)))
    if way is not None:
        assert all(free[cell] for cell in way)
        assert all(max(abs(a - c), abs(b - d)) == 1 for (a, b), (c, d) in itertools.pairwise(way))
        short = gridpath.shorten(free, way)
        assert (short[0], short[-1]) == ((0, 0), (8, 8))
        assert all(free[cell] for cell in short)


def test_search_is_as_long_as_the_straight_diagonal_on_open_ground():
    way = gridpath.search(np.ones((30, 30), bool), (0, 0), (29, 10))
    assert way is not None
    length = sum(math.dist(a, b) for a, b in itertools.pairwise(way))
    # Octile distance: 10 diagonal and 19 straight steps.
    assert length == pytest.approx(10 * math.sqrt(2.0) + 19)
    assert gridpath.shorten(np.ones((30, 30), bool), way) == [(0, 0), (29, 10)]
