"""What a program claims to have seen, as marks in a picture that the operator can compare it with."""

from __future__ import annotations

import math
from typing import Final

from teleop_sim.robot.commands import CircularAffordance, Look, PlanarPose, Vector
from teleop_sim.robot.programs.doing import Doing
from teleop_sim.robot.programs.places import wrap
from teleop_sim.robot.programs.steps import Claim, Mark
from teleop_sim.robot.sightings import ConsoleFix, ConsoleGlimpse
from teleop_sim.world.console import KNOB_RADIUS_M, WHEEL_RADIUS_M

EYE_OVER_WHEEL_M: Final = 0.85
"""Height of the eyes over the wheels (Valkyrie standing: camera at 1.66 m, wheels at 0.81 m)."""

EYE_AHEAD_M: Final = 0.15
"""The camera of a head that looks down is so far ahead of the feet (assumed; Valkyrie at the console: 0.1 to 0.2 m)."""

LOWEST_RAD: Final = 1.15
"""Farthest down that a head is told to look: Valkyrie's neck ends at 1.16 rad."""


def claim_of_glimpse(event: str, glimpse: ConsoleGlimpse, aim: Look, back: Look) -> Claim:
    """The two wheels, seen from afar."""
    marks = (
        Mark("yaw_wheel", glimpse.yaw_wheel, WHEEL_RADIUS_M),
        Mark("pitch_wheel", glimpse.pitch_wheel, WHEEL_RADIUS_M),
    )
    return Claim(event, marks, aim, back)


def claim_of_fix(event: str, fix: ConsoleFix, doing: Doing, otherwise: bool = True) -> Claim:
    """Both handles, in a picture for which the head looks at the console."""
    marks = (
        Mark("yaw_handle", knob(fix.yaw_handle), KNOB_RADIUS_M),
        Mark("pitch_handle", knob(fix.pitch_handle), KNOB_RADIUS_M),
    )
    back = Look(0.0, 0.0, doing.pacing.head_move_s)
    return Claim(event, marks, look_at(doing.here, fix.pose, doing.pacing.head_move_s), back, otherwise)


def knob(handle: CircularAffordance) -> Vector:
    """The middle of a handle's knob."""
    (ax, ay, az), (zx, zy, zz) = handle.axis, handle.zero
    left = (ay * zz - az * zy, az * zx - ax * zz, ax * zy - ay * zx)
    along, across = handle.radius_m * math.cos(handle.angle_rad), handle.radius_m * math.sin(handle.angle_rad)
    x, y, z = (
        handle.centre[i] + handle.height_m * handle.axis[i] + along * handle.zero[i] + across * left[i]
        for i in range(3)
    )
    return (x, y, z)


def look_at(here: PlanarPose, there: PlanarPose, duration_s: float) -> Look:
    """Head angles that put a console at ``there`` into the middle of the picture."""
    ahead, aside = there[0] - here[0], there[1] - here[1]
    yaw = wrap(math.atan2(aside, ahead) - here[2])
    away_m = max(math.hypot(ahead, aside) - EYE_AHEAD_M, 0.05)
    return Look(min(math.atan2(EYE_OVER_WHEEL_M, away_m), LOWEST_RAD), yaw, duration_s)
