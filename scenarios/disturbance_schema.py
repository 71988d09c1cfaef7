"""The tables of a scenario that say what goes otherwise than the robot believes. Meanings and figures: docs/world.md.

What is left out is not disturbed. Keys are the fields of ``teleop_sim.world.disturbance_ranges``, which has the
defaults; ``teleop_sim.scenarios.disturbances`` hands them on.
"""

from __future__ import annotations

import math
import re
from typing import Annotated

from pydantic import AfterValidator, Field, Strict

from teleop_sim.scenarios.parts import ASSUMED, Part, refused, source_of
from teleop_sim.scenarios.ranges import RANGE, SIZED
from teleop_sim.world.disturbance_ranges import PayloadRanges, PlateRanges, PushRanges

_Share = Annotated[float, Field(ge=0.0, le=1.0)]
_Left = Annotated[float, Field(gt=0.0, le=1.0)]
_Friction = Annotated[float, Field(gt=0.0, le=2.0)]
_Factor = Annotated[float, Field(ge=0.5, le=2.0)]
_Noise = Annotated[float, Field(ge=0.0, le=100.0)]
_Light = Annotated[float, Field(gt=0.0, le=20.0)]
_Angle = Annotated[float, Field(ge=-2 * math.pi, le=2 * math.pi)]
_SmallAngle = Annotated[float, Field(ge=-0.5, le=0.5)]
_SmallLength = Annotated[float, Field(ge=-0.5, le=0.5)]
_Side = Annotated[float, Field(gt=0.0, le=10.0)]
_Height = Annotated[float, Field(ge=0.0, le=0.15)]
_Force = Annotated[float, Field(ge=0.0, le=2000.0)]
_Lasting = Annotated[float, Field(ge=0.0, le=10.0)]
_Pause = Annotated[float, Field(ge=0.1, le=300.0)]
_Mass = Annotated[float, Field(ge=0.0, le=50.0)]
_Delay = Annotated[float, Field(ge=0.0, le=0.5)]
_Few = Annotated[int, Field(ge=0, le=50)]
_Many = Annotated[int, Field(ge=0, le=3000)]
_Place = Annotated[float, Field(ge=-20.0, le=20.0)]

Shares = Annotated[tuple[_Share, _Share], *RANGE]
Left = Annotated[tuple[_Left, _Left], *RANGE]
Frictions = Annotated[tuple[_Friction, _Friction], *RANGE]
Factors = Annotated[tuple[_Factor, _Factor], *RANGE]
Noises = Annotated[tuple[_Noise, _Noise], *RANGE]
Lights = Annotated[tuple[_Light, _Light], *RANGE]
Angles = Annotated[tuple[_Angle, _Angle], *RANGE]
SmallAngles = Annotated[tuple[_SmallAngle, _SmallAngle], *RANGE]
Sides = Annotated[tuple[_Side, _Side], *RANGE]
Heights = Annotated[tuple[_Height, _Height], *RANGE]
Forces = Annotated[tuple[_Force, _Force], *RANGE]
Lastings = Annotated[tuple[_Lasting, _Lasting], *RANGE]
Pauses = Annotated[tuple[_Pause, _Pause], *RANGE]
Masses = Annotated[tuple[_Mass, _Mass], *RANGE]
Delays = Annotated[tuple[_Delay, _Delay], *RANGE]
PlateCounts = Annotated[tuple[_Few, _Few], *RANGE]
PushCounts = Annotated[tuple[_Many, _Many], *RANGE]
Turn = Annotated[tuple[_SmallAngle, ...], *SIZED]
Shift = Annotated[tuple[_SmallLength, ...], *SIZED]
Place = Annotated[tuple[_Place, _Place], Strict(False)]
Offset = Annotated[tuple[_SmallLength, _SmallLength, _SmallLength], Strict(False)]

_PLATE, _PUSH, _BALL = PlateRanges(), PushRanges(), PayloadRanges("")
_PATTERN = re.compile(r"[\w*?-]+")


