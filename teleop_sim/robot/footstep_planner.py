"""Footstep planner: from an occupancy grid to footsteps round what stands in the way.

A body pose is a node of a lattice that is laid out from the goal, so that the goal is met exactly: its axes are the
goal's, its cell a sixth of a stride, its yaw in 64 bins of 0.098 rad. A step puts one foot under the next body pose;
then it is the other foot's turn. Cost is time: a step's swing and transfer, and a little for way, turn and unseen
ground, so that of two plans with as many steps the straighter one is taken. ARA* (``footstep_search``) returns a bound
on cost over optimum.

WPI planned with the same method (ARA*) on a 2D grid of 5 cm; its step options are in ``footstep_moves``.

Not modelled: steps up and down, lifting the arms to pass, soles that overhang an edge, what the swinging foot passes
over.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from teleop_sim.robot.commands import PlanarPose
from teleop_sim.robot.footstep_guides import STRAIGHT, corners, distance_map
from teleop_sim.robot.footstep_lattice import MARGIN_M, Blocked, Lattice, Outline, blocked, lattice
from teleop_sim.robot.footstep_moves import (
    BIN_RAD,
    BINS,
    TURN_S_PER_RAD,
    WAY_S_PER_M,
    Ints,
    Moves,
    moves,
    options,
    reachable,
)
from teleop_sim.robot.footstep_search import Ground, Guides, Steps, blocked_on_way, search
from teleop_sim.robot.footsteps import LEFT, RIGHT, Footstep, Gait, sole_place
from teleop_sim.robot.occupancy import Occupancy
from teleop_sim.robot.perception.rays import Floats

__all__ = ["BUDGET", "HARD_BUDGET", "MARGIN_M", "WEIGHTS", "FootPlan", "Outline", "moves", "plan_footsteps"]

UNSEEN_S: Final = 1.0  # assumed: a step onto ground that nobody has seen
WEIGHTS: Final = (3.0, 1.5, 1.1, 0.0)
"""Of the guess in successive rounds, then the bound alone (assumed; WPI's ARA* began at 8 and had 7 s)."""
BUDGET: Final = 1500
"""Expansions in all: a plan round a post takes less than 20 ms (docs/perception.md)."""
HARD_BUDGET: Final = 40_000
"""Of a second try, if the first found nothing: 0.2 s (assumed)."""


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
    ground = Ground(masks.legs, masks.arms, _discs(outline, steps.cell_m), masks.drops, masks.unseen * UNSEEN_S)
    can = Steps(steps.actions, steps.costs, steps.counts, _soles(gait, steps.cell_m))
    guides = _guides(where, start, masks, steps)
    _, least_s, states, spent = search(seeds, seed_costs, can, ground, guides, np.array(weights), budget)
    if len(states) == 0:
        return FootPlan((), (), math.inf, math.inf, spent, "no way" if math.isinf(least_s) else "too hard")
    cost_s = _cost_s(states, seeds, seed_costs, steps, masks)
    placed, bodies = _placed(states, where, gait)
    return FootPlan(placed, bodies, cost_s, max(1.0, cost_s / float(least_s)), int(spent), "ok")


def _placed(states: Ints, where: Lattice, gait: Gait) -> tuple[tuple[Footstep, ...], tuple[PlanarPose, ...]]:
    """Footsteps and body poses of a way; at its end the other foot comes beside."""
    bodies = [where.pose(int(i), int(j), int(k)) for i, j, k, _ in states]
    feet = [int(foot) for *_, foot in states]
    bodies[-1] = where.goal
    bodies.append(where.goal)
    feet.append(1 - feet[-1])
    return tuple(sole_place(body, foot, gait.width_m) for body, foot in zip(bodies, feet, strict=True)), tuple(bodies)


def _guides(where: Lattice, start: PlanarPose, masks: Blocked, steps: Moves) -> Guides:
    """What guides the search from the start's node to the goal."""
    i1, j1, _ = (round(v) for v in where.coordinates(start))
    # Half a metre beyond the start's distance: further off the map only says how far it was drawn.
    beyond = round(0.5 / steps.cell_m) * STRAIGHT
    tenths = distance_map(masks.legs, *where.origin, i1, j1, beyond)
    way = _way(masks, where.origin, (i1, j1), beyond, tenths)
    after = _steps_after(way, steps)
    return Guides(where.origin, tenths, steps.free, steps.figures, way, after, steps.turning)


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
    wide = distance_map(masks.narrow, *goal, *start, beyond)
    mask, map_ = (masks.narrow, wide) if wide[start] > 0 and not masks.narrow[start] else (masks.legs, tenths)
    found: Ints = corners(map_, mask, *start, *goal)
    return found


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
            if masks.drops[si, sj] or blocked_on_way(i, j, k, 0, 0, 0, masks.legs, masks.arms, discs):
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
