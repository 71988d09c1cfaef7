"""How much may be otherwise than believed: what a scenario states, of which a run meets one draw.

A range is its lowest and highest value; equal ones fix it. By default nothing is disturbed. What a kind of disturbance
does where only some of its figures are given is mild (assumed): a lip of a centimetre, a nudge of 20 N for 0.2 s, a
kilogram.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from teleop_sim.world.description import Vector

Range = tuple[float, float]
"""Lowest and highest."""
Whole = tuple[int, int]
"""Fewest and most."""
Sized = tuple[float, ...]
"""Two numbers: shortest and longest of a vector whose direction is drawn, each alike. Three: the vector itself."""

NONE: Range = (0.0, 0.0)
SAME: Range = (1.0, 1.0)


@dataclass(frozen=True, slots=True)
class PlateRanges:
    """Plates on the floor (bumps, slippery patches); each is drawn for itself.

    Attributes:
        count: how many lie on the way; None: one, or as many as ``at_m`` has places.
        at_m: places (x, y) of their middles; empty: they lie on the way.
        along: where on the way, as shares of its length.
        yaw_rad: how far the plate's length is turned from the way's direction; at given places, from the x axis.
        length_m: along that direction; width_m: across it. The defaults are a foot long and wider than a robot.
        height_m: of the upper face over the floor; none of height zero lies there.
        friction: of its upper face; None: as the floor's.
    """

    count: Whole | None = None
    at_m: tuple[tuple[float, float], ...] = ()
    along: Range = (0.15, 0.85)
    yaw_rad: Range = (-0.3, 0.3)
    length_m: Range = (0.3, 0.3)
    width_m: Range = (1.2, 1.2)
    height_m: Range = (0.01, 0.01)
    friction: Range | None = None


@dataclass(frozen=True, slots=True)
class PushRanges:
    """Pushes at the trunk's centre of mass, level; each is drawn for itself.

    Attributes:
        force_n, duration_s: how hard and how long.
        every_s: time of motion before the first, and between the starts of two.
        direction_rad: where it pushes to, anticlockwise from the world's x axis.
        count: how many; None: for 300 s of motion.
    """

    force_n: Range = (20.0, 20.0)
    duration_s: Range = (0.2, 0.2)
    every_s: Range = (2.5, 4.0)
    direction_rad: Range = (-math.pi, math.pi)
    count: Whole | None = None


@dataclass(frozen=True, slots=True)
class PayloadRanges:
    """A ball of 0.1 m radius fixed to the robot.

    Attributes:
        link: a link's name, or ``left_hand`` or ``right_hand``: where that hand holds things.
        mass_kg: of the ball. at_m: its centre in the link's frame; None: its origin, or where the hand holds things.
        known: whether the controller is told.
    """

    link: str
    mass_kg: Range = (1.0, 1.0)
    at_m: Vector | None = None
    known: bool = False


@dataclass(frozen=True, slots=True)
class SenseRanges:
    """Errors of the senses; see ``sense_errors.SenseErrors``."""

    camera_turn_rad: Sized = NONE
    camera_shift_m: Sized = NONE
    lidar_turn_rad: Sized = NONE
    lidar_shift_m: Sized = NONE
    spindle_rad: Range = NONE
    focal: Range = SAME
    baseline: Range = SAME
    pixel_noise: Range = SAME
    range_noise: Range = SAME
    exposure: Range = SAME


@dataclass(frozen=True)
class DisturbanceRanges:
    """Of everything; see ``disturbances.Disturbances``.

    Attributes:
        floor_friction: None leaves the scenery's own.
        bumps, patches, pushes, payload: None: there are none. A patch has a height that a foot does not feel.
        mass_factor, joint_friction, delay_s: as there.
        com_error_m: how far off the trunk's centre of mass is.
        strength: by pattern of joint names (``*`` and ``?`` stand for any letters and for one); of several that fit a
            joint the last counts. One draw a pattern.
        senses: as there.
    """

    floor_friction: Range | None = None
    bumps: PlateRanges | None = None
    patches: PlateRanges | None = None
    pushes: PushRanges | None = None
    payload: PayloadRanges | None = None
    mass_factor: Range = SAME
    com_error_m: Sized = NONE
    joint_friction: Range = NONE
    strength: Mapping[str, Range] = field(default_factory=dict)
    delay_s: Range = NONE
    senses: SenseRanges = SenseRanges()
