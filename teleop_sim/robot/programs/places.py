"""Where to stand: plane geometry of the console task, in the odometry frame."""

from __future__ import annotations

import math
from typing import Final

from teleop_sim.robot.commands import PlanarPose, Side, Step, Vector
from teleop_sim.robot.sightings import ConsoleFix, ConsoleGlimpse
from teleop_sim.robot.templates import CrankStand

VIEW_M: Final = 1.1
"""Distance from the wheels at which they are looked at closely (assumed; detection was measured from 1.2 m on)."""

ALIGN_M: Final = (0.04, 0.49)
"""Offsets that a side-step corrects. WPI: 0.1 to 0.49 m; these robots were measured 2.5 cm either way, hence less."""

ALIGN_RAD: Final = 0.1
"""Heading error that is corrected with it (assumed)."""


def middle(glimpse: ConsoleGlimpse) -> Vector:
    """Half way between the two wheels."""
    a, b = glimpse.yaw_wheel, glimpse.pitch_wheel
    return ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2)


def facing_rad(glimpse: ConsoleGlimpse) -> float:
    """Heading of a robot that faces the console: the yaw wheel is on its left, the pitch wheel on its right."""
    to_right = (glimpse.pitch_wheel[0] - glimpse.yaw_wheel[0], glimpse.pitch_wheel[1] - glimpse.yaw_wheel[1])
    return math.atan2(to_right[0], -to_right[1])


def before(x: float, y: float, yaw_rad: float, distance_m: float) -> PlanarPose:
    """The pose that faces ``(x, y)`` with heading ``yaw_rad`` from ``distance_m`` away."""
    return (x - distance_m * math.cos(yaw_rad), y - distance_m * math.sin(yaw_rad), yaw_rad)


def stance(fix: ConsoleFix, side: Side, stand: CrankStand) -> PlanarPose:
    """Where to stand to turn a wheel: the pitch wheel with the right hand, the yaw wheel with the left."""
    centre = (fix.pitch_handle if side == "right" else fix.yaw_handle).centre
    return stand.pose((centre[0], centre[1]), fix.pose[2], side)


def move(here: PlanarPose, goal: PlanarPose) -> Step:
    """The step that leads from one pose to another, in the robot's own frame."""
    dx, dy, c, s = goal[0] - here[0], goal[1] - here[1], math.cos(here[2]), math.sin(here[2])
    return Step(forward_m=c * dx + s * dy, left_m=c * dy - s * dx, turn_rad=wrap(goal[2] - here[2]))


def after(here: PlanarPose, step: Step) -> PlanarPose:
    """Where a step leads."""
    c, s = math.cos(here[2]), math.sin(here[2])
    x, y = here[0] + c * step.forward_m - s * step.left_m, here[1] + s * step.forward_m + c * step.left_m
    return (x, y, wrap(here[2] + step.turn_rad))


def worth(step: Step) -> bool:
    """Is the offset large enough to be corrected?"""
    return math.hypot(step.forward_m, step.left_m) > ALIGN_M[0] or abs(step.turn_rad) > ALIGN_RAD


def near(step: Step) -> bool:
    """Can a few steps without turning correct it?"""
    return math.hypot(step.forward_m, step.left_m) <= ALIGN_M[1]


def wrap(angle_rad: float) -> float:
    """The same angle from -pi to pi."""
    return math.remainder(angle_rad, 2.0 * math.pi)
