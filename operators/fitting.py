"""A template fitted to points by least squares of their distances to its surface.

Robust Gauss-Newton with Geman-McClure weights, from a coarse scale of residuals to a fine one, so that points of other
things count little. All six degrees of freedom; those that the points say nothing of (how a wheel without spokes has
been spun) stay as they were.

Points lie where surfaces are large, and a door's lever would be lost among those of its panel. So a wall behind a thing
is taken away, and for a thing with a face of its own what stands off that face counts as much as the face.

Not modelled: that parts of the template where no points are speak against a pose; what a sensor could not see.

Source of the weights: Geman and McClure, Bull. ISI 52 (1987), 5-21; of the planes: Fischler and Bolles, Commun. ACM 24
(1981), 381-395 (RANSAC); of the idea that points must hold every degree of freedom: Gelfand et al., 3DIM 2003, 260-267.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Final

import numpy as np
import numpy.typing as npt

from teleop_sim.templates.elements import Template
from teleop_sim.templates.poses import Pose, pose_of
from teleop_sim.templates.shapes import bounds

Floats = npt.NDArray[np.float64]

# Assumed, from trials on doors, consoles and valves with 1 cm of noise, unless a line says why.
COARSE_SCALES_M: Final = (0.10, 0.05)
LEAST_SCALE_M: Final = 0.025
SCALE_VOXELS: Final = 0.7
COARSE_ROUNDS: Final = 6
FINE_ROUNDS: Final = 40
NEAR_M: Final = 0.25  # points farther from the first pose belong to something else
LEAST_POINTS: Final = 20
COARSE_POINTS: Final = 300
FINE_POINTS: Final = 1500
LONGEST_STEP: Final = 0.1  # of one round [m or rad]
DONE_STEP: Final = 1e-6  # [m or rad]
DONE_VOXELS: Final = 0.005
DAMPING: Final = 1e-4  # of the diagonal
STIFFNESS: Final = 1e-9  # of each point, for what the points say nothing of
SLIDES_M: Final = ((0.0, 0.0), (0.08, 0.0), (-0.08, 0.0), (0.0, 0.08), (0.0, -0.08))  # along a face, which hides it
PLANE_TRIES: Final = 200
PLANE_SHARE: Final = 0.33  # of the points: a plane with more is a wall
WALL_QUANTILE: Final = 0.9  # of the distances of a wall's points from their middle
WALL_REACH: Final = 0.5  # of the thing's diagonal is less than that
PLANE_BASE_M: Final = 0.03
PLANE_VOXELS: Final = 0.5
OFF_SHARE: Final = 0.5  # of all weight for what stands off the face
MOST_WEIGHT: Final = 20.0  # of one point over another: few points may be noise


@dataclass(frozen=True, eq=False)
class Prepared:
    """Points to fit to.

    Attributes:
        points: (n, 3) [m], in an order that runs through space.
        weights: (n,) above zero, 1 for most.
        off: (n,) which stand off the largest plane.
        voxel_m: edge of the voxels whose centres they are, or 0.

    """

    points: Floats
    weights: Floats
    off: npt.NDArray[np.bool_]
    voxel_m: float = 0.0

    def __len__(self) -> int:
        return len(self.points)

    def only(self, which: npt.NDArray[np.bool_] | npt.NDArray[np.intp]) -> Prepared:
        """Some of them."""
        return Prepared(self.points[which], self.weights[which], self.off[which], self.voxel_m)

    def thinned(self, most: int) -> Prepared:
        """At most so many, half of them off the plane if there are as many; evenly from the list."""
        if len(self) <= most:
            return self
        off, on = np.flatnonzero(self.off), np.flatnonzero(~self.off)
        count = min(len(off), max(most // 2, most - len(on)))
        kept = np.sort(np.concatenate([_evenly(off, count), _evenly(on, most - count)]))
        weights = self.weights.copy()
        for group, left in ((off, count), (on, most - count)):
            weights[group] *= len(group) / max(left, 1)
        return Prepared(self.points[kept], weights[kept], self.off[kept], self.voxel_m)


@dataclass(frozen=True, eq=False)
class _Solid:
    """A template's solids as the compiled loops want them, and their middle (3,)."""

    rows: Floats
    middle: Floats


@dataclass(frozen=True)
class Fit:
    """What came of a fit.

    Attributes:
        pose: of the template.
        rms_m: root mean square distance of the points that count as its own, within twice the finest scale [m]; NaN
            without any.
        share: of the points near it that are its own.
        used: number of points near it.

    """

    pose: Pose
    rms_m: float
    share: float
    used: int


def prepared(template: Template, points_m: Floats, voxel_m: float, rng: np.random.Generator) -> Prepared:
    """Points (n, 3) without a wall behind the thing, or, of a thing with a face, with what stands off it made to count.

    A wall is a plane that a third of the points or more lie in, that reaches farther than the thing could, and that is
    not all there is: it would pull the fit onto itself. (A wheel is a plane too.)
    """
    everything = Prepared(points_m, np.ones(len(points_m)), np.zeros(len(points_m), dtype=bool), voxel_m)
    if len(points_m) < LEAST_POINTS:
        return everything
    on = largest_plane(points_m, PLANE_BASE_M + PLANE_VOXELS * voxel_m, rng)
    if not template.has_face:
        return everything.only(~on) if _is_wall(template, points_m, on) else everything
    off = ~on
    want = OFF_SHARE / (1.0 - OFF_SHARE) * float(on.sum()) / max(float(off.sum()), 1.0)
    return Prepared(points_m, np.where(off, min(max(want, 1.0), MOST_WEIGHT), 1.0), off, voxel_m)


