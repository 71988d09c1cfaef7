"""Where a sensor truly is that is believed to be elsewhere."""

from __future__ import annotations

import numpy as np

from teleop_sim.robot.perception.rays import Floats, SensorPose
from teleop_sim.world.sense_errors import ALIGNED, Misalignment


def mounted(believed: SensorPose, wrong: Misalignment) -> SensorPose:
    """The true pose of a sensor."""
    if wrong == ALIGNED:
        return believed
    shifted = believed.position + believed.rotation @ np.asarray(wrong.shift_m)
    return SensorPose(believed.rotation @ rotation_of(np.asarray(wrong.turn_rad)), shifted)


def rotation_of(vector: Floats) -> Floats:
    """Rotation (3, 3) by a rotation vector (3,) [rad]; Rodrigues' formula."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * across + (1.0 - np.cos(angle)) * across @ across)
