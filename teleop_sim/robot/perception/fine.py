"""Fine detection: LIDAR points around a region -> sloping face -> console -> knobs.

Order of work: crop; the face's plane gives a first yaw; the known shape is fitted (x, y, z, yaw); a ball is fitted to
the points that stand over each wheel. Each step can fail, and says so; a region in the wrong place fails too.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from teleop_sim.robot.commands import CircularAffordance, Vector
from teleop_sim.robot.perception import console_model as known
from teleop_sim.robot.perception.components import clusters
from teleop_sim.robot.perception.rays import Floats, vector
from teleop_sim.robot.perception.shapes import fit_ball, fit_console, fit_sloped_plane
from teleop_sim.robot.sightings import ConsoleFix
from teleop_sim.world import console

# Assumed, from the console's shape and the LIDAR's density at 1 to 2 m.
CROP_HALF_M: Final = 0.65
CROP_Z_M: Final = (0.45, 1.15)
LEAST_POINTS: Final = 150
LEAST_FACE_SHARE: Final = 0.08
LEAST_FIT_SHARE: Final = 0.5
FOOT_TOLERANCE_M: Final = 0.15
LEAST_WHEEL_POINTS: Final = 25
LEAST_KNOB_POINTS: Final = 8
KNOB_TOLERANCE_M: Final = 0.035
KNOB_GAP_M: Final = 0.03
PLANE_POINTS: Final = 4000
FIT_POINTS: Final = 900
FIRST_FIT_POINTS: Final = 400
FIRST_YAWS_RAD: Final = (-0.25, 0.0, 0.25)
COARSE_SCALES_M: Final = (0.10, 0.04)
FINE_SCALES_M: Final = (0.03, 0.015)
"""Residuals that count, from coarse to fine."""
WHEEL_SLAB_M: Final = 0.03
WHEEL_REACH_M: Final = 0.13
"""Points of a wheel's face are this near its plane and its axis."""
KNOB_SLAB_M: Final = (0.05, 0.14)
KNOB_RING_M: Final = (0.06, 0.19)
"""Points of a knob are this high over the plane and this far from the axis."""


def detect(points: Floats, region: Vector, eye: Vector, rng: np.random.Generator) -> tuple[ConsoleFix | None, str]:
    """Find the console's pose and its two handles in a cloud.

    Args:
        points: (n, 3), odometry frame.
        region: about the middle of the two wheels; within 0.3 m level will do, its height is not used.
        eye: where the sensor was.
        rng: picks samples.

    Returns:
        The fix and ``ok``; or None and the reason: ``few points``, ``no sloped plane``, ``shape does not fit``,
        ``wheel not seen``, ``no knob``, ``knob not on its circle``.

    """
    near = crop(points, region)
    if len(near) < LEAST_POINTS:
        return None, "few points"
    pose, why = _console_pose(near, np.asarray(eye)[:2] - np.asarray(region)[:2], rng)
    if pose is None:
        return None, why
    handles = []
    for centre in known.wheel_centres(pose):
        handle, why = _handle(near, centre, float(pose[3]), np.asarray(eye))
        if handle is None:
            return None, why
        handles.append(handle)
    place = (float(pose[0]), float(pose[1]), math.remainder(float(pose[3]), 2.0 * math.pi))
    return ConsoleFix(place, float(pose[2]), handles[0], handles[1]), "ok"


def crop(points: Floats, region: Vector) -> Floats:
    """Points (n, 3) in a box around a region: 1.3 m wide and deep, from 0.45 to 1.15 m over the walkway."""
    off = np.abs(points[:, :2] - np.asarray(region)[:2])
    z = points[:, 2]
    inside = (off[:, 0] < CROP_HALF_M) & (off[:, 1] < CROP_HALF_M) & (z > CROP_Z_M[0]) & (z < CROP_Z_M[1])
    return np.asarray(points[inside])


def _console_pose(near: Floats, way: Floats, rng: np.random.Generator) -> tuple[Floats | None, str]:
    """Foot and yaw (4,) of the console, from points around it and the level way to the robot."""
    towards = way / max(float(np.linalg.norm(way)), 1e-9)
    plane = fit_sloped_plane(near[:: len(near) // PLANE_POINTS + 1], towards, rng)
    if plane is None or plane.share < LEAST_FACE_SHARE:
        return None, "no sloped plane"
    yaw = float(np.arctan2(-plane.normal[1], -plane.normal[0]))
    sample = near[rng.permutation(len(near))[:FIT_POINTS]]
    starts = np.array([[plane.middle[0], plane.middle[1], known.FOOT_Z_M, yaw + turn] for turn in FIRST_YAWS_RAD])
    poses, shares = fit_console(sample[:FIRST_FIT_POINTS], starts, COARSE_SCALES_M, 5)
    poses, shares = fit_console(sample, poses[[int(np.argmax(shares))]], FINE_SCALES_M, 4)
    if shares[0] < LEAST_FIT_SHARE or abs(poses[0, 2] - known.FOOT_Z_M) > FOOT_TOLERANCE_M:
        return None, "shape does not fit"
    return poses[0], "ok"


def _handle(near: Floats, centre: Floats, yaw: float, eye: Floats) -> tuple[CircularAffordance | None, str]:
    """One wheel's handle from the points that stand over the wheel."""
    axis, zero, left = known.axes(yaw)
    off = near - centre
    height, along, across = off @ axis, off @ zero, off @ left
    radius = np.hypot(along, across)
    if int(((np.abs(height) < WHEEL_SLAB_M) & (radius < WHEEL_REACH_M)).sum()) < LEAST_WHEEL_POINTS:
        return None, "wheel not seen"
    slab = (height > KNOB_SLAB_M[0]) & (height < KNOB_SLAB_M[1])
    over = near[slab & (radius > KNOB_RING_M[0]) & (radius < KNOB_RING_M[1])]
    groups = clusters(over, KNOB_GAP_M)
    if not groups or len(groups[0]) < LEAST_KNOB_POINTS:
        return None, "no knob"
    ball = fit_ball(groups[0], console.KNOB_RADIUS_M, eye) - centre
    x, y = float(ball @ zero), float(ball @ left)
    if (
        abs(np.hypot(x, y) - console.KNOB_ORBIT_M) > KNOB_TOLERANCE_M
        or abs(float(ball @ axis) - console.KNOB_HEIGHT_M) > KNOB_TOLERANCE_M
    ):
        return None, "knob not on its circle"
    return CircularAffordance(
        vector(centre),
        vector(axis),
        vector(zero),
        console.KNOB_ORBIT_M,
        console.KNOB_HEIGHT_M,
        float(np.arctan2(y, x)),
    ), "ok"
