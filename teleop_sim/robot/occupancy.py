"""Occupancy grid: what the LIDAR has told about the ground, cell by cell.

A cell holds an obstacle at the height of the legs, one at the height of the arms, a drop, free floor, or nothing is
known of it. Floor is free where it was seen, and where a beam passed low over it on its way. Two height bands suffice
because a robot is a trunk with its arms ahead: a console lower than the hands does not block them.

Source of the cell's side: WPI-Humanoid-Robotics-Lab/SpaceRoboticsChallenge @ea36ad7 (octomap and archive code, 5 cm).

Not modelled: slopes and stairs (the floor is z = 0), things that move between two sweeps, height of what hangs from
above.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from teleop_sim.robot.commands import Cloud, PlanarPose
from teleop_sim.robot.law_math import compiled
from teleop_sim.robot.perception.gridpath import Grid
from teleop_sim.robot.perception.rays import Bools

CELL_M: Final = 0.05
LEVEL_M: Final = 0.05
"""What is this much over or under the floor is no floor: five standard deviations of the LIDAR's range, half the height
of the walkway over the soil."""
HEAD_ROOM_M: Final = 2.2  # assumed: what is higher does not stand in a robot's way
CLEAR_UNDER_M: Final = 0.3  # assumed: a beam that passes lower than this over a cell found nothing to stumble over
LEAST_POINTS: Final = 2  # assumed: one point may be a stray
STOOD_M: Final = 0.4  # assumed: ground that the robot stands on needs no looking at


@dataclass(frozen=True, eq=False)
class Occupancy:
    """Cells (count, count) by their place in ``grid``.

    Attributes:
        legs: obstacles from 5 cm to ``split_m`` over the floor. arms: from there to 2.2 m.
        drop: ground that lies lower than the floor.
        free: floor with nothing on it. What is none of these four is unknown.
    """

    grid: Grid
    legs: Bools
    arms: Bools
    drop: Bools
    free: Bools

    @property
    def unknown(self) -> Bools:
        """Cells of which nothing is known."""
        return ~(self.legs | self.arms | self.drop | self.free)


def occupancy(
    clouds: Sequence[Cloud],
    centre: tuple[float, float],
    half_m: float,
    split_m: float,
    stood: Sequence[PlanarPose] = (),
) -> Occupancy:
    """Make the grid.

    Args:
        clouds: sweeps of the LIDAR, each with the place that it was seen from.
        centre: of the square of interest, odometry frame [m]. half_m: half its side.
        split_m: height between the bands of legs and arms.
        stood: where the robot stands or has stood; there the floor is free.
    """
    count = max(1, math.ceil(2.0 * half_m / CELL_M))
    grid = Grid(centre[0] - half_m, centre[1] - half_m, CELL_M, count)
    counts = np.zeros((4, count, count), np.int32)
    passed = np.zeros((count, count), np.bool_)
    for cloud in clouds:
        points = np.ascontiguousarray(cloud.points, np.float64)
        _sort_points(points, grid.x_m, grid.y_m, CELL_M, split_m, counts)
        _pass_beams(points, np.array(cloud.origin), grid.x_m, grid.y_m, CELL_M, passed)
    low, level, leg, arm = counts
    legs, arms = leg >= LEAST_POINTS, arm >= LEAST_POINTS
    drop = (low > level) & (low >= LEAST_POINTS)
    own = _near(grid, stood)
    free = ((level >= LEAST_POINTS) | passed | own) & ~(legs | arms | drop)
    return Occupancy(grid, legs & ~own, arms & ~own, drop & ~own, free | own)


def _near(grid: Grid, stood: Sequence[PlanarPose]) -> Bools:
    """Cells (count, count) within 0.4 m of a pose."""
    middles = (np.arange(grid.count) + 0.5) * CELL_M
    x, y = middles[:, None] + grid.x_m, middles[None, :] + grid.y_m
    near = np.zeros((grid.count, grid.count), np.bool_)
    for px, py, _ in stood:
        near |= (x - px) ** 2 + (y - py) ** 2 <= STOOD_M**2
    return near


@compiled
def _sort_points(points: np.ndarray, x_m: float, y_m: float, cell_m: float, split_m: float, counts: np.ndarray) -> None:
    """Count points (n, 3) by cell in four bands: low, level, legs, arms."""
    count = counts.shape[1]
    for p in range(points.shape[0]):
        z = points[p, 2]
        if z >= HEAD_ROOM_M:
            continue
        i = int(np.floor((points[p, 0] - x_m) / cell_m))
        j = int(np.floor((points[p, 1] - y_m) / cell_m))
        if i < 0 or j < 0 or i >= count or j >= count:
            continue
        band = 0 if z < -LEVEL_M else (1 if z <= LEVEL_M else (2 if z < split_m else 3))
        counts[band, i, j] += 1


@compiled
def _pass_beams(
    points: np.ndarray, origin: np.ndarray, x_m: float, y_m: float, cell_m: float, passed: np.ndarray
) -> None:
    """Mark the cells over which a beam passes lower than 0.3 m, but the one in which it ends."""
    count = passed.shape[0]
    # Neighbouring beams are 1 cm apart at 2 m: one of two will do.
    for p in range(0, points.shape[0], 2):
        z = points[p, 2]
        if z >= CLEAR_UNDER_M:
            continue
        dx, dy = points[p, 0] - origin[0], points[p, 1] - origin[1]
        drop, level = origin[2] - z, np.sqrt(dx * dx + dy * dy)
        share = min(1.0, (CLEAR_UNDER_M - z) / drop) if drop > 1e-9 else 1.0
        # From the end backwards, half a cell at a time, until the beam is high.
        for k in range(2, int(2.0 * share * level / cell_m) + 1):
            u = 1.0 - 0.5 * k * cell_m / level
            i = int(np.floor((origin[0] + u * dx - x_m) / cell_m))
            j = int(np.floor((origin[1] + u * dy - y_m) / cell_m))
            if 0 <= i < count and 0 <= j < count:
                passed[i, j] = True


@compiled
def widened(mask: np.ndarray, radius: float) -> np.ndarray:
    """Cells within ``radius`` (in cells) of a set cell: dilation by a disc, quick where few cells are set."""
    ni, nj = mask.shape
    wide = mask.copy()
    reach = int(radius)
    for i in range(ni):
        for j in range(nj):
            # What has only set neighbours widens nothing that they do not.
            if not mask[i, j] or (
                0 < i < ni - 1
                and 0 < j < nj - 1
                and mask[i - 1, j]
                and mask[i + 1, j]
                and mask[i, j - 1]
                and mask[i, j + 1]
            ):
                continue
            for a in range(max(0, i - reach), min(ni, i + reach + 1)):
                half = int(np.sqrt(radius * radius - (a - i) * (a - i)))
                wide[a, max(0, j - half) : min(nj, j + half + 1)] = True
    return wide
