"""Footstep planner: from an occupancy grid to footsteps round what stands in the way.

A body pose is a node of a lattice that is laid out from the goal, so that the goal is met exactly: its axes are the goal's, its
cell a sixth of a stride, its yaw in 64 bins of 0.098 rad. A step puts one foot under the next body pose; then it is the
other foot's turn. Cost is time: a step's swing and transfer, and a little for way, turn and unseen ground, so that of two
plans with as many steps the straighter one is taken. ARA* (``footstep_search``) returns a bound on cost over optimum.

WPI planned with the same method (ARA*) on a 2D grid of 5 cm; step options: strides of +-0.1, 0.2 and 0.3 m, turns of 0.1,
0.2, 0.3, 0.4, 0.6 and 0.7 rad on the spot and up to 0.2 rad with the longest stride (SpaceRoboticsChallenge @ea36ad7 and TOUGH
@479c9d2, footsteps_valkyrie.yaml). Here strides are thirds of each robot's longest, and its gait limits the turns.

Not modelled: steps up and down, lifting the arms to pass, soles that overhang an edge, what the swinging foot passes over.
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
from teleop_sim.robot.occupancy import CELL_M, Occupancy, at
from teleop_sim.robot.perception.gridpath import widen
from teleop_sim.robot.perception.rays import Bools, Floats

BINS: Final = 64
BIN_RAD: Final = 2.0 * math.pi / BINS
CELLS_A_STRIDE: Final = 6.0
MARGIN_M: Final = 1.5  # assumed: the lattice reaches so far beyond start and goal
THIRDS: Final = (-1.0, -2.0 / 3.0, -1.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)
TURN_BINS: Final = (1, 2, 3, 4, 6, 7)  # WPI's turns in tenths of a radian
# Assumed: enough to tell plans of as many steps apart, less than a step on a walk of 2 m.
WAY_S_PER_M: Final = 0.3
TURN_S_PER_RAD: Final = 0.3
UNSEEN_S: Final = 1.0  # assumed: a step onto ground that nobody has seen
# Assumed. WPI began at 8 and had 7 s; here the first way takes a few milliseconds at 3.
EPSILONS: Final = (3.0, 2.0, 1.5, 1.2, 1.0)
BUDGET: Final = 6000
"""Expansions in all: a plan round a post takes less than 20 ms (docs/perception.md)."""

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
    """The lattice offset nearest to a move of a body with that yaw which keeps to the gait's limits; None: there is none."""
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
    return Moves(cell_m, actions, costs, counts, figures)


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


def lattice(start: PlanarPose, goal: PlanarPose, cell_m: float) -> Lattice:
    """A lattice that holds start and goal with 1.5 m to spare."""
    dx, dy, c, s = start[0] - goal[0], start[1] - goal[1], math.cos(goal[2]), math.sin(goal[2])
    spare = math.ceil(MARGIN_M / cell_m)
    sides = []
    for along in ((c * dx + s * dy) / cell_m, (c * dy - s * dx) / cell_m):
        low, high = min(0, math.floor(along)) - spare, max(0, math.ceil(along)) + spare
        sides.append((high - low + 1, -low))
    return Lattice(goal, cell_m, (sides[0][0], sides[1][0]), (sides[0][1], sides[1][1]))


@dataclass(frozen=True, eq=False)
class Blocked:
    """Masks (ni, nj) over a lattice: where the middle of the legs, an arm's disc and a sole may not be; unseen ground."""

    legs: Bools
    arms: Bools
    drops: Bools
    unseen: Bools


def blocked(seen: Occupancy, where: Lattice, outline: Outline, clearance_m: float) -> Blocked:
    """Widen what was seen by the robot's outline and ``clearance_m``, and read it at the lattice's nodes."""
    nodes = where.nodes()
    sole_m = math.hypot(*outline.sole_m) / 2.0

    def at_nodes(mask: Bools, radius_m: float, outside: bool) -> Bools:
        wide = widen(mask, radius_m / CELL_M) if mask.any() else mask
        return np.ascontiguousarray(at(seen.grid, wide, nodes, outside).reshape(where.shape))

    return Blocked(
        at_nodes(seen.legs | seen.arms, outline.legs_m + clearance_m, True),
        at_nodes(seen.arms, outline.arms_m + clearance_m, False),
        at_nodes(seen.drop, sole_m, True),
        at_nodes(seen.unknown, 0.0, True),
    )


def plan_footsteps(
    seen: Occupancy,
    start: PlanarPose,
    goal: PlanarPose,
    gait: Gait,
    outline: Outline,
    clearance_m: float = 0.05,
    budget: int = BUDGET,
    epsilons: tuple[float, ...] = EPSILONS,
) -> FootPlan:
    """Plan footsteps.

    Args:
        seen: what is known of the ground. start: middle of both feet now, side by side. goal: where it shall be.
        gait: limits of a step. outline: room that the robot needs. clearance_m: kept beyond it.
        budget: of expansions. epsilons: of ARA*, falling to 1.
    """
    steps = moves(gait)
    where = lattice(start, goal, steps.cell_m)
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
    status, cost_s, bound, way, spent = fast.search(
        seeds, seed_costs, steps.actions, steps.costs, steps.counts, _soles(gait, steps.cell_m),
        masks.legs, masks.arms, _discs(outline, steps.cell_m), masks.drops, masks.unseen * UNSEEN_S,
        tenths, where.origin, steps.figures, np.array(epsilons), budget,
    )  # fmt: skip
    if len(way) == 0:
        return FootPlan((), (), math.inf, math.inf, spent, "no way" if status == fast.NOT_FOUND else "too hard")
    bodies = [where.pose(int(i), int(j), int(k)) for i, j, k, _ in way]
    feet = [int(foot) for *_, foot in way]
    # The other foot comes beside.
    bodies[-1] = goal
    bodies.append(goal)
    feet.append(1 - feet[-1])
    placed = tuple(sole_place(body, foot, gait.width_m) for body, foot in zip(bodies, feet, strict=True))
    return FootPlan(placed, tuple(bodies), float(cost_s), float(bound), int(spent), "ok")


def _soles(gait: Gait, cell_m: float) -> Ints:
    """Places (2, BINS, 2) of the soles in cells from the body's."""
    places = [[sole_place((0.0, 0.0, k * BIN_RAD), foot, gait.width_m) for k in range(BINS)] for foot in (LEFT, RIGHT)]
    return np.array([[[round(p.x / cell_m), round(p.y / cell_m)] for p in row] for row in places], np.int64)


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