def _patterns(value: dict[str, tuple[float, float]] | None) -> dict[str, tuple[float, float]] | None:
    for pattern in value or ():
        if not _PATTERN.fullmatch(pattern):
            raise refused(f"{pattern!r} is no joint's name", 'Give a name, or a pattern such as "*Knee*".')
    return value or None


class _Plates(Part):
    """Things that lie on the floor."""

    count: PlateCounts | None = Field(default=None, description="How many lie on the way, 0 to 50.")
    count_source: str | None = Field(default_factory=source_of("count"))
    along: Shares = Field(
        default=_PLATE.along, description="Where on the way, as a share of its length, such as [0.15, 0.85]."
    )
    along_source: str = ASSUMED
    at_m: Annotated[tuple[Place, ...] | None, Strict(False)] = Field(
        default=None, description="Places of their middles in place of count and along: [[x, y], ...] in m."
    )
    at_source: str | None = Field(default_factory=source_of("at_m"))
    yaw_rad: Angles = Field(
        default=_PLATE.yaw_rad, description="How far turned from lying square across the way, in rad."
    )
    yaw_source: str = ASSUMED
    width_m: Sides = Field(default=_PLATE.width_m, description="Width across the way in m, above 0 to 10.")
    width_source: str = ASSUMED


class Bumps(_Plates):
    """Things to step onto."""

    length_m: Sides = Field(default=_PLATE.length_m, description="Length along the way in m, above 0 to 10.")
    length_source: str = ASSUMED
    height_m: Heights = Field(default=_PLATE.height_m, description="Height in m, 0 (none) to 0.15, such as 0.02.")
    height_source: str = ASSUMED
    friction: Frictions | None = Field(
        default=None, description="Friction coefficient on top, above 0 to 2; left out: the floor's."
    )
    friction_source: str | None = Field(default_factory=source_of("friction"))


class Patches(_Plates):
    """Places of other friction than the floor's: by default, two feet long and as slippery as a wet floor (assumed)."""

    length_m: Sides = Field(default=(0.6, 0.6), description="Length along the way in m, above 0 to 10.")
    length_source: str = ASSUMED
    friction: Frictions = Field(default=(0.3, 0.3), description="Friction coefficient, above 0 to 2, such as 0.2.")
    friction_source: str = ASSUMED


class Pushes(Part):
    """Level pushes at the robot's trunk while it moves."""

    force_n: Forces = Field(default=_PUSH.force_n, description="Force in N, 0 (none) to 2000, such as 20.0.")
    force_source: str = ASSUMED
    duration_s: Lastings = Field(default=_PUSH.duration_s, description="How long one lasts in s, 0 to 10.")
    duration_source: str = ASSUMED
    every_s: Pauses = Field(
        default=_PUSH.every_s, description="Seconds of motion before each, 0.1 to 300, such as [2.5, 4.0]."
    )
    every_source: str = ASSUMED
    direction_rad: Angles = Field(
        default=_PUSH.direction_rad, description="Where to, in rad anticlockwise from x; [-3.14, 3.14] is anywhere."
    )
    direction_source: str = ASSUMED
    count: PushCounts | None = Field(default=None, description="How many, 0 to 3000; left out: as long as it moves.")
    count_source: str | None = Field(default_factory=source_of("count"))


class Payload(Part):
    """Something fixed to the robot."""

    link: str = Field(description='A link of the robot, or "left_hand" or "right_hand".')
    mass_kg: Masses = Field(default=_BALL.mass_kg, description="Mass in kg, 0 (none) to 50.")
    mass_source: str = ASSUMED
    at_m: Offset | None = Field(default=None, description="[x, y, z] of its middle in the link's frame, in m.")
    at_source: str | None = Field(default_factory=source_of("at_m"))
    known: bool = Field(default=False, description="true or false: was the robot's controller told?")


