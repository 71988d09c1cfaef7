"""Fits of simple shapes to points: plane, ball, console."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from teleop_sim.robot.perception.console_model import distance
from teleop_sim.robot.perception.rays import Floats
from teleop_sim.world.console import TILT_RAD

# All assumed, from the console's size and the LIDAR's noise of 1 cm, unless a line says why.
TRIES: Final = 300  # with a tenth of the points on the face 300 triples miss it in 26 %, with a fifth in 9 %
SAMPLE: Final = 400
SLOPE_TOLERANCE_RAD: Final = 0.1
FACING_SHARE: Final = 0.3  # cosine between the face's slope and the way to the robot: within 72 degrees
LEAST_TRIANGLE_M2: Final = 2e-3  # twice the area of a triple: thinner ones have no direction
# The wheels lie 4 cm over the face: a wider threshold or a looser slope gives a plane through both, 10 degrees wrong.
PLANE_THRESHOLD_M: Final = 0.015
LEAST_PLANE_POINTS: Final = 40
BALL_SCALE_M: Final = 0.015
FIT_SHARE_M: Final = 0.03  # points nearer than this count as on the console
STEP: Final = 1e-4  # of numerical slopes [m or rad]
LONGEST_STEP: Final = 0.1  # of one round of a fit [m or rad]


@dataclass(frozen=True, eq=False)
class Plane:
    """``normal @ p = offset_m``; ``normal`` (3,) points up. ``share`` and ``middle`` (3,) of the points on it."""

    normal: Floats
    offset_m: float
    share: float
    middle: Floats


def fit_sloped_plane(points: Floats, towards: Floats, rng: np.random.Generator) -> Plane | None:
    """The plane with the best support among those that slope like the console's face towards the robot; None: no such.

    Args:
        points: (n, 3).
        towards: (2,) level unit vector from the points to the robot.
        rng: picks the triples.

    Method: MSAC (Torr and Zisserman, CVIU 78 (2000), 138-156), then least squares on the inliers.

    """
    few = points[rng.integers(0, len(points), min(SAMPLE, len(points)))]
    triple = few[rng.integers(0, len(few), (TRIES, 3))]
    normal = np.cross(triple[:, 1] - triple[:, 0], triple[:, 2] - triple[:, 0])
    length = np.linalg.norm(normal, axis=1)
    good = length > LEAST_TRIANGLE_M2
    normal, at = normal[good] / length[good, None], triple[good, 0]
    normal *= np.where(normal[:, 2:] < 0.0, -1.0, 1.0)
    good = np.abs(np.arccos(np.clip(normal[:, 2], -1.0, 1.0)) - TILT_RAD) < SLOPE_TOLERANCE_RAD
    good &= normal[:, :2] @ towards > FACING_SHARE * np.hypot(normal[:, 0], normal[:, 1])
    if not good.any():
        return None
    normal, offset = normal[good], np.einsum("ij,ij->i", normal[good], at[good])
    cost = np.minimum((few @ normal.T - offset) ** 2, PLANE_THRESHOLD_M**2).sum(axis=0)
    best = int(np.argmin(cost))
    return _polished(points, normal[best], float(offset[best]))


def _polished(points: Floats, normal: Floats, offset: float) -> Plane | None:
    for _ in range(3):
        on = points[np.abs(points @ normal - offset) < PLANE_THRESHOLD_M]
        if len(on) < LEAST_PLANE_POINTS:
            return None
        middle = on.mean(axis=0)
        normal = np.linalg.eigh((on - middle).T @ (on - middle))[1][:, 0]
        normal = normal if normal[2] > 0.0 else -normal
        offset = float(normal @ middle)
    return Plane(normal, offset, len(on) / len(points), np.median(on, axis=0))


def fit_ball(points: Floats, radius_m: float, eye: Floats, rounds: int = 10) -> Floats:
    """Centre (3,) of a ball of known radius from points (n, 3) on the side that ``eye`` (3,) sees.

    Method: Gauss-Newton on the distance to the surface with Cauchy weights; starts behind the points' mean.
    """
    mean = points.mean(axis=0)
    way = mean - eye
    centre = mean + 0.6 * radius_m * way / np.linalg.norm(way)
    for _ in range(rounds):
        out = points - centre
        length = np.linalg.norm(out, axis=1)
        error = length - radius_m
        weight = 1.0 / (1.0 + (error / BALL_SCALE_M) ** 2)
        slope = -out / length[:, None]
        normal = slope.T @ (slope * weight[:, None]) + 5e-5 * len(points) * np.eye(3)
        centre = centre - np.linalg.solve(normal, slope.T @ (weight * error))
    return np.asarray(centre)


def fit_console(points: Floats, poses: Floats, scales_m: tuple[float, ...], rounds: int) -> tuple[Floats, Floats]:
    """Improve several poses of the console at once.

    Args:
        points: (n, 3).
        poses: (k, 4) starts: x, y, z of the foot [m] and yaw [rad].
        scales_m: of the residuals that count, from coarse to fine.
        rounds: Gauss-Newton steps at each scale.

    Returns:
        poses (k, 4), and the share (k,) of points that lie within 3 cm of the console in them.

    Method: Gauss-Newton with Geman-McClure weights and numerical slopes, all poses and slopes in one evaluation.

    """
    shift = np.vstack([np.zeros(4), STEP * np.eye(4)])
    poses = poses.copy()
    for scale in scales_m:
        for _ in range(rounds):
            at = distance((poses[:, None, :] + shift).reshape(-1, 4), points).reshape(len(poses), 5, -1)
            error, slope = at[:, 0], (at[:, 1:] - at[:, :1]) / STEP
            weight = 1.0 / (1.0 + (error / scale) ** 2) ** 2
            normal = np.einsum("kin,kn,kjn->kij", slope, weight, slope, optimize=True)
            diagonal = np.einsum("kii->ki", normal)
            damped = normal + (1e-3 * diagonal + 1e-6 * len(points))[:, :, None] * np.eye(4)
            right = np.einsum("kin,kn->ki", slope, weight * error)
            poses -= np.clip(np.linalg.solve(damped, right[..., None])[..., 0], -LONGEST_STEP, LONGEST_STEP)
    return poses, (np.abs(distance(poses, points)) < FIT_SHARE_M).mean(axis=1)
