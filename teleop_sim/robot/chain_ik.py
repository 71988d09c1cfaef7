"""Whole-body inverse kinematics of one hand: five task coordinates, feet, centre of mass and pelvis held.

The hand's position and approach axis are asked for; its spin about that axis is free, because a cage round a ball does
not care. Pelvis position and legs are eliminated first: they are whatever keeps both feet, the centre of mass and the
pelvis' orientation, so what is left to solve has one unknown a joint of the arm (7) or of torso and arm (10).

Source of the method: damped least squares, Nakamura and Hanafusa, J. Dyn. Sys. Meas. Control 108 (1986) 163; its
step limit, weights and posture pull are assumed (they reached all reachable targets in throw-away trials).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from teleop_sim.robot.clearance import slope, trunk_gaps
from teleop_sim.robot.commands import Side
from teleop_sim.robot.kinematics import Kinematics

ERROR_TOLERANCE = 5e-4
"""A search that hardly moves ends within it, [m] and [rad] (assumed: a tenth of what the arm alone may leave)."""
STEP_LIMIT_RAD = 0.25
"""Assumed: without a limit on the step the search diverges silently."""
TASK_LIMIT = 0.3
"""Assumed: the longest task error [m, rad mixed] that one iteration tries to remove."""
LIMIT_MARGIN_RAD = 0.03
LIMIT_STOP_RAD = 0.005
POSTURE_PULL = 1e-4
"""Of an arm's joint towards its rest; the torso is held as much harder as it is heavier than an arm (WPI, Table I)."""
LIMIT_PULL = 30.0
TASK_WEIGHT = 10.0
GAP_WEIGHT = 3.0
SETTLE_STEPS = 8
"""Newton's method doubles the digits each time: from 0.1 rad off five steps do."""
SNAP = 1e-3
"""Grid of planned stances, [m] and [rad]: a foot's millimetre is one of the hand's, half its play round the handle."""
GAP_M = 0.02
"""Kept between arm and trunk: 1 cm wanted, 1 cm for tracking error (arms are within 11 mrad under load, measured)."""
GAP_NEAR_M = 0.1
"""Wider gaps cannot close in one step of ``STEP_LIMIT_RAD`` at a limb's length of 0.3 m."""


@dataclass(frozen=True)
class Stance:
    """What the standing robot keeps: soles (left, right) in the world, centre of mass (3,) [m], pelvis' rotation."""

    feet: tuple[Any, Any]
    com: np.ndarray
    pelvis: np.ndarray


@dataclass(frozen=True)
class Target:
    """Where a hand goes: ``position`` (3,) [m] of the tool and ``approach`` (3,), unit vector that tool z must take."""

    position: np.ndarray
    approach: np.ndarray


@dataclass(frozen=True)
class Solution:
    """A posture and how well it serves: hand's errors [m], [rad] and the least distance from a joint limit [rad]."""

    q: np.ndarray
    position_error_m: float
    axis_error_rad: float
    limit_margin_rad: float

    def within(self, position_m: float, axis_rad: float) -> bool:
        """Say whether the hand is that near its target."""
        return self.position_error_m <= position_m and self.axis_error_rad <= axis_rad


def snapped(foot: Any) -> Any:
    """A placement on a grid of ``SNAP``, so that a foot that hardly moved is where it was."""
    return pin.SE3(np.array(pin.exp3(_on_grid(pin.log3(foot.rotation)))), _on_grid(foot.translation))


def _on_grid(values: np.ndarray) -> np.ndarray:
    return np.asarray(np.round(values / SNAP) * SNAP + 0.0)


def stance_of(kinematics: Kinematics, q: np.ndarray) -> Stance:
    """Return what a robot standing in posture ``q`` keeps."""
    model, data = kinematics.model, kinematics.data
    com = np.array(pin.centerOfMass(model, data, q))
    left, right = (pin.SE3(pin.updateFramePlacement(model, data, sole)) for sole in kinematics.soles)
    return Stance((left, right), com, pin.Quaternion(q[3:7]).toRotationMatrix())


