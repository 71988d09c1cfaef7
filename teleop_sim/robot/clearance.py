"""How near an arm is to the trunk: physics lets them touch, so plans keep a distance.

Shapes are those of the robot's collisions: capsules along the arm's links and a box round the trunk. Cheap enough for
every step of a search; what else could touch is asked of ``teleop_sim.robot.collision`` once a path is found.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from teleop_sim.robot.commands import Side
from teleop_sim.robot.kinematics import Kinematics, Limb


@dataclass(frozen=True)
class Gap:
    """Between a limb and the trunk: how wide [m], negative if they overlap; where on the limb, which way out (3,)."""

    limb: Limb
    width_m: float
    point: np.ndarray
    normal: np.ndarray


def trunk_gaps(kinematics: Kinematics, side: Side) -> list[Gap]:
    """The gap of each of the arm's limbs, taken at both ends and the middle.

    Reads ``kinematics.data``: joint placements must be up to date.
    """
    data, box = kinematics.data, kinematics.trunk
    trunk, half = data.oMi[kinematics.trunk_joint], np.array(box.b_m)
    middle, turned = trunk.translation + trunk.rotation @ np.array(box.a_m), trunk.rotation
    gaps = []
    for limb in kinematics.limbs[side]:
        placement = data.oMi[limb.joint]
        points = placement.translation + limb.points @ placement.rotation.T
        local = (points - middle) @ turned
        excess = np.abs(local) - half
        outside = np.maximum(excess, 0.0)
        distances = np.sqrt((outside * outside).sum(axis=1)) + np.minimum(excess.max(axis=1), 0.0)
        k = int(distances.argmin())
        normal = turned @ _outward(local[k], excess[k])
        gaps.append(Gap(limb, float(distances[k]) - limb.radius_m, points[k], normal))
    return gaps


def slope(kinematics: Kinematics, side: Side, gap: Gap) -> np.ndarray:
    """How the gap changes with the arm's joints, (7,) [m/rad]. Joint Jacobians must be up to date."""
    data = kinematics.data
    jacobian = pin.getJointJacobian(kinematics.model, data, gap.limb.joint, pin.LOCAL_WORLD_ALIGNED)
    columns = jacobian[:, kinematics.positions(kinematics.arms[side]) - 1]
    (x, y, z), (a, b, c) = gap.point - data.oMi[gap.limb.joint].translation, gap.normal
    lever = np.array([y * c - z * b, z * a - x * c, x * b - y * a])
    return np.asarray(gap.normal @ columns[:3] + lever @ columns[3:])


def _outward(local: np.ndarray, excess: np.ndarray) -> np.ndarray:
    """Unit vector (3,) in the trunk's frame along which a point leaves the box fastest."""
    if excess.max() > 0.0:
        away = np.sign(local) * np.maximum(excess, 0.0)
        return np.asarray(away / np.sqrt(away @ away))
    face = np.zeros(3)
    axis = int(np.argmax(excess))
    face[axis] = np.sign(local[axis])
    return face
