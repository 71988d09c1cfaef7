"""Scores of the door and the valve: how far a joint of the plant has ever gone, mark by mark."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

DOOR_MARKS = (
    (math.radians(2.0), "door off its latch"),
    (math.radians(12.0), "door pushed open"),
    (math.radians(80.0), "door open to walk through"),
)
"""The first is more than the latch's play gives; the others are assumed. The second is what a standing robot's push is
for (a hand at 0.8 m from the hinges goes 17 cm), the third is for the push of a walking one."""
VALVE_MARKS = tuple((math.radians(90.0 * k), f"valve turned by {90 * k} degrees") for k in (1, 2, 3, 4))
"""One whole turn is the task (DARPA Robotics Challenge, "Valve")."""
PUSHED, WIDE, WHOLE_TURN = 2, 3, 4
"""Checkpoints that can be asked for: of the door two, of the valve one."""


@dataclass(frozen=True)
class JointScore:
    """Marks that a joint's angle passes, in rising order; a mark once passed stays.

    Attributes:
        joint: its place among the plant's joints.
        marks: (angle [rad], words), rising.
        checkpoint: how many have been passed.
    """

    joint: int
    marks: tuple[tuple[float, str], ...]
    checkpoint: int = 0

    def at(self, t_s: float, pelvis: np.ndarray, joints: np.ndarray) -> tuple[JointScore, tuple[tuple[int, str], ...]]:
        """The score after a sample, and the marks it passed. Neither time nor the pelvis matters."""
        angle, passed = float(joints[self.joint]), self.checkpoint
        while passed < len(self.marks) and angle >= self.marks[passed][0]:
            passed += 1
        seen = tuple((k + 1, self.marks[k][1]) for k in range(self.checkpoint, passed))
        return (replace(self, checkpoint=passed) if seen else self), seen

    def quiet(self, t_s: np.ndarray, pelvis: np.ndarray, joints: np.ndarray) -> int:
        """How many samples from the first on stay short of the next mark."""
        if self.checkpoint == len(self.marks):
            return len(t_s)
        passed = np.flatnonzero(joints[:, self.joint] >= self.marks[self.checkpoint][0])
        return int(passed[0]) if len(passed) else len(t_s)

    def next_s(self, t_s: float) -> float:
        """A frozen robot moves nothing."""
        return math.inf

    def status(self, t_s: float, joints: np.ndarray) -> dict[str, float]:
        """Neither door nor valve tells anything."""
        return {}


def door_score(joint_names: tuple[str, ...]) -> JointScore:
    """The door's score before anything happened."""
    return JointScore(joint_names.index("doorHinge"), DOOR_MARKS)


def valve_score(joint_names: tuple[str, ...]) -> JointScore:
    """The valve's score before anything happened."""
    return JointScore(joint_names.index("valveWheel"), VALVE_MARKS)
