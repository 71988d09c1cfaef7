"""Small steps of building a MuJoCo model that robot and hands share."""

from __future__ import annotations

from typing import Any, Final

import mujoco
import numpy as np

from teleop_sim.world import contact
from teleop_sim.world.description import Link

SOLID: Final[dict[str, Any]] = {"condim": 3, "friction": contact.rough(contact.OWN_FRICTION), "mass": 0.0}
"""Settings of a robot's own geom; its mass is its link's."""
GREY: Final = [0.72, 0.76, 0.8, 1.0]
DARK: Final = [0.2, 0.2, 0.22, 1.0]


def weigh(body: mujoco.MjsBody, link: Link) -> None:
    """Give a body a link's mass, centre and inertia."""
    body.explicitinertial = True
    body.mass = link.mass_kg
    body.ipos = list(link.com_m)
    xx, xy, xz, yy, yz, zz = link.inertia
    body.fullinertia = [xx, yy, zz, xy, xz, yz]


def quat_of(rotation: np.ndarray) -> np.ndarray:
    """Quaternion w, x, y, z (4,) of a rotation (3, 3)."""
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(rotation).ravel())
    return quat


def position_actuator(spec: mujoco.MjSpec, joint: str, kp: float, kv: float, limit: float) -> None:
    """A joint's servo, of the joint's name."""
    actuator = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    actuator.set_to_position(kp=kp, kv=kv)
    actuator.forcelimited = True
    actuator.forcerange = [-limit, limit]


def touch_sensor(spec: mujoco.MjSpec, site: str) -> None:
    """A touch sensor, of its site's name."""
    spec.add_sensor(name=site, type=mujoco.mjtSensor.mjSENS_TOUCH, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=site)
