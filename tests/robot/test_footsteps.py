"""The footstep planner against brute force, against the gait's limits, and in physics round a post."""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np
import pytest
from scipy import sparse

from teleop_sim.robot import footstep_guides as fast
from teleop_sim.robot import footstep_lattice as fl
from teleop_sim.robot import footstep_moves as fm
from teleop_sim.robot import footstep_planner as fp
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Cloud, Scan, Walk
from teleop_sim.robot.episode import NoiseKey, perform
from teleop_sim.robot.gait import LEFT, Gait, body_between, sole_place, walk_bodies, wrap
from teleop_sim.robot.occupancy import CELL_M, Occupancy
from teleop_sim.robot.perception.gridpath import Grid
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.route import is_clear, outline_of, plain_steps, survey
from teleop_sim.world import contact
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import Plant

NAMES = sorted(ROBOTS)
KEY = NoiseKey(1, 0, 1)
GAITS = {name: ROBOTS[name]().gait for name in NAMES}
# Feet only, and a robot with arms ahead of it.
BARE = fl.Outline((0.27, 0.16), 0.2, ((0.0, 0.0),), 0.1, 1.0)
ARMED = fl.Outline((0.27, 0.16), 0.25, ((0.0, 0.0), (0.35, 0.3), (0.35, -0.3)), 0.15, 1.0)


def ground(boxes=(), drops=(), half_m=4.0):
    """Seen ground: boxes (x, y, half side) stand on it from head to foot; nothing is unknown."""
    count = round(2 * half_m / CELL_M)
    grid = Grid(-half_m, -half_m, CELL_M, count)
    x, y = np.meshgrid(*(2 * [(np.arange(count) + 0.5) * CELL_M - half_m]), indexing="ij")
    masks = [np.zeros((count, count), bool), np.zeros((count, count), bool)]
    for mask, places in zip(masks, (boxes, drops), strict=True):
        for px, py, half in places:
            mask |= (np.abs(x - px) <= half) & (np.abs(y - py) <= half)
    return Occupancy(grid, masks[0], masks[0].copy(), masks[1], ~(masks[0] | masks[1]))


@dataclass
class Small:
    """A plan's problem, small enough for brute force."""

    seen: Occupancy
    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    gait: Gait
    outline: fl.Outline
    margin_m: float = 0.35

    def __post_init__(self):
        self.moves = fm.moves(self.gait)
        self.where = fl.lattice(self.start, self.goal, self.moves.cell_m, self.margin_m)
        self.masks = fl.blocked(self.seen, self.where, self.outline, 0.0)

    def plan(self, **more):
        return fp.plan_footsteps(
            self.seen, self.start, self.goal, self.gait, self.outline, 0.0, margin_m=self.margin_m, **more
        )

    def number(self, i, j, k, foot):
        return ((np.asarray(i) * self.where.shape[1] + j) * fm.BINS + k) * 2 + foot

    def graph(self):
        """All steps between all states, as a sparse matrix of costs; written without the planner's search."""
        ni, nj = self.where.shape
        step_s, cell_s = self.gait.swing_s + self.gait.transfer_s, fm.WAY_S_PER_M * self.moves.cell_m
        i, j = (axis.ravel() for axis in np.meshgrid(np.arange(ni), np.arange(nj), indexing="ij"))
        rows, columns, costs = [], [], []
        for foot in (0, 1):
            for k in range(fm.BINS):
                for di, dj, dk in self.moves.actions[foot, k, : self.moves.counts[foot, k]]:
                    to = (i + di, j + dj, (k + dk) % fm.BINS)
                    fine = self.sole_holds(*to, foot) & self.passes(i, j, k, di, dj, dk)
                    fine &= (to[0] >= 0) & (to[0] < ni) & (to[1] >= 0) & (to[1] < nj)
                    cost = step_s + cell_s * math.hypot(di, dj) + fm.TURN_S_PER_RAD * fm.BIN_RAD * abs(dk)
                    rows.append(self.number(i, j, k, 1 - foot)[fine])
                    columns.append(self.number(*to, foot)[fine])
                    costs.append(np.full(int(fine.sum()), cost))
        n = 2 * fm.BINS * ni * nj
        return sparse.csr_matrix((np.concatenate(costs), (np.concatenate(rows), np.concatenate(columns))), (n, n))

    def look(self, mask, i, j, outside):
        ni, nj = self.where.shape
        inside = (i >= 0) & (i < ni) & (j >= 0) & (j < nj)
        return np.where(inside, mask[np.clip(i, 0, ni - 1), np.clip(j, 0, nj - 1)], outside)

    def sole_holds(self, i, j, k, foot):
        at = sole_place((0.0, 0.0, k * fm.BIN_RAD), foot, self.gait.width_m)
        return ~self.look(
            self.masks.drops, i + round(at.x / self.moves.cell_m), j + round(at.y / self.moves.cell_m), True
        )

    def passes(self, i, j, k, di, dj, dk):
        n = max(1, *map(abs, (di, dj, dk)))
        free = np.ones(i.shape, bool)
        for s in range(1, n + 1):
            a, b, yaw = (math.floor(v * s / n + 0.5) for v in (di, dj, dk))
            free &= ~self.look(self.masks.legs, i + a, j + b, True)
            turn = (k + yaw) % fm.BINS * fm.BIN_RAD
            for x, y in self.outline.arms:
                u, v = math.cos(turn) * x - math.sin(turn) * y, math.sin(turn) * x + math.cos(turn) * y
                u, v = round(u / self.moves.cell_m), round(v / self.moves.cell_m)
                free &= ~self.look(self.masks.arms, i + a + u, j + b + v, False)
        return free

    def costs_to_goal(self, graph):
        goals = [int(self.number(*self.where.origin, 0, foot)) for foot in (0, 1)]
        return sparse.csgraph.dijkstra(graph.T.tocsr(), indices=goals).min(axis=0)

    def best(self, costs):
        """The optimum over the first steps that the planner may take."""
        seeds, first = fp._first_steps(self.where, self.start, self.gait, self.masks, self.outline)
        return min(c + costs[self.number(*seed)] for seed, c in zip(seeds, first, strict=True))


