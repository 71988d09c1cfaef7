"""Where a hand is, by the robot's own joints."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Side, Vector
from teleop_sim.robot.kinematics import kinematics_of


def tool_pose(body: Body, side: Side) -> tuple[Vector, Vector]:
    """Position [m] and rotation vector [rad] of a hand's tool frame in the odometry frame.

    From the measured joints and pelvis through the planning model; changes nothing. Odometry is assumed perfect.
    """
    kinematics = kinematics_of(body.spec.model.description.name)
    rotation, position = body.base()
    q = kinematics.assemble(rotation, position, kinematics.positions(body.joint_names), body.q())
    turned, place = kinematics.tool_pose(q, side)
    return _triple(place), _triple(pin.log3(turned))


def _triple(values: np.ndarray) -> Vector:
    x, y, z = (float(v) for v in values)
    return x, y, z
