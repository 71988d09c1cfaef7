"""The step set of a robot on the planner's lattice: what a foot can do, snapped to cells and bins of yaw.

WPI's step options: strides of +-0.1, 0.2 and 0.3 m, turns of 0.1, 0.2, 0.3, 0.4, 0.6 and 0.7 rad on the spot and up to
0.2 rad with the longest stride (SpaceRoboticsChallenge @ea36ad7 and TOUGH @479c9d2, footsteps_valkyrie.yaml). Here
strides are thirds of each robot's longest, and its gait limits the turns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from teleop_sim.robot.footstep_guides import free_steps
from teleop_sim.robot.footsteps import LEFT, RIGHT, Gait
from teleop_sim.robot.perception.rays import Floats

BINS: Final = 64
BIN_RAD: Final = 2.0 * math.pi / BINS
CELLS_A_STRIDE: Final = 6.0
REACH_STRIDES: Final = 14.0  # assumed: so far from the goal the bound knows how a robot must turn
THIRDS: Final = (-1.0, -2.0 / 3.0, -1.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)
TURN_BINS: Final = (1, 2, 3, 4, 6, 7)  # WPI's turns in tenths of a radian
# Assumed: enough to tell plans of as many steps apart, less than a step on a walk of 2 m.
WAY_S_PER_M: Final = 0.3
TURN_S_PER_RAD: Final = 0.3

Ints = npt.NDArray[np.int64]


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
    free = free_steps(*_backwards(actions, counts), round(REACH_STRIDES * CELLS_A_STRIDE), figures[1])
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
