"""How near a forearm is to the torso: self-collision is not in the physics, so plans keep a distance.

Shapes are assumed: Valkyrie's collision primitives (teleop_sim.robot.valkyrie), a capsule along the forearm and a box.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from teleop_sim.robot.commands import Side
from teleop_sim.robot.kinematics import Kinematics

FOREARM_RADIUS_M = 0.05
FOREARM_FROM_M, FOREARM_TO_M = 0.05, 0.22
TORSO_CENTRE_M = np.array([0.0, 0.0, 0.2])
TORSO_HALF_M = np.array([0.14, 0.2, 0.22])


def forearm_gap(kinematics: Kinematics, side: Side) -> tuple[float, np.ndarray]:
    """Return the gap [m] between forearm and torso and its slope (7,) [m/rad] in the arm's joints.

    Reads ``kinematics.data``: joint placements and Jacobians must be up to date. Negative: they overlap.
    """
    model, data = kinematics.model, kinematics.data
    forearm, torso = model.getJointId(kinematics.arms[side][4]), model.getJointId(kinematics.torso[-1])
    sign = 1.0 if side == "left" else -1.0
    along = sign * np.array([FOREARM_FROM_M, (FOREARM_FROM_M + FOREARM_TO_M) / 2, FOREARM_TO_M])
    placement, trunk = data.oMi[forearm], data.oMi[torso]
    points = placement.translation + np.outer(along, placement.rotation[:, 1])
    local = (points - trunk.translation) @ trunk.rotation - TORSO_CENTRE_M
    excess = np.abs(local) - TORSO_HALF_M
    distances = np.linalg.norm(np.maximum(excess, 0.0), axis=1) + np.minimum(excess.max(axis=1), 0.0)
    nearest = int(np.argmin(distances))
    normal = trunk.rotation @ _outward(local[nearest], excess[nearest])
    jacobian = pin.getJointJacobian(model, data, forearm, pin.LOCAL_WORLD_ALIGNED)
    columns = jacobian[:, kinematics.positions(kinematics.arms[side]) - 1]
    lever = np.cross(points[nearest] - placement.translation, normal)
    return float(distances[nearest]) - FOREARM_RADIUS_M, normal @ columns[:3] + lever @ columns[3:]


def _outward(local: np.ndarray, excess: np.ndarray) -> np.ndarray:
    """Unit vector (3,) in the torso's frame along which a point leaves the box fastest."""
    if excess.max() > 0.0:
        away = np.sign(local) * np.maximum(excess, 0.0)
        return np.asarray(away / np.linalg.norm(away))
    face = np.zeros(3)
    axis = int(np.argmax(excess))
    face[axis] = np.sign(local[axis])
    return face
