"""Where a robot stands to use a thing: object templates' stand poses, as data per robot.

The published templates (team-vigir/vigir_templates @8fc2e9b, ``robot_poses/*_stand_poses.xml``) hold one list of stand
poses a robot and object, in the object's frame; so does this. They know no console with cranks: its stands were found by
asking the inverse kinematics where a hand reaches the whole circle (docs/physics.md, "Manipulation").
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from teleop_sim.core.errors import UnknownName
from teleop_sim.robot.commands import Side


@dataclass(frozen=True)
class CrankStand:
    """From the middle of the feet to the wheel's centre: ahead, and outwards on the side of the hand that turns it."""

    ahead_m: float
    aside_m: float

    def pose(self, centre: tuple[float, float], yaw_rad: float, side: Side) -> tuple[float, float, float]:
        """Where to stand, (x [m], y [m], yaw [rad]), for a wheel whose face is turned to a robot of that heading."""
        c, s = math.cos(yaw_rad), math.sin(yaw_rad)
        left_m = self.aside_m if side == "left" else -self.aside_m
        x = centre[0] - c * self.ahead_m + s * left_m
        y = centre[1] - s * self.ahead_m - c * left_m
        return (x, y, yaw_rad)


CRANK_STANDS: Mapping[str, CrankStand] = MappingProxyType(
    {
        "valkyrie": CrankStand(0.585, 0.27),
        "atlas": CrankStand(0.75, 0.25),
    }
)
"""By robot: the middle of where the whole circle is reached, at least 3 cm in any direction (measured). THORMANG3 has
none: its wrists carry 5.1 N m, a crank asks 20 N at 0.12 m beyond the wrist and its arms do not reach over a console of
0.9 m (assumed: not tried)."""


def crank_stand(robot: str) -> CrankStand:
    """The stand of a robot.

    Raises:
        UnknownName: nobody has found one for it.

    """
    if robot not in CRANK_STANDS:
        raise UnknownName("stand at a crank", robot, tuple(CRANK_STANDS))
    return CRANK_STANDS[robot]
