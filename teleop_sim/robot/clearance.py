"""How near a forearm is to the torso: self-collision is not in the physics, so plans keep a distance.

Shapes are those of the robot's collisions: a capsule along the forearm and a box round the torso.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from teleop_sim.robot.commands import Side
from teleop_sim.robot.kinematics import Kinematics


def forearm_gap(kinematics: Kinematics, side: Side) -> tuple[float, np.ndarray]:
    """Return the gap [m] between forearm and torso and its slope (7,) [m/rad] in the arm's joints.

    The forearm is taken at both ends and its middle. Reads ``kinematics.data``: joint placements and Jacobians must be
    up to date. Negative: they overlap.
    """
    model, data = kinematics.model, kinematics.data
    forearm, torso = model.getJointId(kinematics.arms[side][4]), model.getJointId(kinematics.torso[-1])
    capsule, box = kinematics.forearms[side], kinematics.trunk
    a, b = np.array(capsule.a_m), np.array(capsule.b_m)
    placement, trunk = data.oMi[forearm], data.oMi[torso]
    points = placement.translation + np.array([a, (a + b) / 2, b]) @ placement.rotation.T
    local = (points - trunk.translation) @ trunk.rotation - np.array(box.a_m)
    excess = np.abs(local) - np.array(box.b_m)
    distances = np.linalg.norm(np.maximum(excess, 0.0), axis=1) + np.minimum(excess.max(axis=1), 0.0)
    nearest = int(np.argmin(distances))
    normal = trunk.rotation @ _outward(local[nearest], excess[nearest])
    jacobian = pin.getJointJacobian(model, data, forearm, pin.LOCAL_WORLD_ALIGNED)
    columns = jacobian[:, kinematics.positions(kinematics.arms[side]) - 1]
    lever = np.cross(points[nearest] - placement.translation, normal)
    return float(distances[nearest]) - capsule.radius_m, normal @ columns[:3] + lever @ columns[3:]


def _outward(local: np.ndarray, excess: np.ndarray) -> np.ndarray:
    """Unit vector (3,) in the torso's frame along which a point leaves the box fastest."""
    if excess.max() > 0.0:
        away = np.sign(local) * np.maximum(excess, 0.0)
        return np.asarray(away / np.linalg.norm(away))
    face = np.zeros(3)
    axis = int(np.argmax(excess))
    face[axis] = np.sign(local[axis])
    return face