def small_problem(seed):
    rng = np.random.default_rng(seed)
    name = NAMES[seed % len(NAMES)]
    gait = GAITS[name]
    # THORMANG3's lattice is finer: so is its problem.
    scale = gait.stride_m / 0.27
    boxes = [(*rng.uniform(-0.1, 0.9, 2) * scale, 0.05 * scale) for _ in range(2)]
    drops = [(*rng.uniform(0.0, 0.8, 2) * scale, 0.1 * scale)]
    goal = (0.7 * scale, rng.uniform(-0.2, 0.5) * scale, rng.uniform(-1.5, 1.5))
    outline = fl.Outline(
        (0.1 * scale, 0.06 * scale), 0.1 * scale, ((0.0, 0.0), (0.2 * scale, 0.15 * scale)), 0.08 * scale, 1.0
    )
    return Small(ground(boxes, drops), (0.0, 0.0, 0.0), goal, gait, outline, 0.35 * scale)


@pytest.mark.parametrize("seed", range(4))
def test_cost_equals_brute_force_and_the_bound_never_exceeds_it(seed):
    problem = small_problem(seed)
    costs = problem.costs_to_goal(problem.graph())
    best, plan = problem.best(costs), problem.plan(budget=2_000_000)
    if math.isinf(best):
        assert plan.why in ("no way", "goal blocked")
        return
    assert plan.cost_s == pytest.approx(best, rel=1e-12)
    assert plan.bound == pytest.approx(1.0, abs=1e-12)
    # However little is spent, what is promised holds.
    for budget in (50, 200, 1000):
        quick = problem.plan(budget=budget)
        assert quick.why == "too hard" or best <= quick.cost_s + 1e-9 <= best * quick.bound + 1e-8
    assert_admissible(problem, costs)


def assert_admissible(problem, costs):
    ni, nj = problem.where.shape
    i1, j1, _ = (round(v) for v in problem.where.coordinates(problem.start))
    tenths = fast.distance_map(problem.masks.legs, *problem.where.origin, i1, j1, 40)
    rng = np.random.default_rng(0)
    states = rng.integers(0, (ni, nj, fm.BINS, 2), (4000, 4))
    for i, j, k, foot in states:
        true_s = costs[problem.number(i, j, k, foot)]
        if math.isfinite(true_s) and not problem.masks.legs[i, j]:
            bound_s = fast.bound(i, j, k, foot, problem.where.origin, tenths, problem.moves.free, problem.moves.figures)
            assert bound_s <= true_s + 1e-9


def test_small_problems_are_not_all_trivial():
    whys = [small_problem(seed).plan().why for seed in range(4)]
    assert whys.count("ok") >= 3


