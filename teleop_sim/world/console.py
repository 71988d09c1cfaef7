"""Shape of the console, its two crank wheels and the squares: what everybody knows beforehand, as pure numbers.

Console frame: origin on the soil below the middle of the two wheels, x away from the robot that faces it, y to that
robot's left, z up. Wheel frame: origin in the wheel's centre, z out of its face (tilted towards the robot), x in the
face, away from the robot and up, y to the left. A handle angle counts anticlockwise about z from x.

The yaw wheel (red) is on the robot's left, the pitch wheel (blue) on its right. Turning a wheel *clockwise* seen from
above increases its joint angle and the dish's angle.

Source, unless a line says otherwise: osrf/srcsim 0.8.0 (commit 2225f67), models/satellite_dish, worlds/final_*.world;
"measured" means read off the mesh's vertices.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

Triple = tuple[float, float, float]

WALKWAY_HEIGHT_M = 0.1
"""The walkway's surface over the soil: tile thickness 0.152151 less its sinking 0.052151."""

SQUARE_M = 3.048
"""Side of the start square and of the finish square."""

TILT_RAD = 0.52
WHEEL_HEIGHT_M = 0.91
"""Wheel centre over the soil; 0.81 over the walkway."""
WHEEL_SEPARATION_M = 0.4
WHEEL_RADIUS_M = 0.14
WHEEL_HALF_THICKNESS_M = 0.015
"""Assumed: with it the disc stays inside the measured bounds of -0.033 to 0.104 along the axis."""
WHEEL_MASS_KG = 2.0
WHEEL_INERTIA: Triple = (0.0123, 0.01295, 0.025)
KNOB_ORBIT_M = 0.123
KNOB_RADIUS_M = 0.029
KNOB_HEIGHT_M = 0.082
"""Knob's centre over the wheel's plane."""
STEM_RADIUS_M = 0.0125
STEM_LENGTH_M = 0.06

PIVOT_AHEAD_M = 1.725
"""From the middle of the wheels to the dish's mast, level."""
PIVOT_HEIGHT_M = 1.595
DISH_PER_WHEEL = 0.1
"""Dish angle per wheel angle; the robot is not told (wiki FAQ)."""

RED = (0.75, 0.05, 0.05)
BLUE = (0.06, 0.10, 0.75)
GREY = (0.60, 0.60, 0.60)
CONSOLE_GREY = (0.42, 0.43, 0.45)
"""Colours are assumed; the model's texture shows a red wheel on the left and a blue one on the right."""


@dataclass(frozen=True, slots=True)
class Block:
    """A box in the console frame: centre and half sizes [m], leaned towards the robot by ``lean_rad``."""

    centre: Triple
    half: Triple
    lean_rad: float = 0.0


BLOCKS = (
    Block((0.0925, 0.0, 0.392), (0.2315, 0.376, 0.392)),
    Block((0.2395, 0.0, 0.476), (0.0845, 0.376, 0.476)),
    Block((0.0780, 0.0, 0.415), (0.0780, 0.376, 0.415)),
    Block((0.0279, 0.0, 0.8338), (0.1695, 0.376, 0.040), TILT_RAD),
)
"""Lower body, back, filling under the slope, sloping face 4 cm under the wheel centres.

Fitted by eye to the measured bounds: x -0.139 to 0.324, y -0.376 to 0.376, z 0.004 to 0.955.
"""


def wheel_centre(left: bool) -> Triple:
    """Centre of a wheel in the console frame [m]."""
    return (0.0, 0.5 * WHEEL_SEPARATION_M * (1.0 if left else -1.0), WHEEL_HEIGHT_M)


def wheel_axes() -> tuple[Triple, Triple, Triple]:
    """The wheel frame's unit x, y and z in the console frame."""
    c, s = math.cos(TILT_RAD), math.sin(TILT_RAD)
    return (c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c)


def knob_centre(left: bool, angle_rad: float) -> Triple:
    """Centre of a knob in the console frame [m] when its handle angle is ``angle_rad``."""
    centre, (x, y, z) = wheel_centre(left), wheel_axes()
    a, b = KNOB_ORBIT_M * math.cos(angle_rad), KNOB_ORBIT_M * math.sin(angle_rad)
    u, v, w = (centre[i] + a * x[i] + b * y[i] + KNOB_HEIGHT_M * z[i] for i in range(3))
    return (u, v, w)
