"""What a robot takes a crank to be surrounded by: template shapes, placed by the affordance that it believes in.

Shapes and sizes are the console's published ones (``teleop_sim.world.console``, known beforehand as a template is);
where they stand is what the robot has seen. The left hand turns the console's left wheel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import coal
import numpy as np
import pinocchio as pin

from teleop_sim.robot.commands import CircularAffordance, Side
from teleop_sim.world import console

HANDLE = "handle"
"""Name of the one thing that the bars of a hand may touch."""


@dataclass(frozen=True)
class Thing:
    """A solid at a place in the odometry frame: its name, placement (SE3) and coal shape."""

    name: str
    placement: pin.SE3
    shape: coal.ShapeBase


def crank_things(affordance: CircularAffordance, side: Side) -> tuple[Thing, ...]:
    """The wheel with its handle, the other wheel, the console's body.

    The other wheel's handle may be anywhere: it stands for a drum as high and wide as that.
    """
    zero, axis = np.array(affordance.zero), np.array(affordance.axis)
    wheel = pin.SE3(np.column_stack([zero, np.cross(axis, zero), axis]), np.array(affordance.centre))
    base = _console(affordance, side)
    other = wheel.copy()
    aside = np.array(console.wheel_centre(side != "left")) - np.array(console.wheel_centre(side == "left"))
    other.translation = wheel.translation + base.rotation @ aside
    top_m = affordance.height_m + console.KNOB_RADIUS_M
    low_m = -console.WHEEL_HALF_THICKNESS_M
    reach_m = affordance.radius_m + console.KNOB_RADIUS_M
    drum = other * pin.SE3(np.eye(3), np.array([0.0, 0.0, (top_m + low_m) / 2]))
    return (
        Thing("wheel", wheel, coal.Cylinder(console.WHEEL_RADIUS_M, 2 * console.WHEEL_HALF_THICKNESS_M)),
        Thing(HANDLE, wheel * _handle(affordance), coal.Capsule(console.KNOB_RADIUS_M, affordance.height_m)),
        Thing("other wheel", drum, coal.Cylinder(reach_m, top_m - low_m)),
        *(Thing(f"console {n}", base * _placed(block), _box(block)) for n, block in enumerate(console.BLOCKS)),
    )


def _console(affordance: CircularAffordance, side: Side) -> pin.SE3:
    """The console's frame, on the soil between its wheels: level, headed as the wheel's zero direction."""
    yaw = math.atan2(affordance.zero[1], affordance.zero[0])
    turn = np.array([[math.cos(yaw), -math.sin(yaw), 0.0], [math.sin(yaw), math.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    wheel = np.array(console.wheel_centre(side == "left"))
    return pin.SE3(turn, np.array(affordance.centre) - turn @ wheel)


def _handle(affordance: CircularAffordance) -> pin.SE3:
    """A capsule as thick as the knob down to the wheel, in the wheel's frame."""
    a = affordance.angle_rad
    spoke_m, half_m = affordance.radius_m, affordance.height_m / 2
    return pin.SE3(np.eye(3), np.array([spoke_m * math.cos(a), spoke_m * math.sin(a), half_m]))


def _placed(block: console.Block) -> pin.SE3:
    # Leaning towards the robot moves the z axis towards -x.
    c, s = math.cos(block.lean_rad), math.sin(block.lean_rad)
    return pin.SE3(np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]), np.array(block.centre))


def _box(block: console.Block) -> coal.Box:
    return coal.Box(*(2 * half for half in block.half))
