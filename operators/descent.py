"""A template's surface drawn to points: robust Gauss-Newton rounds, and how well a pose explains the points.

Source of the weights: Geman and McClure, Bull. ISI 52 (1987), 5-21. The loops are compiled (``fit_math.py``).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import ModuleType
from typing import Final

import numpy as np
import numpy.typing as npt

from teleop_sim.templates.elements import Template
from teleop_sim.templates.poses import Pose, pose_of

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

# Assumed, from trials on doors, consoles and valves with 1 cm of noise, unless a line says why.
COARSE_SCALES_M: Final = (0.10, 0.05)
LEAST_SCALE_M: Final = 0.025
SCALE_VOXELS: Final = 0.7
COARSE_ROUNDS: Final = 6
FINE_ROUNDS: Final = 40
COARSE_POINTS: Final = 300
FINE_POINTS: Final = 1500
LONGEST_STEP: Final = 0.1  # of one round [m or rad]
DONE_STEP: Final = 1e-6  # [m or rad]
DONE_VOXELS: Final = 0.005
DAMPING: Final = 1e-4  # of the diagonal
STIFFNESS: Final = 1e-9  # of each point, for what the points say nothing of


@dataclass(frozen=True, eq=False)
class Prepared:
    """Points to fit to.

    Attributes:
        points: (n, 3) [m], in an order that runs through space.
        weights: (n,) above zero, 1 for most.
        off: (n,) which stand off the largest plane.
        voxel_m: edge of the voxels whose centres they are, or 0.
        eye: (3,) where they were seen from [m]; None: from all around.

    """

    points: Floats
    weights: Floats
    off: Bools
    voxel_m: float = 0.0
    eye: Floats | None = None

    def __len__(self) -> int:
        return len(self.points)

    @property
    def fine_m(self) -> float:
        """The finest scale of residuals that such points bear [m]."""
        return max(LEAST_SCALE_M, SCALE_VOXELS * self.voxel_m)

    def only(self, which: Bools | npt.NDArray[np.intp]) -> Prepared:
        """Some of them."""
        return replace(self, points=self.points[which], weights=self.weights[which], off=self.off[which])

    def even(self) -> Prepared:
        """The same, one as good as another."""
        return replace(self, weights=np.ones(len(self)))

    def thinned(self, most: int) -> Prepared:
        """At most so many, half of them off the plane if there are as many; evenly from the list."""
        if len(self) <= most:
            return self
        off, on = np.flatnonzero(self.off), np.flatnonzero(~self.off)
        count = min(len(off), max(most // 2, most - len(on)))
        kept = np.sort(np.concatenate([evenly(off, count), evenly(on, most - count)]))
        weights = self.weights.copy()
        for group, left in ((off, count), (on, most - count)):
            weights[group] *= len(group) / max(left, 1)
        return replace(self, weights=weights).only(kept)


@dataclass(frozen=True, eq=False)
class Solid:
    """A template's solids as the compiled loops want them, and their middle (3,)."""

    rows: Floats
    middle: Floats


def solid_of(template: Template) -> Solid:
    """Of a template."""
    return Solid(loops().packed(template.shapes), np.array(template.middle_m))


def loops() -> ModuleType:
    """The compiled loops. Loaded with the first fit: numba takes a while, and not every run lays a template."""
    from teleop_sim.operators import fit_math

    return fit_math


def distance(solid: Solid, points: Floats, pose: Pose) -> Floats:
    """Signed distance (n,) of points (n, 3) to the surface at a pose [m]."""
    pivot = pose.place(solid.middle)
    return np.asarray(loops().distances(solid.rows, points, pose.matrix, pivot, solid.middle))


def descend(solid: Solid, cloud: Prepared, pose: Pose, scale_m: float, rounds: int) -> Pose:
    """Gauss-Newton rounds at one scale. The pose turns about the template's middle, which keeps the axes apart."""
    middle, done = solid.middle, max(DONE_STEP, DONE_VOXELS * cloud.voxel_m)
    stiffness = STIFFNESS * len(cloud)
    matrix, pivot = loops().descend(
        solid.rows, cloud.points, cloud.weights, pose.matrix, pose.place(middle), middle,
        scale_m, rounds, done, LONGEST_STEP, DAMPING, stiffness,
    )  # fmt: skip
    return pose_of(pivot - matrix @ middle, matrix)


def cost(solid: Solid, cloud: Prepared, pose: Pose, scale_m: float) -> float:
    """Weighted mean of Geman-McClure's function, 0 (on the surface) to 1 (far from it)."""
    return cost_at(solid, cloud, pose.matrix, np.array(pose.position_m), scale_m)


def cost_at(solid: Solid, cloud: Prepared, matrix: Floats, shift: Floats, scale_m: float) -> float:
    """The same of a pose given as matrix (3, 3) and position (3,)."""
    away = loops().distances(solid.rows, cloud.points, matrix, shift + matrix @ solid.middle, solid.middle)
    square = (away / scale_m) ** 2
    return float(np.average(square / (1.0 + square), weights=cloud.weights))


def evenly(places: npt.NDArray[np.intp], count: int) -> npt.NDArray[np.intp]:
    """So many of them: an octree's order runs through space, so they stay spread."""
    if not len(places) or count <= 0:
        return places[:0]
    chosen: npt.NDArray[np.intp] = places[np.linspace(0, len(places) - 1, count).round().astype(np.intp)]
    return chosen
