"""Ways over a grid of free cells: search, then straighten. Plain numpy and heapq; deterministic."""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from teleop_sim.robot.commands import PlanarPose
from teleop_sim.robot.perception.rays import Bools, Floats

Cell = tuple[int, int]

_STEPS = tuple((i, j, math.hypot(i, j)) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0))


@dataclass(frozen=True, slots=True)
class Grid:
    """A square of cells over the ground: lower left corner [m], side of a cell [m], cells a side."""

    x_m: float
    y_m: float
    cell_m: float
    count: int

    def index(self, xy: Floats) -> npt.NDArray[np.int64]:
        """Cells (n, 2) of points (n, 2); outside the grid they are below 0 or above ``count - 1``."""
        return np.floor((xy - (self.x_m, self.y_m)) / self.cell_m).astype(np.int64)

    def cell(self, x_m: float, y_m: float) -> Cell:
        """The cell of one point, the nearest one if the point is outside."""
        i, j = np.clip(self.index(np.array([[x_m, y_m]]))[0], 0, self.count - 1)
        return int(i), int(j)

    def centres(self, cells: npt.NDArray[np.int64]) -> Floats:
        """Middles (n, 2) of cells (n, 2)."""
        return np.asarray((cells + 0.5) * self.cell_m + (self.x_m, self.y_m))


def widen(mask: Bools, radius: float) -> Bools:
    """Cells within ``radius`` (in cells) of a set cell: dilation by a disc."""
    reach = int(radius)
    found = np.zeros_like(mask)
    padded = np.pad(mask, reach)
    n, m = mask.shape
    for i in range(-reach, reach + 1):
        half = math.isqrt(int(radius * radius) - i * i) if i * i <= int(radius * radius) else -1
        if half >= 0:
            # One row of the disc at once: a cell is reached if any in the row's window is set.
            total = np.cumsum(np.pad(padded[reach + i : reach + i + n], ((0, 0), (1, 0))), axis=1, dtype=np.int32)
            found |= total[:, reach + half + 1 :][:, :m] > total[:, reach - half :][:, :m]
    return found


def nearest(free: Bools, start: Cell, reach: float) -> Cell | None:
    """The free cell nearest to ``start``, if one is within ``reach`` (in cells)."""
    cells = np.argwhere(free)
    if len(cells) == 0:
        return None
    away = np.hypot(cells[:, 0] - start[0], cells[:, 1] - start[1])
    best = int(np.argmin(away))
    return (int(cells[best, 0]), int(cells[best, 1])) if away[best] <= reach else None


def search(free: Bools, start: Cell, goal: Cell) -> list[Cell] | None:
    """Shortest way over free cells with eight neighbours, both ends included; None: there is none.

    Method: A* with the straight distance as bound (Hart, Nilsson, Raphael, IEEE Trans. SSC 4 (1968), 100-107).
    """
    fringe = [(math.dist(start, goal), 0.0, start, start)]
    came: dict[Cell, Cell] = {}
    best = {start: 0.0}
    while fringe:
        _, cost, cell, before = heapq.heappop(fringe)
        if cell in came:
            continue
        came[cell] = before
        if cell == goal:
            return _trace(came, goal)
        for i, j, length in _STEPS:
            there = (cell[0] + i, cell[1] + j)
            if not (0 <= there[0] < free.shape[0] and 0 <= there[1] < free.shape[1] and free[there]):
                continue
            if cost + length < best.get(there, math.inf):
                best[there] = cost + length
                heapq.heappush(fringe, (cost + length + math.dist(there, goal), cost + length, there, cell))
    return None


def _trace(came: dict[Cell, Cell], goal: Cell) -> list[Cell]:
    way = [goal]
    while came[way[-1]] != way[-1]:
        way.append(came[way[-1]])
    return way[::-1]


def shorten(free: Bools, way: list[Cell]) -> list[Cell]:
    """Leave out the cells between two that see each other over free cells; the ends stay."""
    kept = [way[0]]
    at = 0
    while at < len(way) - 1:
        at = next(k for k in range(len(way) - 1, at, -1) if k == at + 1 or _sees(free, way[at], way[k]))
        kept.append(way[at])
    return kept


def _sees(free: Bools, a: Cell, b: Cell) -> bool:
    count = 2 * max(abs(b[0] - a[0]), abs(b[1] - a[1])) + 1
    i = np.rint(np.linspace(a[0], b[0], count)).astype(np.int64)
    j = np.rint(np.linspace(a[1], b[1], count)).astype(np.int64)
    return bool(free[i, j].all())


def facing_along(points: Floats) -> tuple[PlanarPose, ...]:
    """Poses at all points (n, 2) but the first, each facing the way it was come from the point before."""
    steps = np.diff(points, axis=0)
    yaw = np.arctan2(steps[:, 1], steps[:, 0])
    return tuple((float(x), float(y), float(turn)) for (x, y), turn in zip(points[1:], yaw, strict=True))
