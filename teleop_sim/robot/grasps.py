"""How each robot takes a thing by its handle, carries it and stands to it: grasps and stands as data per robot.

In the way of the published object templates (team-vigir/vigir_templates @8fc2e9b: a list of grasps and of stand poses
per object and hand). They know no box with a bar; the figures here were found by asking the inverse kinematics where a
hand reaches with all of its pose and joints to spare (docs/physics.md, "Pick, carry, place, insert").
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from teleop_sim.core.errors import UnknownName
from teleop_sim.robot.commands import Handle, PlanarPose, Side, Vector


@dataclass(frozen=True)
class HandStand:
    """How a robot uses one hand on a level bar in front of it, seen from the middle of its feet.

    Attributes:
        inwards_rad: heading of the hand's approach, turned from the robot's heading towards the other hand.
        pitch_rad: of the approach below the horizon; level, because flat jaws take up the slope of a flat bar.
        ahead_m, aside_m: where the handle is, ahead and outwards on the hand's side.
        low_m, high_m: heights of handles over the ground that it reaches from there.
        carry: ahead, outwards and up from the ground: where it carries a handle.
        strength_kg: the most that it picked, carried a step back and turned with (measured, one trial each).
        squeeze: jaw reference that closes the hand on a thing, 1 being the jaws' stop: 2 presses with all of the
            actuators' 60 N. THORMANG3's jaws weigh 50 g: at 60 N they sink through what they hold (measured).
    """

    inwards_rad: float
    pitch_rad: float
    ahead_m: float
    aside_m: float
    low_m: float
    high_m: float
    carry: Vector
    strength_kg: float
    squeeze: float = 2.0


HAND_STANDS: Mapping[str, HandStand] = MappingProxyType(
    {
        "valkyrie": HandStand(0.7, 0.0, 0.52, 0.25, 0.85, 1.15, (0.42, 0.25, 1.1), 5.0),
        "atlas": HandStand(0.7, 0.0, 0.55, 0.25, 0.75, 1.1, (0.5, 0.25, 1.0), 9.0),
        "thormang3": HandStand(0.6, 0.0, 0.44, 0.2, 0.65, 0.85, (0.36, 0.2, 0.86), 2.0, 1.2),
    }
)


DEEPER_M = 0.012
"""How far the middle of a cage goes past that of a bar: its own bars reach 2 cm beyond its middle (assumed)."""


def hand_stand(robot: str) -> HandStand:
    """The figures of a robot.

    Raises:
        UnknownName: nobody has found any for it.

    """
    if robot not in HAND_STANDS:
        raise UnknownName("stand at a handle", robot, tuple(HAND_STANDS))
    return HAND_STANDS[robot]


def bar_handle(
    robot: str, centre: Vector, bar_yaw_rad: float, heading_rad: float, mass_kg: float, to_centre: Vector
) -> Handle:
    """A level bar as that robot takes it: from the side of the bar on which it stands, headed ``heading_rad``."""
    figures = hand_stand(robot)
    across = bar_yaw_rad + math.pi / 2
    if math.cos(across - heading_rad) < 0:
        across += math.pi
    c, s = math.cos(figures.pitch_rad), math.sin(figures.pitch_rad)
    approach = (c * math.cos(across), c * math.sin(across), -s)
    x, y, z = (at + DEEPER_M * along for at, along in zip(centre, approach, strict=True))
    down = (to_centre[0] + centre[0] - x, to_centre[1] + centre[1] - y, to_centre[2] + centre[2] - z)
    return Handle((x, y, z), approach, (math.cos(bar_yaw_rad), math.sin(bar_yaw_rad), 0.0), mass_kg, down)


def stand_at(robot: str, side: Side, centre: Vector, bar_yaw_rad: float, facing_rad: float) -> PlanarPose:
    """Where to stand for a level bar: (x [m], y [m], yaw [rad]); of the bar's two sides the one faced by
    ``facing_rad``.
    """
    figures = hand_stand(robot)
    across = bar_yaw_rad + math.pi / 2
    if math.cos(across - facing_rad) < 0:
        across += math.pi
    # A right hand approaches to its left.
    yaw = across - figures.inwards_rad * (1.0 if side == "right" else -1.0)
    return stand_before(robot, side, centre, yaw)


def stand_before(robot: str, side: Side, centre: Vector, yaw_rad: float) -> PlanarPose:
    """Where to stand, headed ``yaw_rad``, with a point where that hand works."""
    figures = hand_stand(robot)
    left_m = figures.aside_m if side == "left" else -figures.aside_m
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    x = centre[0] - c * figures.ahead_m + s * left_m
    y = centre[1] - s * figures.ahead_m - c * left_m
    return (x, y, math.remainder(yaw_rad, math.tau))
