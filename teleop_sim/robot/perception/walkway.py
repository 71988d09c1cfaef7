"""Find the finish square: clouds -> which cells are walkway -> a 3.048 m square of them -> a way to it.

Known beforehand: the walkway is level at z = 0 and 0.1 m over the soil, the finish is a square of 3.048 m (rules of the
Space Robotics Challenge), and the start square is where the robot has stood.

Not modelled: a walkway that is not level, things lying on it that are lower than 5 cm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from teleop_sim.robot.commands import PlanarPose
from teleop_sim.robot.perception import gridpath
from teleop_sim.robot.perception.gridpath import Grid
from teleop_sim.robot.perception.rays import Bools, Floats
from teleop_sim.robot.sightings import FinishFix
from teleop_sim.world.console import SQUARE_M

CELL_M: Final = 0.05
REACH_M: Final = 8.0  # half the map's side; the finishes of the published worlds are within 4.1 m of the console
LEVEL_M: Final = 0.05  # half the walkway's height over the soil: decides between the two
HEAD_ROOM_M: Final = 2.2  # assumed: what is higher does not stand in a robot's way
# Scan lines to the side are 0.2 m apart on the ground 4 m away: holes up to twice this are closed.
CLOSE_CELLS: Final = 3
STOOD_M: Final = 0.4  # assumed: ground that the robot stood on needs no looking at
CLEARANCES_M: Final = (0.5, 0.35)  # wished for; kept at least (assumed: half a stance and a stride aside)
FIRST_STEP_M: Final = 0.8  # assumed: from nearer to an edge than it would walk, the robot first steps this far at most
COARSE_M: Final = 0.1
ANGLES: Final = 18  # over a quarter turn: at most 2.5 degrees off
# Least score of a square, as a share of its area: seen walkway less three times seen soil. Measured over 200 views:
# squares above 0.85 are within 0.4 m of the truth, those below up to 1.2 m off, as they slide into ground not seen.
SCORE_SHARE: Final = 0.85
SOIL_WEIGHT: Final = 3.0
INSET_M: Final = 0.1  # assumed: how far a square may reach over a place where the robot has stood
NEARLY_BEST_SHARE: Final = 0.005  # assumed: squares worse by this share of the area are averaged with the best


@dataclass(frozen=True)
class Survey:
    """The ground as seen: cells (count, count) that are walkway, and cells that are soil or an obstacle."""

    grid: Grid
    walkway: Bools
    other: Bools


def find_finish(
    cloud_points: Floats, here: PlanarPose, visited: tuple[PlanarPose, ...]
) -> tuple[FinishFix | None, str]:
    """Find the finish square in all that the LIDAR has seen.

    Args:
        cloud_points: (n, 3) in the odometry frame, of any number of sweeps together [m].
        here: where the robot stands.
        visited: where it has stood; the start must be among them. A square that holds one of them is not the finish.

    Returns:
        The finish and a way to it that stays at least 0.35 m from edges and obstacles, or None; and ``ok`` or why not.

    """
    ground = survey(cloud_points, here, (*visited, here))
    square = _square(ground, (*visited, here))
    if square is None:
        return None, "no unvisited square of walkway seen"
    path = _way(ground, here, square)
    if path is None:
        return None, "no way over the walkway to the square"
    return FinishFix((square[0], square[1], path[-1][2]), path), "ok"


def survey(cloud_points: Floats, here: PlanarPose, stood: tuple[PlanarPose, ...]) -> Survey:
    """Sort the ground within 8 m: walkway, not walkway, or (neither) unseen."""
    count = round(2.0 * REACH_M / CELL_M)
    grid = Grid(here[0] - REACH_M, here[1] - REACH_M, CELL_M, count)
    points = cloud_points[cloud_points[:, 2] < HEAD_ROOM_M]
    index = grid.index(points[:, :2])
    near = ((index >= 0) & (index < count)).all(axis=1)
    flat, z = index[near, 0] * count + index[near, 1], points[near, 2]
    low, level, high = (
        np.bincount(flat[which], minlength=count * count).reshape(count, count)
        for which in (z < -LEVEL_M, np.abs(z) <= LEVEL_M, z > LEVEL_M)
    )
    other = (high > 0) | (low > level)
    seen = (level > 0) & ~other
    for x, y, _ in stood:
        i, j = grid.cell(x, y)
        k = round(STOOD_M / CELL_M)
        seen[max(i - k, 0) : i + k + 1, max(j - k, 0) : j + k + 1] = True
    other &= ~seen
    walkway = seen | (_close(seen) & ~other)
    return Survey(grid, walkway, other | (_close(other) & ~walkway))


def _close(mask: Bools) -> Bools:
    """Fill holes without moving outer edges: widen by a few cells, then take as much off again."""
    wide = gridpath.widen(mask, CLOSE_CELLS)
    return ~gridpath.widen(~wide, CLOSE_CELLS)


def _square(ground: Survey, stood: tuple[PlanarPose, ...]) -> PlanarPose | None:
    """The best square of walkway in any orientation that holds none of the poses; None: none is good enough."""
    walkway, other = _coarse(ground.grid, ground.walkway), _coarse(ground.grid, ground.other)
    found = [
        _best_at(walkway, other, np.array([pose[:2] for pose in stood]), ground.grid, 0.5 * math.pi * k / ANGLES)
        for k in range(ANGLES)
    ]
    score, square = max(found, key=lambda one: one[0])
    return square if score > 0.0 else None


def _coarse(grid: Grid, mask: Bools) -> Floats:
    """Middles (n, 2) of 10 cm cells of which at least half is set, relative to the grid's middle."""
    ratio = round(COARSE_M / CELL_M)
    count = grid.count // ratio
    full = mask.reshape(count, ratio, count, ratio).sum(axis=(1, 3)) * 2 >= ratio * ratio
    return np.asarray((np.argwhere(full) + 0.5) * COARSE_M - REACH_M)


