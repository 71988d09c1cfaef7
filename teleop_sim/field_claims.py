"""A claim as marks in a picture for the operator, and what of it was true for the log."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping

import numpy as np

from teleop_sim.channel import messages as msg
from teleop_sim.core.records import Claimed
from teleop_sim.robot.perception.camera import project
from teleop_sim.robot.perception.rays import SensorPose
from teleop_sim.robot.programs.steps import Claim, Mark
from teleop_sim.world.console import wheel_axes
from teleop_sim.world.description import Vector

RIM = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
"""Points of a rim whose images give its size; 16 find a half size to 2 % (1 - cos(pi / 16))."""


def marks_message(claim: Claim, edge: int, image: msg.Image, pose: SensorPose, size: tuple[int, int]) -> msg.Marks:
    """The marks of a claim in a picture taken from where the camera is believed to be.

    What is not in front of the camera, or too far beside the picture to be sent, has no mark.
    """
    made = (_mark(mark, pose, size) for mark in claim.marks)
    return msg.Marks(edge, picture_number(image), tuple(mark for mark in made if mark is not None))


def picture_number(image: msg.Image) -> int:
    """Which picture it is: CRC-32 of its bytes."""
    return zlib.crc32(image.coded)


def _mark(mark: Mark, pose: SensorPose, size: tuple[int, int]) -> msg.PixelMark | None:
    middle = np.asarray(mark.place)
    rim = project(middle + mark.radius_m * _rim(mark, pose, middle), pose, *size)
    ((across, down),) = project(middle[None], pose, *size)
    half_width, half_height = np.abs(rim - [across, down]).max(axis=0)
    beside = max(abs(across), abs(down), half_width, half_height)
    if not beside < max(size) * 4:
        return None
    return msg.PixelMark(mark.what, float(across), float(down), float(half_width), float(half_height))


def _rim(mark: Mark, pose: SensorPose, middle: np.ndarray) -> np.ndarray:
    """Directions (n, 3) to the outline: of a ball across the view, of a wheel in its tilted plane, facing the robot."""
    if mark.what.endswith("handle"):
        first, second = pose.rotation[:, 1], pose.rotation[:, 2]
    else:
        way = (middle - pose.position)[:2]
        heading = math.atan2(way[1], way[0])
        c, s = math.cos(heading), math.sin(heading)
        (x, _, z), *_ = wheel_axes()
        first, second = np.array([c * x, s * x, z]), np.array([-s, c, 0.0])
    return np.asarray(np.outer(np.cos(RIM), first) + np.outer(np.sin(RIM), second))


def claimed_records(
    now_s: float, state: str, claim: Claim, image: msg.Image, true: Mapping[str, Vector]
) -> tuple[Claimed, ...]:
    """How far each thing that is claimed is from where it truly is."""
    number = picture_number(image)
    return tuple(
        Claimed(now_s, state, claim.event, number, m.what, m.place, true[m.what], math.dist(m.place, true[m.what]))
        for m in claim.marks
        if m.what in true
    )