class ChainIk:
    """Inverse kinematics of one hand for one stance.

    Args:
        kinematics: planning model.
        side: which hand.
        stance: what to keep.
        rest: ``q`` whose arm and torso angles are preferred.
        torso: whether the torso's three joints help (the 10-joint chain).

    """

    def __init__(self, kinematics: Kinematics, side: Side, stance: Stance, rest: np.ndarray, torso: bool) -> None:
        self.kinematics, self.side, self.stance = kinematics, side, stance
        arm = kinematics.arms[side]
        names = (*kinematics.torso, *arm) if torso else arm
        self.chain = kinematics.positions(names)
        self.rates = self.chain - 1
        self.base = np.concatenate([np.arange(6), kinematics.positions(kinematics.legs) - 1])
        self.rest = rest[self.chain]
        self.pull = POSTURE_PULL * np.array(
            [kinematics.torso_per_arm if name in kinematics.torso else 1.0 for name in names]
        )
        self.lower = kinematics.lower[self.chain - 7]
        self.upper = kinematics.upper[self.chain - 7]

    def solve(self, q: np.ndarray, target: Target, iterations: int) -> Solution:
        """Search from ``q`` for at most that many iterations; stop when the hand is there and the posture rests."""
        for _ in range(iterations):
            q, errors, moved = self.step(q, target)
            if moved < 0.02 and np.abs(errors).max() < ERROR_TOLERANCE:
                break
        return self.judge(q, target)

    def settle(self, q: np.ndarray) -> np.ndarray:
        """``q`` with pelvis and legs moved so that the stance is kept; from near enough the last bits repeat."""
        model, data = self.kinematics.model, self.kinematics.data
        for _ in range(SETTLE_STEPS):
            com_jacobian = pin.jacobianCenterOfMass(model, data, q)
            pin.updateFramePlacements(model, data)
            held, error = self._held(q, com_jacobian)
            velocity = np.zeros(model.nv)
            velocity[self.base] = np.linalg.solve(held[:, self.base], error)
            velocity *= min(1.0, STEP_LIMIT_RAD / max(float(np.abs(velocity).max()), 1e-12))
            q = pin.integrate(model, q, velocity)
        return np.asarray(q)

    def judge(self, q: np.ndarray, target: Target) -> Solution:
        """Measure how well posture ``q`` serves a target."""
        rotation, position = self.kinematics.tool_pose(q, self.side)
        cosine = float(np.clip(rotation[:, 2] @ target.approach, -1.0, 1.0))
        angles = q[self.chain]
        margin = float(np.minimum(angles - self.lower, self.upper - angles).min())
        return Solution(q, float(np.linalg.norm(target.position - position)), float(np.arccos(cosine)), margin)

    def step(self, q: np.ndarray, target: Target) -> tuple[np.ndarray, np.ndarray, float]:
        """One iteration. Return the new ``q``, all 23 errors before it and the largest change [rad or m]."""
        model, data = self.kinematics.model, self.kinematics.data
        com_jacobian = pin.jacobianCenterOfMass(model, data, q)
        pin.updateFramePlacements(model, data)
        held, held_error = self._held(q, com_jacobian)
        task, task_error = self._task(target)
        reply = np.linalg.solve(held[:, self.base], np.column_stack([held_error, held[:, self.rates]]))
        free = task[:, self.rates] - task[:, self.base] @ reply[:, 1:]
        wanted = task_error * min(1.0, TASK_LIMIT / max(float(np.linalg.norm(task_error)), 1e-12))
        change = self._least(q, free, wanted - task[:, self.base] @ reply[:, 0])
        velocity = np.zeros(model.nv)
        velocity[self.rates] = change
        velocity[self.base] = reply[:, 0] - reply[:, 1:] @ change
        velocity *= min(1.0, STEP_LIMIT_RAD / max(float(np.abs(velocity).max()), 1e-12))
        q = pin.integrate(model, q, velocity)
        q[self.chain] = np.clip(q[self.chain], self.lower + LIMIT_STOP_RAD, self.upper - LIMIT_STOP_RAD)
        return q, np.concatenate([held_error, task_error]), float(np.abs(velocity).max())

    def _held(self, q: np.ndarray, com_jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Jacobian (18, nv) and error (18,) of soles, centre of mass and pelvis' orientation."""
        model, data = self.kinematics.model, self.kinematics.data
        jacobian, error = np.zeros((18, model.nv)), np.empty(18)
        for i, (sole, foot) in enumerate(zip(self.kinematics.soles, self.stance.feet, strict=True)):
            jacobian[6 * i : 6 * i + 6] = pin.getFrameJacobian(model, data, sole, pin.LOCAL)
            error[6 * i : 6 * i + 6] = pin.log6(data.oMf[sole].actInv(foot)).vector
        jacobian[12:15], error[12:15] = com_jacobian, self.stance.com - data.com[0]
        jacobian[15:18, 3:6] = np.eye(3)
        error[15:18] = pin.log3(pin.Quaternion(q[3:7]).toRotationMatrix().T @ self.stance.pelvis)
        return jacobian, error

    def _task(self, target: Target) -> tuple[np.ndarray, np.ndarray]:
        """Jacobian (5, nv) and error (5,) of the hand, in the tool's own frame: position and tilt of its z axis."""
        model, data = self.kinematics.model, self.kinematics.data
        tool = self.kinematics.tools[self.side]
        placement = data.oMf[tool]
        jacobian = pin.getFrameJacobian(model, data, tool, pin.LOCAL)[:5]
        place = placement.rotation.T @ (target.position - placement.translation)
        aim = placement.rotation.T @ target.approach
        sine = float(np.hypot(aim[0], aim[1]))
        tilt = np.array([-aim[1], aim[0]]) * (np.arctan2(sine, aim[2]) / max(sine, 1e-9))
        return jacobian, np.concatenate([place, tilt])

    def _least(self, q: np.ndarray, free: np.ndarray, wanted: np.ndarray) -> np.ndarray:
        """Least weighted change (chain,) of the joints: hand first, then joint limits and gap, then rest posture."""
        angles = q[self.chain]
        inside = np.clip(angles, self.lower + LIMIT_MARGIN_RAD, self.upper - LIMIT_MARGIN_RAD)
        outside = inside != angles
        pull = np.where(outside, LIMIT_PULL, self.pull)
        goal = np.where(outside, inside, self.rest) - angles
        normal = TASK_WEIGHT * free.T @ free + np.diag(pull + 1e-6)
        right = TASK_WEIGHT * free.T @ wanted + pull * goal
        change = np.linalg.solve(normal, right)
        rows = self._closing(change)
        for row, missing_m in rows:
            normal += GAP_WEIGHT * np.outer(row, row)
            right += GAP_WEIGHT * missing_m * row
        return np.asarray(np.linalg.solve(normal, right) if rows else change)

    def _closing(self, change: np.ndarray) -> list[tuple[np.ndarray, float]]:
        """Slopes (chain,) [m/rad] of the gaps to the trunk that a change would make too narrow; what is missing [m]."""
        found = []
        for gap in trunk_gaps(self.kinematics, self.side):
            if gap.width_m < GAP_NEAR_M:
                row = np.zeros(len(change))
                row[-7:] = slope(self.kinematics, self.side, gap)
                if gap.width_m + row @ change < GAP_M:
                    found.append((row, GAP_M - gap.width_m))
        return found


def two_stage(
    kinematics: Kinematics, side: Side, stance: Stance, rest: np.ndarray
) -> tuple[tuple[str, ChainIk], tuple[str, ChainIk]]:
    """The planner's two stages: the 7-joint ``arm``, then the 10-joint ``chain`` with the torso."""
    arm = ChainIk(kinematics, side, stance, rest, torso=False)
    return ("arm", arm), ("chain", ChainIk(kinematics, side, stance, rest, torso=True))


def search(
    solver: ChainIk, q: np.ndarray, target: Target, rng: np.random.Generator, restarts: int = 6, iterations: int = 60
) -> Solution:
    """Solve from ``q``; while the hand stays away, again from random arms. Return the best found.

    A start is the rest posture with each arm joint moved by a normal deviate of 0.5 rad (assumed).
    """
    best = solver.solve(q, target, iterations)
    for _ in range(restarts):
        if best.within(2e-3, 0.05):
            break
        start = best.q.copy()
        drawn = solver.rest[-7:] + rng.normal(0.0, 0.5, 7)
        start[solver.chain[-7:]] = np.clip(drawn, solver.lower[-7:] + 0.05, solver.upper[-7:] - 0.05)
        found = solver.solve(start, target, iterations)
        if found.position_error_m + 0.1 * found.axis_error_rad < best.position_error_m + 0.1 * best.axis_error_rad:
            best = found
    return best
