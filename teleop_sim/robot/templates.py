"""Where a robot stands to use a thing: object templates' stand poses, as data per robot.

The published templates (team-vigir/vigir_templates @8fc2e9b, ``robot_poses/*_stand_poses.xml``) hold one list of stand
poses a robot and object, in the object's frame; so does this. They know no console with cranks: its stands were found
by asking the inverse kinematics where a hand reaches the whole circle (docs/physics.md, "Manipulation").
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from teleop_sim.core.errors import UnknownName
from teleop_sim.robot.commands import Side
from teleop_sim.robot.hands import base_name


@dataclass(frozen=True)
class CrankStand:
    """Where and how to stand at a crank.

    Attributes:
        ahead_m, aside_m: from the middle of the feet to the wheel's centre, ahead and outwards on the side of the hand
            that turns it.
        rest: joints that a search draws elsewhere than to the walking posture [rad].

    """

    ahead_m: float
    aside_m: float
    rest: Mapping[str, float] = field(default_factory=dict)

    def pose(self, centre: tuple[float, float], yaw_rad: float, side: Side) -> tuple[float, float, float]:
        """Where to stand, (x [m], y [m], yaw [rad]), for a wheel whose face is turned to a robot of that heading."""
        c, s = math.cos(yaw_rad), math.sin(yaw_rad)
        left_m = self.aside_m if side == "left" else -self.aside_m
        x = centre[0] - c * self.ahead_m + s * left_m
        y = centre[1] - s * self.ahead_m - c * left_m
        return (x, y, yaw_rad)


# Upper arms down, forearms ahead and level: half way round the circle.
ATLAS_ARMS = {
    "l_arm_shz": 0.0,
    "r_arm_shz": 0.0,
    "l_arm_shx": -1.25,
    "r_arm_shx": 1.25,
    "l_arm_ely": 1.5,
    "r_arm_ely": 1.5,
    "l_arm_elx": 1.0,
    "r_arm_elx": -1.0,
}

# Elbows out: with upper arms down the wrist is bent, and a wheel of 3 N m takes all of its 5.1 N m; so 84 %.
THORMANG3_ARMS = {
    "l_arm_sh_p1": 0.0,
    "r_arm_sh_p1": 0.0,
    "l_arm_sh_r": 0.2,
    "r_arm_sh_r": -0.2,
    "l_arm_el_y": 0.8,
    "r_arm_el_y": -0.8,
}

CRANK_STANDS: Mapping[str, CrankStand] = MappingProxyType(
    {
        # Elbows out: with arms as for walking the search slips into postures with the upper arm in the torso.
        "valkyrie": CrankStand(0.57, 0.27, {"rightShoulderRoll": 0.7, "leftShoulderRoll": -0.7}),
        "atlas": CrankStand(0.75, 0.25, ATLAS_ARMS),
        "thormang3": CrankStand(0.51, 0.28, THORMANG3_ARMS),
    }
)
"""By robot: the middle of where the whole circle is reached, with 2.5 cm to spare in any direction (measured)."""


def crank_stand(robot: str) -> CrankStand:
    """The stand of a robot, whichever hands it has (``teleop_sim.robot.hands``).

    Raises:
        UnknownName: nobody has found one for it.

    """
    name = base_name(robot)
    if name not in CRANK_STANDS:
        raise UnknownName("stand at a crank", name, tuple(CRANK_STANDS))
    return CRANK_STANDS[name]


def rest_of(robot: str) -> Mapping[str, float]:
    """Joints of a robot that a hand's search draws elsewhere than to the walking posture [rad], if any."""
    name = base_name(robot)
    return CRANK_STANDS[name].rest if name in CRANK_STANDS else {}
