"""A hand wheel on a pipe, its axis level, to be turned by a whole turn anticlockwise.

Frame of the valve: origin in the wheel's centre, x into the wall, y to the robot's left, z up. Angles of spokes and of
``valveWheel`` count anticlockwise as the robot sees the wheel, from up.

Published (DARPA Robotics Challenge, task pages "Valve" of the Trials 2013 and rules of the Finals 2015): a wheel of 10
to 40 cm that opens anticlockwise; one whole turn; centre 40 inches over the floor (32 to 48); moves at 5 lbf (22 N) at
its edge, which is 4.0 N m at 0.18 m. Assumed: radius 0.18 m within that range, four spokes, tube and masses.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from teleop_sim.world import contact
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.light import NOON, Light
from teleop_sim.world.plant import Plant

Triple = tuple[float, float, float]

RADIUS_M, RIM_M, SPOKE_M, HUB_M = 0.18, 0.013, 0.010, 0.025
"""Of the wheel to the middle of its rim, and of the tubes it is made of (assumed)."""
SPOKES, RIM_PIECES = 4, 16
MASS_KG = 3.0
HEIGHT_M = 40 * 0.0254

_STUCK_SOLIMP = [0.9999, 0.9999, 0.001, 0.5, 2.0]
"""Near-rigid: a loaded wheel creeps at MuJoCo's default (``teleop_sim.world.dish``)."""
_RED, _GREY = [0.7, 0.1, 0.1, 1.0], [0.5, 0.5, 0.52, 1.0]


@dataclass(frozen=True)
class Valve(BareFloor):
    """A level floor with a valve.

    Attributes:
        place: of the valve's frame [m].
        yaw_rad: of the valve about the vertical.
        friction_nm: of the wheel, Coulomb's: the same at rest and in motion.
        start_rad: angle of a spoke at the start.
        grip: sliding friction of the wheel.

    """

    place: Triple = (0.75, 0.30, HEIGHT_M)
    yaw_rad: float = 0.0
    friction_nm: float = 3.0
    start_rad: float = 0.3
    grip: float = 0.7
    light: Light = NOON

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add the floor, the pipe and the wheel."""
        super().add_to(spec)
        half = self.yaw_rad / 2
        frame = spec.worldbody.add_body(
            name="valveFrame", pos=list(self.place), quat=[math.cos(half), 0.0, 0.0, math.sin(half)]
        )
        solid = {"friction": contact.rough(self.grip), "condim": 4, "solref": contact.GRIP_SOLREF, **contact.WORLD}
        pipe = {"type": mujoco.mjtGeom.mjGEOM_CYLINDER, "rgba": _GREY, **solid}
        frame.add_geom(name="valvePipe", fromto=[0.12, 0, 0, 0.4, 0, 0], size=[0.04, 0, 0], **pipe)
        wheel = frame.add_body(name="valveWheel")
        joint = wheel.add_joint(name="valveWheel", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[-1.0, 0.0, 0.0])
        joint.frictionloss, joint.damping, joint.armature = self.friction_nm, np.array([0.05, 0.0, 0.0]), 0.01
        joint.solimp_friction, joint.solref_friction = _STUCK_SOLIMP, [0.01, 1.0]
        wheel.add_geom(
            name="valveHub", fromto=[-0.015, 0, 0, 0.11, 0, 0], size=[HUB_M, 0, 0], mass=0.1 * MASS_KG, **pipe
        )
        tube = {"type": mujoco.mjtGeom.mjGEOM_CAPSULE, "rgba": _RED, **solid}
        for k in range(RIM_PIECES):
            a, b = (on_wheel(math.tau * (k + i) / RIM_PIECES, RADIUS_M) for i in (0, 1))
            wheel.add_geom(
                name=f"valveRim{k}", fromto=[*a, *b], size=[RIM_M, 0, 0], mass=0.6 * MASS_KG / RIM_PIECES, **tube
            )
        for k in range(SPOKES):
            end = on_wheel(self.start_rad + math.tau * k / SPOKES, RADIUS_M)
            wheel.add_geom(
                name=f"valveSpoke{k}", fromto=[0, 0, 0, *end], size=[SPOKE_M, 0, 0], mass=0.3 * MASS_KG / SPOKES, **tube
            )


def on_wheel(angle_rad: float, radius_m: float) -> Triple:
    """A point of the wheel's plane in the valve's frame [m]."""
    return 0.0, radius_m * math.sin(angle_rad), radius_m * math.cos(angle_rad)


def turned_rad(plant: Plant) -> float:
    """How far the wheel has been turned: the truth, which no robot sees."""
    return plant.angle("valveWheel")