@pytest.mark.parametrize("name", NAMES)
def test_every_step_keeps_to_the_gait_and_the_last_two_are_on_the_goal(name):
    gait, rng = GAITS[name], np.random.default_rng(5)
    scale = gait.stride_m / 0.27
    cell = fm.moves(gait).cell_m
    for _ in range(12):
        goal = (*rng.uniform(-2.0, 2.0, 2) * scale, rng.uniform(-math.pi, math.pi))
        box = (goal[0] / 2, goal[1] / 2, 0.05)
        start = (*rng.normal(0.0, 0.02, 2), rng.normal(0.0, 0.1))
        plan = fp.plan_footsteps(ground([box]), start, goal, gait, BARE, budget=fp.HARD_BUDGET)
        if plan.why != "ok":
            assert math.hypot(*goal[:2]) < 2 * (BARE.legs_m + 0.05 + 0.05 * math.sqrt(2) + CELL_M)
            continue
        assert [plan.steps[-1 - n] for n in (0, 1)] == [
            sole_place(goal, plan.steps[-1 - n].foot, gait.width_m) for n in (0, 1)
        ]
        bodies = (start, *plan.bodies)
        for (x0, y0, a0), (x1, y1, a1), step in zip(bodies[:-1], bodies[1:], plan.steps, strict=True):
            out = 1 if step.foot == LEFT else -1
            dx, dy = x1 - x0, y1 - y0
            ahead, left = math.cos(a0) * dx + math.sin(a0) * dy, math.cos(a0) * dy - math.sin(a0) * dx
            turn = out * wrap(a1 - a0)
            assert fm.reachable(ahead, left, step.foot, cell, gait)
            # On the spot a foot turns outwards; while walking both ways, but less. A first step rounds by half a bin.
            walking = gait.turn_walking_rad
            assert -max(walking, fm.BIN_RAD / 2) - 1e-9 <= turn <= gait.turn_rad + 1e-9
            if abs(ahead) > cell:
                assert abs(turn) <= walking + 1e-9
            assert step == sole_place((x1, y1, a1), step.foot, gait.width_m)
        assert all(a.foot != b.foot for a, b in zip(plan.steps[:-1], plan.steps[1:], strict=True))


def test_same_inputs_same_plan_and_nearer_a_box_than_its_outline_it_does_not_come():
    seen = ground([(1.0, 0.1, 0.1), (2.0, -0.5, 0.2)])
    plans = [fp.plan_footsteps(seen, (0.0, 0.0, 0.0), (3.0, 0.0, 0.3), GAITS["valkyrie"], ARMED) for _ in range(2)]
    assert plans[0] == plans[1]
    x, y = (axis[seen.legs] for axis in np.meshgrid(*(2 * [(np.arange(160) + 0.5) * CELL_M - 4.0]), indexing="ij"))
    # Lattice and grid each round to half a cell of theirs: 3.2 and 3.5 cm at most, against 5 cm of clearance.
    for bx, by, yaw in plans[0].bodies:
        assert np.hypot(x - bx, y - by).min() > ARMED.legs_m - 0.02
        for u, v in ARMED.arms:
            px, py = bx + math.cos(yaw) * u - math.sin(yaw) * v, by + math.sin(yaw) * u + math.cos(yaw) * v
            assert np.hypot(x - px, y - py).min() > ARMED.arms_m - 0.05


def test_free_ground_takes_no_more_steps_than_a_plain_walk():
    for name in NAMES:
        gait = GAITS[name]
        for goal in ((2.0, 0.0, 0.0), (1.5, 1.0, 0.6), (0.5, -1.0, -1.5)):
            plan = fp.plan_footsteps(ground(), (0.0, 0.0, 0.0), goal, gait, BARE, budget=20_000)
            plain = plain_steps((0.0, 0.0, 0.0), walk_bodies((0.0, 0.0, 0.0), (goal,), gait), gait)
            # The lattice cannot walk in every direction exactly: a step more may come of it.
            assert len(plan.steps) <= len(plain) + 1


def test_no_way_is_said_and_so_is_a_goal_within_an_obstacle():
    ring = [(math.cos(a) * 1.2, math.sin(a) * 1.2, 0.1) for a in np.arange(0, 2 * math.pi, 0.1)]
    shut = fp.plan_footsteps(ground(ring), (0.0, 0.0, 0.0), (2.0, 0.0, 0.0), GAITS["valkyrie"], BARE, budget=10**6)
    assert (shut.why, shut.steps) == ("no way", ())
    inside = fp.plan_footsteps(ground([(2.0, 0.0, 0.1)]), (0.0, 0.0, 0.0), (2.0, 0.0, 0.0), GAITS["atlas"], BARE)
    assert inside.why == "goal blocked"


def test_soles_stay_off_a_drop_that_the_middle_of_the_body_may_cross():
    seen = ground(drops=[(0.6, 0.13, 0.04)])
    plan = fp.plan_footsteps(seen, (0.0, 0.0, 0.0), (1.2, 0.0, 0.0), GAITS["valkyrie"], BARE)
    assert plan.why == "ok"
    for step in plan.steps:
        # Half the sole's diagonal is 15.7 cm from the edge of the hole; rounding takes 3 cm.
        off = max(abs(step.x - 0.6), abs(step.y - 0.13)) - 0.05
        assert off > 0.157 / math.sqrt(2) - 0.035


