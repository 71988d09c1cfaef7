"""The planner's lattice of body poses, and where on it a robot may not be."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from teleop_sim.robot.commands import PlanarPose
from teleop_sim.robot.footstep_moves import BIN_RAD
from teleop_sim.robot.footsteps import wrap
from teleop_sim.robot.occupancy import CELL_M, Occupancy, widened
from teleop_sim.robot.perception.rays import Bools, Floats

MARGIN_M: Final = 1.5  # assumed: the lattice reaches so far beyond start and goal


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