def _best_at(
    walkway: Floats, other: Floats, stood: Floats, grid: Grid, angle_rad: float
) -> tuple[float, PlanarPose | None]:
    """Score and pose of the best square turned by ``angle_rad``; the score is 0 if none is good enough."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    turn = np.array([[c, -s], [s, c]])
    middle = np.array([grid.x_m + REACH_M, grid.y_m + REACH_M])
    side = round(SQUARE_M / COARSE_M)
    good, bad = (_sums(cells @ turn, side) for cells in (walkway, other))
    score = good - SOIL_WEIGHT * bad
    score[score < SCORE_SHARE * side * side] = 0.0
    reach = 0.5 * SQUARE_M - INSET_M
    for u, v in (stood - middle) @ turn:
        i, j = _span(float(u), reach, side), _span(float(v), reach, side)
        score[i[0] : i[1], j[0] : j[1]] = 0.0
    top = float(score.max())
    if top <= 0.0:
        return 0.0, None
    # Squares nearly as good lie around the best: their mean is finer than the cells.
    at = np.argwhere(score >= top - NEARLY_BEST_SHARE * side * side).mean(axis=0)
    x, y = turn @ ((at + 0.5 * side) * COARSE_M - _turned_reach()) + middle
    return top, (float(x), float(y), angle_rad)


def _turned_reach() -> float:
    """Half the side of a map that holds the turned one."""
    return math.ceil(REACH_M * math.sqrt(2.0) / COARSE_M) * COARSE_M


def _sums(cells: Floats, side: int) -> Floats:
    """How many points lie in each square of ``side`` cells, by its lower corner's cell."""
    reach = _turned_reach()
    count = round(2.0 * reach / COARSE_M)
    index = np.floor((cells + reach) / COARSE_M).astype(np.int64)
    hits = np.bincount(index[:, 0] * count + index[:, 1], minlength=count * count).reshape(count, count)
    total = np.pad(hits.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    return np.asarray(
        total[side:, side:] - total[:-side, side:] - total[side:, :-side] + total[:-side, :-side], np.float64
    )


def _span(middle_m: float, reach_m: float, side: int) -> tuple[int, int]:
    """Lower corners of the squares whose middles are within ``reach_m``."""
    first = (middle_m - reach_m + _turned_reach()) / COARSE_M - 0.5 * side
    return max(math.floor(first), 0), max(math.ceil(first + 2.0 * reach_m / COARSE_M), 0)


def _way(ground: Survey, here: PlanarPose, square: PlanarPose) -> tuple[PlanarPose, ...] | None:
    """A way from here to the square's middle, as far from the edges as it can be."""
    grid = ground.grid
    # Unseen ground inside the square is taken for walkway: the square is known to be whole.
    safe = ground.walkway | (_inside(grid, square) & ~ground.other)
    start, goal = grid.cell(here[0], here[1]), grid.cell(square[0], square[1])
    for clearance_m in CLEARANCES_M:
        free = ~gridpath.widen(~safe, clearance_m / CELL_M)
        first = gridpath.nearest(free, start, FIRST_STEP_M / CELL_M)
        last = gridpath.nearest(free, goal, 0.5 * SQUARE_M / CELL_M)
        cells = gridpath.search(free, first, last) if first and last else None
        if cells:
            corners = grid.centres(np.array(gridpath.shorten(free, cells)))
            off = float(np.hypot(*(corners[0] - here[:2])))
            points = np.vstack([here[:2], corners if off > 2.0 * CELL_M else corners[1:]])
            return gridpath.facing_along(points) if len(points) > 1 else None
    return None


def _inside(grid: Grid, square: PlanarPose) -> Bools:
    x, y = (
        (np.arange(grid.count) + 0.5) * grid.cell_m + corner - middle
        for corner, middle in ((grid.x_m, square[0]), (grid.y_m, square[1]))
    )
    c, s = math.cos(square[2]), math.sin(square[2])
    u, v = c * x[:, None] + s * y, -s * x[:, None] + c * y
    return np.asarray((np.abs(u) <= 0.5 * SQUARE_M) & (np.abs(v) <= 0.5 * SQUARE_M))