def _is_wall(template: Template, points_m: Floats, on: npt.NDArray[np.bool_]) -> bool:
    if float(on.mean()) < PLANE_SHARE or int((~on).sum()) < LEAST_POINTS:
        return False
    from_middle = np.linalg.norm(points_m[on] - np.median(points_m[on], axis=0), axis=1)
    low, high = bounds(template.shapes)
    return float(np.quantile(from_middle, WALL_QUANTILE)) > WALL_REACH * float(np.linalg.norm(high - low))


def largest_plane(points_m: Floats, threshold_m: float, rng: np.random.Generator) -> npt.NDArray[np.bool_]:
    """Which of the points (n, 3) lie within a threshold of the plane that most of them lie in."""
    triple = points_m[rng.integers(0, len(points_m), (PLANE_TRIES, 3))]
    normal = np.cross(triple[:, 1] - triple[:, 0], triple[:, 2] - triple[:, 0])
    length = np.sqrt(np.einsum("ij,ij->i", normal, normal))
    good = length > 1e-3
    if not good.any():
        return np.zeros(len(points_m), dtype=bool)
    normal, at = normal[good] / length[good, None], triple[good, 0]
    few = points_m[_evenly(np.arange(len(points_m)), min(len(points_m), FINE_POINTS))]
    offset = np.einsum("ij,ij->i", normal, at)
    best = int(_loops().votes(few, normal, offset, threshold_m).argmax())
    return np.asarray(np.abs(points_m @ normal[best] - offset[best]) < threshold_m)


def fit_template(template: Template, cloud: Prepared, start: Pose) -> Fit:
    """Fit a template from a first pose, to the points within 25 cm of it.

    A thing with a face is also tried from 8 cm off to each side along it.

    Args:
        template: its solids' surface is fitted.
        cloud: what it is fitted to.
        start: in the points' frame.

    Returns:
        The start itself, with no share, if fewer than 20 points are near it.

    """
    solid = _solid(template)
    near = cloud.only(np.abs(_distance(solid, cloud.points, start)) < NEAR_M)
    if len(near) < LEAST_POINTS:
        return Fit(start, float("nan"), 0.0, len(near))
    fine_m = _fine_m(cloud)
    best = fit_roughly(template, near, _starts(template, start))
    pose = _descend(solid, near.thinned(FINE_POINTS), best, fine_m, FINE_ROUNDS)
    off = np.abs(_distance(solid, near.points, pose))
    own = off < 2.0 * fine_m
    rms_m = float(np.sqrt((off[own] ** 2).mean())) if own.any() else float("nan")
    return Fit(pose, rms_m, float(own.mean()), len(near))


def fit_roughly(template: Template, cloud: Prepared, starts: Sequence[Pose]) -> Pose:
    """The pose that explains most of the points, of those that a few rounds lead to from some starts."""
    few, solid = cloud.thinned(COARSE_POINTS), _solid(template)
    tried = []
    for start in starts:
        pose = start
        for scale_m in COARSE_SCALES_M:
            pose = _descend(solid, few, pose, scale_m, COARSE_ROUNDS)
        tried.append((_cost(solid, few, pose, _fine_m(cloud)), pose))
    return min(tried, key=lambda cost_and_pose: cost_and_pose[0])[1]


def _loops() -> ModuleType:
    """The compiled loops. Loaded with the first fit: numba takes a while, and not every run lays a template."""
    from teleop_sim.operators import fit_math

    return fit_math


def _fine_m(cloud: Prepared) -> float:
    return max(LEAST_SCALE_M, SCALE_VOXELS * cloud.voxel_m)


def _starts(template: Template, start: Pose) -> list[Pose]:
    if not template.has_face:
        return [start]
    return [pose_of(start.place(np.array((0.0, y, z))), start.matrix) for y, z in SLIDES_M]


def _solid(template: Template) -> _Solid:
    return _Solid(_loops().packed(template.shapes), np.array(template.middle_m))


def _distance(solid: _Solid, points: Floats, pose: Pose) -> Floats:
    pivot = pose.place(solid.middle)
    return np.asarray(_loops().distances(solid.rows, points, pose.matrix, pivot, solid.middle))


def _descend(solid: _Solid, cloud: Prepared, pose: Pose, scale_m: float, rounds: int) -> Pose:
    """Gauss-Newton rounds at one scale. The pose turns about the template's middle, which keeps the axes apart."""
    middle, done = solid.middle, max(DONE_STEP, DONE_VOXELS * cloud.voxel_m)
    stiffness = STIFFNESS * len(cloud)
    matrix, pivot = _loops().descend(
        solid.rows, cloud.points, cloud.weights, pose.matrix, pose.place(middle), middle,
        scale_m, rounds, done, LONGEST_STEP, DAMPING, stiffness,
    )  # fmt: skip
    return pose_of(pivot - matrix @ middle, matrix)


def _cost(solid: _Solid, cloud: Prepared, pose: Pose, scale_m: float) -> float:
    """Weighted mean of Geman-McClure's function, 0 (on the surface) to 1 (far from it)."""
    square = (_distance(solid, cloud.points, pose) / scale_m) ** 2
    return float(np.average(square / (1.0 + square), weights=cloud.weights))


def _evenly(places: npt.NDArray[np.intp], count: int) -> npt.NDArray[np.intp]:
    """So many of them: an octree's order runs through space, so they stay spread."""
    if not len(places) or count <= 0:
        return places[:0]
    chosen: npt.NDArray[np.intp] = places[np.linspace(0, len(places) - 1, count).round().astype(np.intp)]
    return chosen
