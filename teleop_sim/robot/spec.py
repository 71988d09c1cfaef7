"""What makes one robot different from another, as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from teleop_sim.robot.gait import Gait
from teleop_sim.world.robot_model import RobotModel


@dataclass(frozen=True)
class RobotSpec:
    """One robot.

    Attributes:
        model: body, servos, shapes, hands.
        legs: joint names, left then right, from the hip: yaw, roll, pitch, knee, ankle pitch, ankle roll.
        arms: joint names by side, from the shoulder.
        torso, neck: joint names from the pelvis.
        knee_rad: bend of the knees when standing.
        postures: named upper-body postures; a joint that is not named is at zero or at its nearest limit.
        head_pitch, head_yaw: joints that move the head; those that pitch it from below, one or none that turns.
        camera_frame, lidar_frame: sites of the sensors.
        gait: walking figures.
        gains: the control law's gains that differ from the usual ones, by their names in ``law.Gains``.
    """

    model: RobotModel
    legs: tuple[tuple[str, ...], tuple[str, ...]]
    arms: Mapping[str, tuple[str, ...]]
    torso: tuple[str, ...]
    neck: tuple[str, ...]
    knee_rad: float
    postures: Mapping[str, Mapping[str, float]]
    head_pitch: tuple[str, ...]
    head_yaw: str | None
    camera_frame: str
    lidar_frame: str
    gait: Gait
    gains: Mapping[str, float] = field(default_factory=dict)

    @property
    def upper(self) -> tuple[str, ...]:
        """All joints but the legs', in the model's order."""
        legs = {name for leg in self.legs for name in leg}
        return tuple(j.name for j in self.model.description.depth_first() if j.name not in legs)
