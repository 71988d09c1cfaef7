"""Footstep planner: from an occupancy grid to footsteps round what stands in the way.

A body pose is a node of a lattice that is laid out from the goal, so that the goal is met exactly: its axes are the
goal's, its cell a sixth of a stride, its yaw in 64 bins of 0.098 rad. A step puts one foot under the next body pose;
then it is the other foot's turn. Cost is time: a step's swing and transfer, and a little for way, turn and unseen
ground, so that of two plans with as many steps the straighter one is taken. ARA* (``footstep_search``) returns a bound
on cost over optimum.

WPI planned with the same method (ARA*) on a 2D grid of 5 cm; step options: strides of +-0.1, 0.2 and 0.3 m, turns of
0.1, 0.2, 0.3, 0.4, 0.6 and 0.7 rad on the spot and up to 0.2 rad with the longest stride (SpaceRoboticsChallenge
@ea36ad7 and TOUGH @479c9d2, footsteps_valkyrie.yaml). Here strides are thirds of each robot's longest, and its gait
limits the turns.

Not modelled: steps up and down, lifting the arms to pass, soles that overhang an edge, what the swinging foot passes
over.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from teleop_sim.robot import footstep_search as fast
from teleop_sim.robot.commands import PlanarPose
from teleop_sim.robot.gait import LEFT, RIGHT, Footstep, Gait, sole_place, wrap
from teleop_sim.robot.occupancy import CELL_M, Occupancy, widened
from teleop_sim.robot.perception.rays import Bools, Floats

BINS: Final = 64
BIN_RAD: Final = 2.0 * math.pi / BINS
CELLS_A_STRIDE: Final = 6.0
REACH_STRIDES: Final = 14.0  # assumed: so far from the goal the bound knows how a robot must turn
MARGIN_M: Final = 1.5  # assumed: the lattice reaches so far beyond start and goal
THIRDS: Final = (-1.0, -2.0 / 3.0, -1.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)
TURN_BINS: Final = (1, 2, 3, 4, 6, 7)  # WPI's turns in tenths of a radian
# Assumed: enough to tell plans of as many steps apart, less than a step on a walk of 2 m.
WAY_S_PER_M: Final = 0.3
TURN_S_PER_RAD: Final = 0.3
UNSEEN_S: Final = 1.0  # assumed: a step onto ground that nobody has seen
WEIGHTS: Final = (3.0, 1.5, 1.1, 0.0)
"""Of the guess in successive rounds, then the bound alone (assumed; WPI's ARA* began at 8 and had 7 s)."""
BUDGET: Final = 1500
"""Expansions in all: a plan round a post takes less than 20 ms (docs/perception.md)."""
HARD_BUDGET: Final = 40_000
"""Of a second try, if the first found nothing: 0.2 s (assumed)."""

Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Outline:
    """How much room a robot needs.

    Attributes:
        sole_m: length and width of a sole.
        legs_m: radius of the disc round the middle that holds legs and pelvis.
        arms: places (x, y) [m] from the middle of discs that hold torso, head and arms; arms_m: their radius.
        split_m: height over which an obstacle meets arms rather than legs.
    """

    sole_m: tuple[float, float]
    legs_m: float
    arms: tuple[tuple[float, float], ...]
    arms_m: float
    split_m: float

    @property
    def aside_m(self) -> float:
        """Half the width of all of it."""
        return max(self.legs_m, *(abs(y) + self.arms_m for _, y in self.arms))


@dataclass(frozen=True)
class FootPlan:
    """What came of planning.

    Attributes:
        steps: footsteps, alternating, ending with both feet under the goal; empty if there is no way.
        bodies: the body pose of each step.
        cost_s: of the way; bound: proven, of its cost over the optimum; expansions: spent.
        why: ``ok``, ``no way``, ``too hard`` (budget spent), ``goal blocked``.
    """

    steps: tuple[Footstep, ...]
    bodies: tuple[PlanarPose, ...]
    cost_s: float
    bound: float
    expansions: int
    why: str


@dataclass(frozen=True, eq=False)
class Moves:
    """The step set on the lattice: see ``footstep_search.search``."""

    cell_m: float
    actions: Ints
    costs: Floats
    counts: Ints
    figures: Floats
    free: npt.NDArray[np.uint8]
    turning: Floats


def options(gait: Gait, foot: int, turn_bins: tuple[int, ...] = TURN_BINS) -> list[tuple[float, float, int]]:
    """Moves (ahead [m], left [m], turn [bins]) of the body when ``foot`` steps: no foot crosses the other."""
    out = 1 if foot == LEFT else -1
    walking = [b for b in turn_bins if b * BIN_RAD <= gait.turn_walking_rad + 1e-9]
    found: list[tuple[float, float, int]] = [(0.0, 0.0, 0), (0.0, out * gait.side_m, 0)]
    for third in THIRDS:
        ahead = third * (gait.stride_m if third > 0 else gait.back_stride_m)
        found += [(ahead, 0.0, turn) for turn in (0, *walking, *(-b for b in walking))]
        if abs(third) < 0.5:
            found.append((ahead, out * gait.side_m, 0))
    return found + [(0.0, 0.0, out * b) for b in turn_bins if b * BIN_RAD <= gait.turn_rad + 1e-9]


def snapped(
    ahead_m: float, left_m: float, yaw_rad: float, foot: int, cell_m: float, gait: Gait
) -> tuple[int, int] | None:
    """The lattice offset nearest to a move of a body with that yaw which keeps to the gait's limits; None: there is
    none.
    """
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    x, y = (c * ahead_m - s * left_m) / cell_m, (s * ahead_m + c * left_m) / cell_m
    best, least = None, 1.0
    for i in range(math.floor(x), math.floor(x) + 2):
        for j in range(math.floor(y), math.floor(y) + 2):
            away = math.hypot(i - x, j - y)
            if away < least and reachable(
                i * cell_m * c + j * cell_m * s, j * cell_m * c - i * cell_m * s, foot, cell_m, gait
            ):
                best, least = (i, j), away
    return best


def reachable(ahead_m: float, left_m: float, foot: int, cell_m: float, gait: Gait) -> bool:
    """Whether the gait allows a move of the body when ``foot`` steps, half a cell inwards included."""
    outwards = left_m if foot == LEFT else -left_m
    slack = 1e-9
    return (
        -gait.back_stride_m - slack <= ahead_m <= gait.stride_m + slack
        and -cell_m / 2 - slack <= outwards <= gait.side_m + cell_m / 2 + slack
    )


@lru_cache(maxsize=8)
def moves(gait: Gait) -> Moves:
    """The step set of a gait."""
    cell_m, step_s = gait.stride_m / CELLS_A_STRIDE, gait.swing_s + gait.transfer_s
    cell_s, bin_s = WAY_S_PER_M * cell_m, TURN_S_PER_RAD * BIN_RAD
    table = [[_snapped_options(gait, foot, k, cell_m) for k in range(BINS)] for foot in (LEFT, RIGHT)]
    most = max(len(row) for rows in table for row in rows)
    actions, counts = np.zeros((2, BINS, most, 3), np.int64), np.zeros((2, BINS), np.int64)
    for foot in (LEFT, RIGHT):
        for k, row in enumerate(table[foot]):
            actions[foot, k, : len(row)], counts[foot, k] = row, len(row)
    length = np.hypot(actions[..., 0], actions[..., 1])
    costs = step_s + cell_s * length + bin_s * np.abs(actions[..., 2])
    figures = np.array([step_s, length.max(), float(np.abs(actions[..., 2]).max()), cell_s, bin_s])
    free = fast.free_steps(*_backwards(actions, counts), round(REACH_STRIDES * CELLS_A_STRIDE), figures[1])
    return Moves(cell_m, actions, costs, counts, figures, free, _turning(free, figures[1]))


def _turning(free: npt.NDArray[np.uint8], longest: float) -> Floats:
    """Steps (BINS,) that a heading costs which is so many bins off the way, by what the table says for a straight
    way.
    """
    middle = free.shape[1] // 2
    back = middle // 2
    steps: Floats = free[:, middle - back, middle, :].mean(axis=0) - back / longest
    return np.maximum(steps, 0.0)


def _backwards(actions: Ints, counts: Ints) -> tuple[Ints, Ints]:
    """The same moves, sorted by foot and yaw after the step: (2, BINS, a, 3) of -di, -dj and the yaw before; (2,
    BINS).
    """
    rows: list[list[list[tuple[int, int, int]]]] = [[[] for _ in range(BINS)] for _ in (LEFT, RIGHT)]
    for foot in (LEFT, RIGHT):
        for k in range(BINS):
            for di, dj, dk in actions[foot, k, : counts[foot, k]]:
                rows[foot][(k + dk) % BINS].append((-di, -dj, k))
    most = max(len(row) for by_yaw in rows for row in by_yaw)
    back, many = np.zeros((2, BINS, most, 3), np.int64), np.zeros((2, BINS), np.int64)
    for foot in (LEFT, RIGHT):
        for k, row in enumerate(rows[foot]):
            back[foot, k, : len(row)], many[foot, k] = row, len(row)
    return back, many


def _snapped_options(gait: Gait, foot: int, k: int, cell_m: float) -> list[tuple[int, int, int]]:
    found: dict[tuple[int, int, int], None] = {}
    for ahead, left, turn in options(gait, foot):
        offset = snapped(ahead, left, k * BIN_RAD, foot, cell_m, gait)
        if offset is not None:
            found[(*offset, turn)] = None
    return list(found)


@dataclass(frozen=True, eq=False)
class Lattice:
    """Where the lattice lies: its goal (i0, j0, 0) is the goal's pose; (ni, nj) nodes of ``cell_m``."""

    goal: PlanarPose
    cell_m: float
    shape: tuple[int, int]
    origin: tuple[int, int]

    def pose(self, i: int, j: int, k: int) -> PlanarPose:
        """Pose of a node in the odometry frame."""
        x, y, yaw = self.goal
        u, v = (i - self.origin[0]) * self.cell_m, (j - self.origin[1]) * self.cell_m
        c, s = math.cos(yaw), math.sin(yaw)
        return x + c * u - s * v, y + s * u + c * v, wrap(yaw + k * BIN_RAD)

    def coordinates(self, pose: PlanarPose) -> tuple[float, float, float]:
        """A pose in cells and bins."""
        x, y, yaw = self.goal
        dx, dy, c, s = pose[0] - x, pose[1] - y, math.cos(yaw), math.sin(yaw)
        u, v = (c * dx + s * dy) / self.cell_m, (c * dy - s * dx) / self.cell_m
        return u + self.origin[0], v + self.origin[1], wrap(pose[2] - yaw) / BIN_RAD

    def nodes(self) -> Floats:
        """Places (ni * nj, 2) of all nodes."""
        x, y, yaw = self.goal
        u, v = ((np.arange(n) - o) * self.cell_m for n, o in zip(self.shape, self.origin, strict=True))
        c, s = math.cos(yaw), math.sin(yaw)
        return np.stack([x + c * u[:, None] - s * v, y + s * u[:, None] + c * v], axis=-1).reshape(-1, 2)


def lattice(start: PlanarPose, goal: PlanarPose, cell_m: float, margin_m: float = MARGIN_M) -> Lattice:
    """A lattice that holds start and goal with a margin to spare."""
    dx, dy, c, s = start[0] - goal[0], start[1] - goal[1], math.cos(goal[2]), math.sin(goal[2])
    spare = math.ceil(margin_m / cell_m)
    sides = []
    for along in ((c * dx + s * dy) / cell_m, (c * dy - s * dx) / cell_m):
        low, high = min(0, math.floor(along)) - spare, max(0, math.ceil(along)) + spare
        sides.append((high - low + 1, -low))
    return Lattice(goal, cell_m, (sides[0][0], sides[1][0]), (sides[0][1], sides[1][1]))


@dataclass(frozen=True, eq=False)
class Blocked:
    """Masks (ni, nj) over a lattice: where the middle of the legs, an arm's disc and a sole may not be; unseen ground;
    and where a robot that walks ahead would touch something aside.
    """

    legs: Bools
    arms: Bools
    drops: Bools
    unseen: Bools
    narrow: Bools


def blocked(seen: Occupancy, where: Lattice, outline: Outline, clearance_m: float) -> Blocked:
    """Widen what was seen by the robot's outline and ``clearance_m``, and read it at the lattice's nodes."""
    count = seen.grid.count
    index = seen.grid.index(where.nodes())
    inside = ((index >= 0) & (index < count)).all(axis=1)
    cells = np.where(inside, index[:, 0] * count + index[:, 1], 0)

    def at_nodes(mask: Bools, radius_m: float, outside: bool) -> Bools:
        wide = widened(mask, radius_m / CELL_M) if radius_m else mask
        found = wide.ravel()[cells]
        found[~inside] = outside
        return found.reshape(where.shape)

    return Blocked(
        at_nodes(seen.legs | seen.arms, outline.legs_m + clearance_m, True),
        at_nodes(seen.arms, outline.arms_m + clearance_m, False),
        at_nodes(seen.drop, math.hypot(*outline.sole_m) / 2.0, True),
        at_nodes(seen.unknown, 0.0, True),
        at_nodes(seen.arms, outline.aside_m + clearance_m, True)
        | at_nodes(seen.legs, outline.legs_m + clearance_m, True),
    )


def plan_footsteps(
    seen: Occupancy,
    start: PlanarPose,
    goal: PlanarPose,
    gait: Gait,
    outline: Outline,
    clearance_m: float = 0.05,
    budget: int = BUDGET,
    weights: tuple[float, ...] = WEIGHTS,
    margin_m: float = MARGIN_M,
) -> FootPlan:
    """Plan footsteps.

    Args:
        seen: what is known of the ground. start: middle of both feet now, side by side. goal: where it shall be.
        gait: limits of a step. outline: room that the robot needs. clearance_m: kept beyond it.
        budget: of expansions. weights: of the guess; the last should be 0, for the bound.
        margin_m: no way leads further beyond start and goal.
    """
    steps = moves(gait)
    where = lattice(start, goal, steps.cell_m, margin_m)
    masks = blocked(seen, where, outline, clearance_m)
    if masks.legs[where.origin]:
        return FootPlan((), (), math.inf, math.inf, 0, "goal blocked")
    seeds, seed_costs = _first_steps(where, start, gait, masks, outline)
    if len(seeds) == 0:
        return FootPlan((), (), math.inf, math.inf, 0, "no way")
    i1, j1, _ = (round(v) for v in where.coordinates(start))
    # Half a metre beyond the start's distance: further off the map only says how far it was drawn.
    beyond = round(0.5 / steps.cell_m) * fast.STRAIGHT
    tenths = fast.distance_map(masks.legs, *where.origin, i1, j1, beyond)
    way = _way(masks, where.origin, (i1, j1), beyond, tenths)
    _, least_s, states, spent = fast.search(
        seeds, seed_costs, steps.actions, steps.costs, steps.counts, _soles(gait, steps.cell_m),
        masks.legs, masks.arms, _discs(outline, steps.cell_m), masks.drops, masks.unseen * UNSEEN_S,
        tenths, steps.free, where.origin, steps.figures,
        way, _steps_after(way, steps), steps.turning, np.array(weights), budget,
    )  # fmt: skip
    if len(states) == 0:
        return FootPlan((), (), math.inf, math.inf, spent, "no way" if math.isinf(least_s) else "too hard")
    cost_s = _cost_s(states, seeds, seed_costs, steps, masks)
    bodies = [where.pose(int(i), int(j), int(k)) for i, j, k, _ in states]
    feet = [int(foot) for *_, foot in states]
    # The other foot comes beside.
    bodies[-1] = goal
    bodies.append(goal)
    feet.append(1 - feet[-1])
    placed = tuple(sole_place(body, foot, gait.width_m) for body, foot in zip(bodies, feet, strict=True))
    return FootPlan(placed, tuple(bodies), cost_s, max(1.0, cost_s / float(least_s)), int(spent), "ok")


def _cost_s(states: Ints, seeds: Ints, seed_costs: Floats, steps: Moves, masks: Blocked) -> float:
    """Cost of a way: what came before a state may have become cheaper after the search last looked at it."""
    step_s, _, _, cell_s, bin_s = steps.figures
    first = int(np.flatnonzero((seeds == states[0]).all(axis=1))[0])
    moved = np.diff(states[:, :3], axis=0)
    turned = (moved[:, 2] + BINS // 2) % BINS - BINS // 2
    unseen = masks.unseen[states[1:, 0], states[1:, 1]]
    each = step_s + cell_s * np.hypot(moved[:, 0], moved[:, 1]) + bin_s * np.abs(turned) + UNSEEN_S * unseen
    return float(seed_costs[first] + each.sum())


def _way(masks: Blocked, goal: tuple[int, int], start: tuple[int, int], beyond: int, tenths: Ints) -> Ints:
    """Corners (m, 2) of a way: with room for the arms if there is one, else for the legs."""
    wide = fast.distance_map(masks.narrow, *goal, *start, beyond)
    mask, map_ = (masks.narrow, wide) if wide[start] > 0 and not masks.narrow[start] else (masks.legs, tenths)
    corners: Ints = fast.corners(map_, mask, *start, *goal)
    return corners


def _steps_after(way: Ints, steps: Moves) -> Floats:
    """Steps (m,) that are probably needed from each corner of a way on: length, and turns at later corners and the
    end.
    """
    after = np.zeros(len(way))
    heading = 0.0
    for c in range(len(way) - 1, 0, -1):
        dx, dy = way[c] - way[c - 1]
        before = math.atan2(dy, dx)
        after[c] = (after[c + 1] + np.hypot(*(way[c + 1] - way[c])) / steps.figures[1]) if c < len(way) - 1 else 0.0
        after[c] += steps.turning[round((heading - before) / BIN_RAD) % BINS]
        heading = before
    return after


@lru_cache(maxsize=8)
def _soles(gait: Gait, cell_m: float) -> Ints:
    """Places (2, BINS, 2) of the soles in cells from the body's."""
    places = [[sole_place((0.0, 0.0, k * BIN_RAD), foot, gait.width_m) for k in range(BINS)] for foot in (LEFT, RIGHT)]
    return np.array([[[round(p.x / cell_m), round(p.y / cell_m)] for p in row] for row in places], np.int64)


@lru_cache(maxsize=8)
def _discs(outline: Outline, cell_m: float) -> Ints:
    """Places (BINS, n, 2) of the arms' discs in cells from the body's."""
    found = np.zeros((BINS, len(outline.arms), 2), np.int64)
    for k in range(BINS):
        c, s = math.cos(k * BIN_RAD), math.sin(k * BIN_RAD)
        for d, (x, y) in enumerate(outline.arms):
            found[k, d] = round((c * x - s * y) / cell_m), round((s * x + c * y) / cell_m)
    return found


def _first_steps(
    where: Lattice, start: PlanarPose, gait: Gait, masks: Blocked, outline: Outline
) -> tuple[Ints, Floats]:
    """First steps from where the robot really stands onto nodes: (n, 4) i, j, k, foot, and their costs."""
    steps = moves(gait)
    u, v, turned = where.coordinates(start)
    relative_rad = turned * BIN_RAD
    found: dict[tuple[int, int, int, int], float] = {}
    discs, soles = _discs(outline, steps.cell_m), _soles(gait, steps.cell_m)
    for foot in (LEFT, RIGHT):
        for ahead, left, turn in options(gait, foot):
            c, s = math.cos(relative_rad), math.sin(relative_rad)
            i = round(u + (c * ahead - s * left) / steps.cell_m)
            j = round(v + (s * ahead + c * left) / steps.cell_m)
            bins = round(turned + turn)
            dx, dy = (i - u) * steps.cell_m, (j - v) * steps.cell_m
            if not _allowed(c * dx + s * dy, c * dy - s * dx, (bins - turned) * BIN_RAD, foot, steps.cell_m, gait):
                continue
            k = bins % BINS
            si, sj = i + int(soles[foot, k, 0]), j + int(soles[foot, k, 1])
            if masks.drops[si, sj] or fast.blocked_on_way(i, j, k, 0, 0, 0, masks.legs, masks.arms, discs):
                continue
            cost = steps.figures[0] + WAY_S_PER_M * math.hypot(dx, dy) + TURN_S_PER_RAD * abs(bins - turned) * BIN_RAD
            found[(i, j, k, foot)] = cost + UNSEEN_S * float(masks.unseen[i, j])
    seeds = np.array(list(found), np.int64).reshape(-1, 4)
    return seeds, np.array(list(found.values()), float)


def _allowed(ahead_m: float, left_m: float, turn_rad: float, foot: int, cell_m: float, gait: Gait) -> bool:
    """Whether a first step keeps to the gait: rounding to the lattice may turn it inwards by half a bin."""
    outwards = turn_rad if foot == LEFT else -turn_rad
    limit = gait.turn_rad if abs(ahead_m) < cell_m else gait.turn_walking_rad
    inwards = BIN_RAD / 2 if abs(ahead_m) < cell_m else gait.turn_walking_rad
    return reachable(ahead_m, left_m, foot, cell_m, gait) and -inwards <= outwards + 1e-9 and outwards <= limit + 1e-9
