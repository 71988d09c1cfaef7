"""What the robot knows of the console beforehand: its shape and the colours of its wheels.

Console frame: origin at the foot, on the soil below the middle of the two wheels; x away from the robot, y left, z up.

Source: osrf/srcsim @2225f67, model of the dish with its crank wheels. Solid parts are boxes fitted to the bounds of
the console's mesh (x -0.139 to 0.324, y +-0.376, z 0.004 to 0.955 in the console frame); the slope under the wheels is
assumed to lie 4 cm below the wheels' centres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from teleop_sim.robot.perception.rays import Floats

TILT_RAD: Final = 0.52  # slope of the face and of both wheels
FOOT_Z_M: Final = -0.1  # the soil, under the surface of the walkway
WHEEL_HEIGHT_M: Final = 0.91  # of the wheels' centres over the foot
WHEEL_SEPARATION_M: Final = 0.4
WHEEL_RADIUS_M: Final = 0.14
WHEEL_HALF_THICKNESS_M: Final = 0.015  # assumed
KNOB_ORBIT_M: Final = 0.123
KNOB_HEIGHT_M: Final = 0.082
KNOB_RADIUS_M: Final = 0.029
WHEEL_Y_M: Final = (WHEEL_SEPARATION_M / 2.0, -WHEEL_SEPARATION_M / 2.0)
"""Of the yaw wheel (robot's left, red) and the pitch wheel (its right, blue)."""


@dataclass(frozen=True)
class Block:
    """A box: centre and half sizes along x, y, z [m]; its x axis rises by ``tilt_rad``."""

    centre: tuple[float, float, float]
    half: tuple[float, float, float]
    tilt_rad: float = 0.0


BLOCKS: Final = (
    Block((0.0925, 0.0, 0.392), (0.2315, 0.376, 0.392)),  # lower body
    Block((0.2395, 0.0, 0.476), (0.0845, 0.376, 0.476)),  # back
    Block((0.0780, 0.0, 0.415), (0.0780, 0.376, 0.415)),  # filling under the slope
    Block((0.0279, 0.0, 0.8338), (0.1695, 0.376, 0.040), TILT_RAD),  # sloping face
)


def axes(yaw_rad: float) -> tuple[Floats, Floats, Floats]:
    """Axis out of the face, its direction away and up, and left, of a console at a yaw: three unit vectors (3,)."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    ct, st = np.cos(TILT_RAD), np.sin(TILT_RAD)
    return np.array([-st * c, -st * s, ct]), np.array([ct * c, ct * s, st]), np.array([-s, c, 0.0])


def wheel_centres(pose: Floats) -> Floats:
    """Centres (2, 3) of the yaw and the pitch wheel, for a foot at x, y, z and a yaw (4,)."""
    left = axes(float(pose[3]))[2]
    return np.array([pose[:3] + y * left + np.array([0.0, 0.0, WHEEL_HEIGHT_M]) for y in WHEEL_Y_M])


def distance(poses: Floats, points: Floats) -> Floats:
    """Signed distance of points to the console without its knobs, for several poses at once.

    Args:
        poses: (k, 4), x, y, z of the foot and yaw.
        points: (n, 3), in the frame of the poses.

    Returns:
        (k, n) [m], negative inside. Exact outside.

    """
    c, s = np.cos(poses[:, 3, None]), np.sin(poses[:, 3, None])
    u = points[:, 0] - poses[:, 0, None]
    v = points[:, 1] - poses[:, 1, None]
    z = points[:, 2] - poses[:, 2, None]
    x, y = c * u + s * v, c * v - s * u
    best = _wheels(x, y, z)
    side = np.abs(y)
    for block in BLOCKS:
        np.minimum(best, _block(block, x, side, z), out=best)
    return best


def _block(block: Block, x: Floats, side: Floats, z: Floats) -> Floats:
    u, w = x - block.centre[0], z - block.centre[2]
    if block.tilt_rad:
        ct, st = np.cos(block.tilt_rad), np.sin(block.tilt_rad)
        u, w = ct * u + st * w, ct * w - st * u
    u, v, w = np.abs(u) - block.half[0], side - block.half[1], np.abs(w) - block.half[2]
    outside = np.sqrt(np.maximum(u, 0.0) ** 2 + np.maximum(v, 0.0) ** 2 + np.maximum(w, 0.0) ** 2)
    return np.asarray(outside + np.minimum(np.maximum(u, np.maximum(v, w)), 0.0))


def _wheels(x: Floats, y: Floats, z: Floats) -> Floats:
    """Distance to the nearer wheel: both are mirror images of each other."""
    ct, st = np.cos(TILT_RAD), np.sin(TILT_RAD)
    w = z - WHEEL_HEIGHT_M
    along, across = ct * x + st * w, np.abs(y) - WHEEL_SEPARATION_M / 2.0
    height = np.abs(ct * w - st * x)
    r = np.sqrt(along * along + across * across)
    beyond, over = r - WHEEL_RADIUS_M, height - WHEEL_HALF_THICKNESS_M
    outside = np.sqrt(np.maximum(beyond, 0.0) ** 2 + np.maximum(over, 0.0) ** 2)
    return np.asarray(outside + np.minimum(np.maximum(beyond, over), 0.0))
