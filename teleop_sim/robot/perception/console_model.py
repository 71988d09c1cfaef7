"""How far points are from the console's known surface, in any pose: what detection fits.

The shape itself is in ``teleop_sim.world.console``: pure numbers that everybody knows beforehand. Frames are as there.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from teleop_sim.robot.perception.rays import Floats
from teleop_sim.world import console as shape
from teleop_sim.world.console import Block

FOOT_Z_M: Final = -shape.WALKWAY_HEIGHT_M
"""The console's foot is on the soil, under the surface of the walkway."""


def axes(yaw_rad: float) -> tuple[Floats, Floats, Floats]:
    """Axis out of the face, its direction away and up, and left, of a console at a yaw: three unit vectors (3,)."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    ct, st = np.cos(shape.TILT_RAD), np.sin(shape.TILT_RAD)
    return np.array([-st * c, -st * s, ct]), np.array([ct * c, ct * s, st]), np.array([-s, c, 0.0])


def wheel_centres(pose: Floats) -> Floats:
    """Centres (2, 3) of the yaw and the pitch wheel, for a foot at x, y, z and a yaw (4,)."""
    left = axes(float(pose[3]))[2]
    half = shape.WHEEL_SEPARATION_M / 2.0
    return np.array([pose[:3] + y * left + np.array([0.0, 0.0, shape.WHEEL_HEIGHT_M]) for y in (half, -half)])


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
    for block in shape.BLOCKS:
        np.minimum(best, _block(block, x, side, z), out=best)
    return best


def _block(block: Block, x: Floats, side: Floats, z: Floats) -> Floats:
    u, w = x - block.centre[0], z - block.centre[2]
    if block.lean_rad:
        ct, st = np.cos(block.lean_rad), np.sin(block.lean_rad)
        u, w = ct * u + st * w, ct * w - st * u
    u, v, w = np.abs(u) - block.half[0], side - block.half[1], np.abs(w) - block.half[2]
    outside = np.sqrt(np.maximum(u, 0.0) ** 2 + np.maximum(v, 0.0) ** 2 + np.maximum(w, 0.0) ** 2)
    return np.asarray(outside + np.minimum(np.maximum(u, np.maximum(v, w)), 0.0))


def _wheels(x: Floats, y: Floats, z: Floats) -> Floats:
    """Distance to the nearer wheel: both are mirror images of each other."""
    ct, st = np.cos(shape.TILT_RAD), np.sin(shape.TILT_RAD)
    w = z - shape.WHEEL_HEIGHT_M
    along, across = ct * x + st * w, np.abs(y) - shape.WHEEL_SEPARATION_M / 2.0
    height = np.abs(ct * w - st * x)
    r = np.sqrt(along * along + across * across)
    beyond, over = r - shape.WHEEL_RADIUS_M, height - shape.WHEEL_HALF_THICKNESS_M
    outside = np.sqrt(np.maximum(beyond, 0.0) ** 2 + np.maximum(over, 0.0) ** 2)
    return np.asarray(outside + np.minimum(np.maximum(beyond, over), 0.0))
