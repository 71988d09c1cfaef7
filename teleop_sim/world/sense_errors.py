"""What the robot believes wrongly about its own sensors: a value, an input of a run like its seed.

Calibration is an estimate: a camera sits otherwise on its head than the description says, a spindle's zero is off, a
lens is longer than believed.

Not modelled: lens distortion, a clock between sensors, drift with temperature.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from teleop_sim.world.description import Vector


@dataclass(frozen=True, slots=True)
class Misalignment:
    """How a sensor truly sits in the frame where it is believed to sit (axes forward, left, up).

    ``turn_rad``: a rotation vector. ``shift_m``: the offset.
    """

    turn_rad: Vector = (0.0, 0.0, 0.0)
    shift_m: Vector = (0.0, 0.0, 0.0)


ALIGNED = Misalignment()
"""A sensor that sits where it is believed to."""


@dataclass(frozen=True, slots=True)
class SenseErrors:
    """All that is wrong with the sensors.

    Attributes:
        camera, lidar: how they truly sit. spindle_rad: zero of the LIDAR's spindle.
        focal: true over believed focal length of the camera; baseline: the same for the stereo pair's distance.
        pixel_noise, range_noise: factors on the standard deviations of the data sheets.
        exposure: factor on the brightness of images: a camera that has adapted to another light.
    """

    camera: Misalignment = ALIGNED
    lidar: Misalignment = ALIGNED
    spindle_rad: float = 0.0
    focal: float = 1.0
    baseline: float = 1.0
    pixel_noise: float = 1.0
    range_noise: float = 1.0
    exposure: float = 1.0


EXACT = SenseErrors()
"""Sensors as their data sheets say, mounted as the robot's description says."""


@dataclass(frozen=True, slots=True)
class CalibrationSpread:
    """Standard deviations of what calibration leaves over (assumed: a head calibrated with a board, once).

    Attributes:
        turn_rad, shift_m: of each axis of camera and LIDAR. spindle_rad, focal, baseline: see ``SenseErrors``.
    """

    turn_rad: float = 0.003
    shift_m: float = 0.002
    spindle_rad: float = 0.002
    focal: float = 0.003
    baseline: float = 0.005


def draw_sense_errors(streams: Callable[[str], np.random.Generator], ranges: CalibrationSpread) -> SenseErrors:
    """Draw one robot's calibration; whatever is zero moves no other draw."""
    rng = streams("disturbances.senses")
    camera, lidar, rest = rng.normal(size=(2, 3)), rng.normal(size=(2, 3)), rng.normal(size=3)
    return SenseErrors(
        _misalignment(camera, ranges),
        _misalignment(lidar, ranges),
        spindle_rad=float(ranges.spindle_rad * rest[0]),
        focal=float(1.0 + ranges.focal * rest[1]),
        baseline=float(1.0 + ranges.baseline * rest[2]),
    )


def _misalignment(drawn: np.ndarray, ranges: CalibrationSpread) -> Misalignment:
    turn, shift = ranges.turn_rad * drawn[0], ranges.shift_m * drawn[1]
    return Misalignment(
        (float(turn[0]), float(turn[1]), float(turn[2])), (float(shift[0]), float(shift[1]), float(shift[2]))
    )