class Senses(Part):
    """Errors of calibration, and noise."""

    camera_turn_rad: Turn | None = Field(
        default=None, description="Rotation of the camera by 0 to 0.5 rad about a drawn axis, or [x, y, z]."
    )
    camera_turn_source: str | None = Field(default_factory=source_of("camera_turn_rad"))
    camera_shift_m: Shift | None = Field(
        default=None, description="Shift of the camera by 0 to 0.5 m in a drawn direction, or [x, y, z]."
    )
    camera_shift_source: str | None = Field(default_factory=source_of("camera_shift_m"))
    lidar_turn_rad: Turn | None = Field(
        default=None, description="Rotation of the LIDAR by 0 to 0.5 rad about a drawn axis, or [x, y, z]."
    )
    lidar_turn_source: str | None = Field(default_factory=source_of("lidar_turn_rad"))
    lidar_shift_m: Shift | None = Field(
        default=None, description="Shift of the LIDAR by 0 to 0.5 m in a drawn direction, or [x, y, z]."
    )
    lidar_shift_source: str | None = Field(default_factory=source_of("lidar_shift_m"))
    spindle_rad: SmallAngles | None = Field(default=None, description="Zero of the LIDAR's spindle, -0.5 to 0.5 rad.")
    spindle_source: str | None = Field(default_factory=source_of("spindle_rad"))
    focal: Factors | None = Field(default=None, description="True over believed focal length, 0.5 to 2.")
    focal_source: str | None = Field(default_factory=source_of("focal"))
    baseline: Factors | None = Field(default=None, description="True over believed stereo baseline, 0.5 to 2.")
    baseline_source: str | None = Field(default_factory=source_of("baseline"))
    pixel_noise: Noises | None = Field(default=None, description="Factor on the noise of images, 0 to 100.")
    pixel_noise_source: str | None = Field(default_factory=source_of("pixel_noise"))
    range_noise: Noises | None = Field(default=None, description="Factor on the noise of ranges, 0 to 100.")
    range_noise_source: str | None = Field(default_factory=source_of("range_noise"))
    exposure: Lights | None = Field(default=None, description="Factor on the brightness of images, above 0 to 20.")
    exposure_source: str | None = Field(default_factory=source_of("exposure"))


class Disturbances(Part):
    """What goes otherwise than the robot believes: numbers, or [lowest, highest] between which the seed draws."""

    mass_factor: Factors | None = Field(default=None, description="True over believed mass of all links, 0.5 to 2.")
    mass_factor_source: str | None = Field(default_factory=source_of("mass_factor"))
    com_error_m: Shift | None = Field(
        default=None, description="Shift of the trunk's centre of mass by 0 to 0.5 m, or [x, y, z] in its axes."
    )
    com_error_source: str | None = Field(default_factory=source_of("com_error_m"))
    joint_friction: Shares | None = Field(
        default=None, description="Coulomb friction of all joints as a share of their effort limits, 0 to 1."
    )
    joint_friction_source: str | None = Field(default_factory=source_of("joint_friction"))
    strength: Annotated[dict[str, Left] | None, AfterValidator(_patterns)] = Field(
        default=None, description='Effort that joints have left, above 0 to 1, by name: { "*Knee*" = 0.8 }.'
    )
    strength_source: str | None = Field(default_factory=source_of("strength"))
    delay_s: Delays | None = Field(
        default=None, description="Age of what the controller feels, 0 to 0.5 s; it counts in steps of 0.02 s."
    )
    delay_source: str | None = Field(default_factory=source_of("delay_s"))
    bumps: Bumps | None = Field(default=None, description="A table [disturbances.bumps].")
    patches: Patches | None = Field(default=None, description="A table [disturbances.patches].")
    pushes: Pushes | None = Field(default=None, description="A table [disturbances.pushes].")
    payload: Payload | None = Field(default=None, description="A table [disturbances.payload].")
    senses: Senses | None = Field(default=None, description="A table [disturbances.senses].")
