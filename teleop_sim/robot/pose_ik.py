"""Inverse kinematics of a hand whose whole pose counts: six task coordinates instead of five.

What a hand holds by a bar must not turn about the approach axis, as a ball in a cage may. Everything else is
``teleop_sim.robot.chain_ik``'s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from teleop_sim.robot.chain_ik import ChainIk, Solution, Target


@dataclass(frozen=True)
class PoseTarget(Target):
    """Where a hand goes and how it is turned: ``rotation`` (3, 3) of the tool frame, its z is ``approach``."""

    rotation: np.ndarray


def pose_target(position: np.ndarray, rotation: np.ndarray) -> PoseTarget:
    """A target from the tool's position (3,) [m] and rotation (3, 3)."""
    return PoseTarget(position, rotation[:, 2], rotation)


def angle_between(a: np.ndarray, b: np.ndarray) -> float:
    """Angle [rad] that turns one rotation (3, 3) into another."""
    return float(np.linalg.norm(pin.log3(a.T @ b)))


class PoseIk(ChainIk):
    """``ChainIk`` that also serves targets with a rotation; the axis error of its solutions is then the whole turn."""

    def judge(self, q: np.ndarray, target: Target) -> Solution:
        """Measure how well posture ``q`` serves a target."""
        found = super().judge(q, target)
        if not isinstance(target, PoseTarget):
            return found
        rotation, _ = self.kinematics.tool_pose(q, self.side)
        return Solution(q, found.position_error_m, angle_between(rotation, target.rotation), found.limit_margin_rad)

    def _task(self, target: Target) -> tuple[np.ndarray, np.ndarray]:
        """Jacobian (6, nv) and error (6,) of the hand in the tool's own frame."""
        if not isinstance(target, PoseTarget):
            return super()._task(target)
        model, data = self.kinematics.model, self.kinematics.data
        tool = self.kinematics.tools[self.side]
        placement = data.oMf[tool]
        jacobian = pin.getFrameJacobian(model, data, tool, pin.LOCAL)
        place = placement.rotation.T @ (target.position - placement.translation)
        turn = pin.log3(placement.rotation.T @ target.rotation)
        return np.asarray(jacobian), np.concatenate([place, turn])
