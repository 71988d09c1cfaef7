"""What detectors find, in the odometry frame."""

from __future__ import annotations

from dataclasses import dataclass

from teleop_sim.robot.commands import CircularAffordance, PlanarPose, Vector


@dataclass(frozen=True)
class ConsoleGlimpse:
    """Coarse: where the two coloured wheels of the console seem to be."""

    yaw_wheel: Vector
    pitch_wheel: Vector


@dataclass(frozen=True)
class ConsoleFix:
    """Fine: the console's pose on the ground and its two handles.

    ``pose``: middle of the two wheels projected on the ground; yaw is the direction in which a robot that faces the
    console looks. ``ground_z_m``: height of the console's foot in the odometry frame.
    """

    pose: PlanarPose
    ground_z_m: float
    yaw_handle: CircularAffordance
    pitch_handle: CircularAffordance


@dataclass(frozen=True)
class FinishFix:
    """The finish square: its centre, and a way to it over the walkway."""

    centre: PlanarPose
    path: tuple[PlanarPose, ...]