# In physics ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class WithPost(BareFloor):
    """A level floor with posts of 12 cm, one in the way unless others are given."""

    ahead_m: float = 1.0
    others: tuple[tuple[float, float], ...] = ()

    def add_to(self, spec):
        super().add_to(spec)
        for number, (x, y) in enumerate(self.others or ((self.ahead_m, 0.05),)):
            spec.worldbody.add_geom(
                name=f"post{number}",
                type=mujoco.mjtGeom.mjGEOM_CYLINDER,
                pos=[x, y, 0.9],
                size=[0.06, 0.9, 0.0],
                friction=contact.rough(0.8),
                **contact.WORLD,
            )


def seen_by(name, scenery):
    spec = ROBOTS[name]()
    body = Body(spec, Plant(spec.model, scenery))
    return body, perform(body, Scan(), body.standing(), KEY).data


@pytest.mark.parametrize("name", NAMES)
def test_a_walk_goes_round_a_post_that_it_would_run_into(name):
    body, cloud = seen_by(name, WithPost())
    goal = (1.9, 0.0, 0.3)
    assert perform(body, Walk((goal,)), body.standing(), KEY).outcome == "fell"
    episode = perform(body, Walk((goal,), (cloud,)), body.standing(), KEY)
    assert episode.outcome == "reached"
    x, y, yaw = body_between(body.feet())
    assert math.hypot(x - goal[0], y - goal[1]) < 0.02
    assert abs(wrap(yaw - goal[2])) < 0.035


def test_a_way_that_is_free_is_walked_as_ever():
    body, cloud = seen_by("valkyrie", WithPost(ahead_m=3.5))
    goal = (0.8, 0.1, 0.2)
    plain, looked = (perform(body, Walk((goal,), clouds), body.standing(), KEY) for clouds in ((), (cloud,)))
    assert plain.end == looked.end


def test_shut_in_the_robot_says_so_and_stands():
    spec = ROBOTS["valkyrie"]()
    body = Body(spec, Plant(spec.model, BareFloor()))
    a = np.arange(0.0, 2 * math.pi, 0.01)
    points = [np.stack([np.cos(a), np.sin(a), np.full(a.size, z)], axis=1) for z in (0.3, 0.3, 1.5, 1.5)]
    walls = Cloud(np.concatenate(points), (0.0, 0.0, 1.6))
    episode = perform(body, Walk(((3.0, 0.0, 0.0),), (walls,)), body.standing(), KEY)
    assert episode.outcome == "no_plan"
    assert episode.physics_s == 0.0


@pytest.mark.parametrize("name", NAMES)
def test_the_outline_holds_all_of_the_robot(name):
    spec = ROBOTS[name]()
    body = Body(spec, Plant(spec.model, BareFloor()))
    body.load(body.standing())
    outline, model, data = outline_of(body), body.plant.model, body.plant.data
    for geom in np.flatnonzero(model.body_rootid[model.geom_bodyid] == 1):
        place = data.geom_xpos[geom]
        if place[2] > outline.split_m:
            off = min(math.hypot(place[0] - x, place[1] - y) for x, y in outline.arms)
            assert off < outline.arms_m
        else:
            assert math.hypot(*place[:2]) < outline.legs_m + 0.05


def test_clear_is_told_from_blocked():
    outline, gait = BARE, GAITS["valkyrie"]
    walk = ((0.0, 0.0, 0.0), (2.0, 0.0, 0.0))
    assert is_clear(ground([(1.0, 0.5, 0.05)]), walk, outline, gait)
    assert not is_clear(ground([(1.0, 0.1, 0.05)]), walk, outline, gait)
    assert not is_clear(ground(drops=[(1.0, 0.13, 0.05)]), walk, outline, gait)
    assert survey((0.0, 0.0, 0.0), ((1.0, 0.0, 0.0),), (), outline).unknown.any()


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_study_of_ways_between_three_posts(name):
    """Ten drawn goals each, with one post in the way and two beside it: the figure of docs/perception.md."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        far_m = 2.0 if name == "thormang3" else 3.0
        a = rng.uniform(-1.5, 1.5)
        goal = (far_m * math.cos(a), far_m * math.sin(a), a + rng.uniform(-1, 1))
        aside = rng.uniform((-0.2, 0.5, -1.4), (0.2, 1.4, -0.5))
        posts = tuple(
            (u * goal[0] - v * math.sin(a), u * goal[1] + v * math.cos(a))
            for u, v in zip((0.5, 0.62, 0.4), aside, strict=True)
        )
        body, cloud = seen_by(name, WithPost(others=posts))
        assert perform(body, Walk((goal,), (cloud,)), body.standing(), KEY).outcome == "reached"
