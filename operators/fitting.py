"""A template fitted to points by least squares of their distances to its surface.

Robust Gauss-Newton with Geman-McClure weights (``descent.py``), from a coarse scale of residuals to a fine one, so that
points of other things count little. All six degrees of freedom; those that the points say nothing of (how a wheel
without spokes has been spun) stay as they were.

Points lie where surfaces are large, and a door's lever would be lost among those of its panel. So a wall behind a thing
is taken away, and for a thing with a face of its own what stands off that face counts as much as the face. Of a panel
with a handle the handle must be borne out by points besides (``standoff.py``).

Not modelled: that other parts of a template where no points are speak against a pose; what a sensor could not see.

Source of the planes: Fischler and Bolles, Commun. ACM 24 (1981), 381-395 (RANSAC); of the idea that points must hold
every degree of freedom: Gelfand et al., 3DIM 2003, 260-267.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from teleop_sim.operators.descent import (
    COARSE_POINTS,
    COARSE_ROUNDS,
    COARSE_SCALES_M,
    FINE_POINTS,
    FINE_ROUNDS,
    Bools,
    Floats,
    Prepared,
    cost,
    descend,
    distance,
    evenly,
    loops,
    solid_of,
)
from teleop_sim.operators.standoff import borne_share, handle_of, laid_on_face, settled
from teleop_sim.templates.elements import Template
from teleop_sim.templates.poses import Pose, Triple, pose_of
from teleop_sim.templates.shapes import bounds

# Assumed, from trials on doors, consoles and valves with 1 cm of noise, unless a line says why.
NEAR_M: Final = 0.25  # points farther from the first pose belong to something else
LEAST_POINTS: Final = 20
SLIDES_M: Final = ((0.0, 0.0), (0.08, 0.0), (-0.08, 0.0), (0.0, 0.08), (0.0, -0.08))  # along a face, which hides it
PLANE_TRIES: Final = 200
PLANE_SHARE: Final = 0.33  # of the points: a plane with more is a wall
WALL_QUANTILE: Final = 0.9  # of the distances of a wall's points from their middle
WALL_REACH: Final = 0.5  # of the thing's diagonal is less than that
PLANE_BASE_M: Final = 0.03
PLANE_VOXELS: Final = 0.5
OFF_SHARE: Final = 0.5  # of all weight for what stands off the face
MOST_WEIGHT: Final = 20.0  # of one point over another: few points may be noise


@dataclass(frozen=True)
class Fit:
    """What came of a fit.

    Attributes:
        pose: of the template.
        rms_m: root mean square distance of the points that count as its own, within twice the finest scale [m]; NaN
            without any.
        share: of the points near it that are its own.
        used: number of points near it.
        borne: share of a handle's surface, as far as it faces the sensor, that points bear out; 1 without a handle.

    """

    pose: Pose
    rms_m: float
    share: float
    used: int
    borne: float = 1.0


def prepared(
    template: Template, points_m: Floats, voxel_m: float, rng: np.random.Generator, eye_m: Triple | None = None
) -> Prepared:
    """Points (n, 3) without a wall behind the thing, or, of a thing with a face, with what stands off it made to count.

    A wall is a plane that a third of the points or more lie in, that reaches farther than the thing could, and that is
    not all there is: it would pull the fit onto itself. (A wheel is a plane too.) ``eye_m``: where they were seen from;
    None: from all around.
    """
    eye = None if eye_m is None else np.array(eye_m)
    everything = Prepared(points_m, np.ones(len(points_m)), np.zeros(len(points_m), dtype=bool), voxel_m, eye)
    if len(points_m) < LEAST_POINTS:
        return everything
    on = largest_plane(points_m, PLANE_BASE_M + PLANE_VOXELS * voxel_m, rng)
    if not template.has_face:
        return everything.only(~on) if _is_wall(template, points_m, on) else everything
    off = ~on
    want = OFF_SHARE / (1.0 - OFF_SHARE) * float(on.sum()) / max(float(off.sum()), 1.0)
    return Prepared(points_m, np.where(off, min(max(want, 1.0), MOST_WEIGHT), 1.0), off, voxel_m, eye)


def _is_wall(template: Template, points_m: Floats, on: Bools) -> bool:
    if float(on.mean()) < PLANE_SHARE or int((~on).sum()) < LEAST_POINTS:
        return False
    from_middle = np.linalg.norm(points_m[on] - np.median(points_m[on], axis=0), axis=1)
    low, high = bounds(template.shapes)
    return float(np.quantile(from_middle, WALL_QUANTILE)) > WALL_REACH * float(np.linalg.norm(high - low))


def largest_plane(points_m: Floats, threshold_m: float, rng: np.random.Generator) -> Bools:
    """Which of the points (n, 3) lie within a threshold of the plane that most of them lie in."""
    triple = points_m[rng.integers(0, len(points_m), (PLANE_TRIES, 3))]
    normal = np.cross(triple[:, 1] - triple[:, 0], triple[:, 2] - triple[:, 0])
    length = np.sqrt(np.einsum("ij,ij->i", normal, normal))
    good = length > 1e-3
    if not good.any():
        return np.zeros(len(points_m), dtype=bool)
    normal, at = normal[good] / length[good, None], triple[good, 0]
    few = points_m[evenly(np.arange(len(points_m)), min(len(points_m), FINE_POINTS))]
    offset = np.einsum("ij,ij->i", normal, at)
    best = int(loops().votes(few, normal, offset, threshold_m).argmax())
    return np.asarray(np.abs(points_m @ normal[best] - offset[best]) < threshold_m)


def fit_template(template: Template, cloud: Prepared, start: Pose) -> Fit:
    """Fit a template from a first pose, to the points within 25 cm of it.

    A thing with a face is also tried from 8 cm off to each side along it; a panel with a handle from wherever along it
    points stand off.

    Args:
        template: its solids' surface is fitted.
        cloud: what it is fitted to.
        start: in the points' frame.

    Returns:
        The start itself, with no share, if fewer than 20 points are near it.

    """
    solid, handle = solid_of(template), handle_of(template)
    near = cloud.only(np.abs(distance(solid, cloud.points, start)) < NEAR_M)
    if len(near) < LEAST_POINTS:
        return Fit(start, float("nan"), 0.0, len(near))
    if handle is None:
        pose = fit_roughly(template, near, _starts(template, start))
        pose = descend(solid, near.thinned(FINE_POINTS), pose, near.fine_m, FINE_ROUNDS)
    else:
        pose = settled(handle, near, laid_on_face(handle, near, start))
    away = np.abs(distance(solid, near.points, pose))
    own = away < 2.0 * near.fine_m
    rms_m = float(np.sqrt((away[own] ** 2).mean())) if own.any() else float("nan")
    borne = 1.0 if handle is None else borne_share(handle, near, pose)
    return Fit(pose, rms_m, float(own.mean()), len(near), borne)


def fit_roughly(template: Template, cloud: Prepared, starts: Sequence[Pose]) -> Pose:
    """The pose that explains most of the points, of those that a few rounds lead to from some starts."""
    few, solid = cloud.thinned(COARSE_POINTS), solid_of(template)
    tried = []
    for start in starts:
        pose = start
        for scale_m in COARSE_SCALES_M:
            pose = descend(solid, few, pose, scale_m, COARSE_ROUNDS)
        tried.append((cost(solid, few, pose, cloud.fine_m), pose))
    return min(tried, key=lambda cost_and_pose: cost_and_pose[0])[1]


def _starts(template: Template, start: Pose) -> list[Pose]:
    if not template.has_face:
        return [start]
    return [pose_of(start.place(np.array((0.0, y, z))), start.matrix) for y, z in SLIDES_M]
