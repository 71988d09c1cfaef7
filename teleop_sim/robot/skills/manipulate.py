"""What all manipulation skills share: what the robot feels of itself, planning, streams of reference postures."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass
from typing import Any

import numpy as np

from teleop_sim.robot import templates
from teleop_sim.robot.body import Body
from teleop_sim.robot.chain_ik import ChainIk, Solution, Stance, Target, snapped, stance_of, two_stage
from teleop_sim.robot.circle_table import CircleTable
from teleop_sim.robot.commands import CircularAffordance, PlanarPose, Side
from teleop_sim.robot.gait import body_between
from teleop_sim.robot.kinematics import Kinematics, kinematics_of
from teleop_sim.robot.skill import Tick
from teleop_sim.robot.tables import handle_table

Ticks = Generator[Tick, None, None]

JAW_OPEN = 0.0
JAW_SHUT = 1.5
"""Beyond the stop: the jaws press against it with 36 N, so that a load does not spread them, and give way by less than
the 2 mm to spare round the knob, so that they do not squeeze it (measured)."""
PEAK_RATE_RAD_S = 0.9
"""Of the fastest joint in a free move: Valkyrie's wrists are limited to 1 rad/s."""
STRETCH = 1.875
"""Peak rate of a minimum-jerk move over its mean rate: 15/8 (Flash and Hogan, J. Neurosci. 5 (1985), 1688)."""


@dataclass(frozen=True)
class Arm:
    """One hand and how to plan for it.

    Attributes:
        body: the robot's own senses.
        robot: its name.
        kinematics: planning model.
        side: which hand.
        joints: places in ``q`` of ``body.joint_names``.
        upper: places in ``q`` of ``body.upper_names``.

    """

    body: Body
    robot: str
    kinematics: Kinematics
    side: Side
    joints: np.ndarray
    upper: np.ndarray

    def measured(self) -> np.ndarray:
        """Configuration ``q`` as felt now."""
        pelvis = self.body.plant.pelvis()
        q = np.zeros(self.kinematics.model.nq)
        q[:3], q[3:6], q[6] = pelvis[:3], pelvis[4:], pelvis[3]
        q[self.joints] = self.body.q()
        return q

    def reference(self) -> np.ndarray:
        """Configuration ``q`` with the upper body where it was told to be, not where load has pushed it."""
        q = self.measured()
        q[self.upper] = self.body.posture
        return q

    def hand(self) -> tuple[np.ndarray, np.ndarray]:
        """Rotation (3, 3) and position (3,) [m] of the tool as felt now."""
        return self.kinematics.tool_pose(self.measured(), self.side)

    def tool(self) -> np.ndarray:
        """Position (3,) [m] of the tool as felt now."""
        return self.kinematics.tool_place(self.measured(), self.side)

    def jaws(self, value: float) -> tuple[float, float]:
        """Jaw references with this hand's set and the other's kept."""
        left, right = self.body.jaws
        return (value, right) if self.side == "left" else (left, value)


def arm_of(body: Body, side: Side) -> Arm:
    """Look up by name all that a skill needs for one hand."""
    robot = body.spec.model.description.name
    kinematics = kinematics_of(robot)
    return Arm(
        body, robot, kinematics, side, kinematics.positions(body.joint_names), kinematics.positions(body.upper_names)
    )


def rest_posture(arm: Arm, stance: Stance) -> np.ndarray:
    """The configuration to which redundant joints are drawn: torso and this arm at rest, the others as they were told.

    It hangs on the stance and on references alone, not on what is felt, to the last bit: equal tables are made once.
    """
    q = arm.reference()
    moving, told = (*arm.kinematics.torso, *arm.kinematics.arms[arm.side]), templates.rest_of(arm.robot)
    for name, place, walking in zip(arm.body.upper_names, arm.upper, arm.body.named_posture("walk"), strict=True):
        if name in moving:
            q[place] = told.get(name, walking)
    return np.asarray(np.round(ChainIk(arm.kinematics, arm.side, stance, q, torso=False).settle(q), 6))


def table_of(arm: Arm, affordance: CircularAffordance) -> CircleTable:
    """Postures round a handle's circle from where the robot stands."""
    _, stance = plan_stance(arm)
    return handle_table(arm.robot, arm.side, stance, rest_posture(arm, stance), affordance)


def solve_two_stage(
    arm: Arm, stance: Stance, rest: np.ndarray, q: np.ndarray, target: Target, good_m: float = 0.002
) -> tuple[Solution, ChainIk]:
    """Place the hand from ``q``: the arm alone, then, if it leaves more than ``good_m`` or 0.05 rad, torso and arm."""
    found: list[tuple[Solution, ChainIk]] = []
    for _, solver in two_stage(arm.kinematics, arm.side, stance, rest):
        solution = solver.solve(q, target, 40)
        found.append((solution, solver))
        if solution.within(good_m, 0.05):
            break
    return min(found, key=lambda each: each[0].position_error_m + 0.1 * each[0].axis_error_rad)


def straight_path(
    solver: ChainIk, q: np.ndarray, start: Target, offset: np.ndarray, rows: int
) -> tuple[np.ndarray, Solution]:
    """Postures (rows, nq) along a straight line of the tool from ``start`` by ``offset`` (3,) [m]; and the last one."""
    path = []
    solution = solver.judge(q, start)
    for share in np.linspace(0.0, 1.0, rows):
        place = Target(start.position + share * offset, start.approach)
        solution = solver.solve(solution.q, place, 12)
        path.append(solution.q)
    return np.array(path), solution


def plan_stance(arm: Arm) -> tuple[np.ndarray, Stance]:
    """Return the reference configuration and what to keep while the hands work.

    Feet are where they are felt, to a millimetre; centre of mass and pelvis where the law keeps them above such feet,
    because a loaded hand moves them.
    """
    left, right = (snapped(foot) for foot in stance_of(arm.kinematics, arm.measured()).feet)
    x, y, yaw = body_between((_planar(left), _planar(right)))
    com = np.array([x, y, arm.body.com_height_m + (left.translation[2] + right.translation[2]) / 2])
    c, s = math.cos(yaw), math.sin(yaw)
    pelvis = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return arm.reference(), Stance((left, right), com, pelvis)


def _planar(foot: Any) -> PlanarPose:
    forward = foot.rotation[:, 0]
    return float(foot.translation[0]), float(foot.translation[1]), math.atan2(forward[1], forward[0])


def smooth(share: float) -> float:
    """Minimum-jerk progress, 0 to 1, after a share of the time. Source: Flash and Hogan 1985."""
    s = min(max(share, 0.0), 1.0)
    return s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)


def move_jaws(arm: Arm, goal: float, seconds: float) -> Ticks:
    """Open or shut this hand's jaws at an even rate; a jump of the reference would slam them into what they hold."""
    posture, start = arm.body.posture.copy(), arm.body.jaws[0 if arm.side == "left" else 1]
    count = max(1, round(seconds / arm.body.tick_s))
    for k in range(1, count + 1):
        yield Tick(posture, jaws=arm.jaws(start + (goal - start) * k / count))


def hold(arm: Arm, seconds: float, jaws: tuple[float, float]) -> Ticks:
    """Keep the reference posture."""
    posture = arm.body.posture.copy()
    for _ in range(round(seconds / arm.body.tick_s)):
        yield Tick(posture, jaws=jaws)


def follow_path(arm: Arm, path: np.ndarray, duration_s: float, jaws: tuple[float, float]) -> Ticks:
    """Stream upper-body postures (rows, n_upper), from rest to rest, starting wherever the reference is now.

    Rows get time in proportion to the largest joint change between them, and all of it takes ``duration_s`` or as much
    longer as keeps every joint below ``PEAK_RATE_RAD_S``: 12 cm straight back can cost a folded arm 1.5 rad.
    """
    rows = np.vstack([arm.body.posture, path])
    lengths = np.abs(np.diff(rows, axis=0)).max(axis=1)
    far = np.concatenate([[0.0], np.cumsum(np.maximum(lengths, 1e-9))])
    duration_s = max(duration_s, STRETCH * float(far[-1]) / PEAK_RATE_RAD_S)
    count = max(1, math.ceil(duration_s / arm.body.tick_s))
    place = np.array([smooth(k / count) for k in range(count + 1)]) * far[-1]
    row = np.minimum(np.searchsorted(far, place, side="right") - 1, len(path) - 1)
    share = ((place - far[row]) / (far[row + 1] - far[row]))[:, None]
    postures = rows[row] + share * (rows[row + 1] - rows[row])
    rates = np.diff(postures, axis=0) / arm.body.tick_s
    for posture, rate in zip(postures[1:], rates, strict=True):
        yield Tick(posture, rate, jaws=jaws)


def home(arm: Arm) -> np.ndarray:
    """Upper-body posture (n_upper,) with this arm and the torso as for walking and the rest as it is."""
    moving = (*arm.kinematics.torso, *arm.kinematics.arms[arm.side])
    walk = arm.body.named_posture("walk")
    return np.where([name in moving for name in arm.body.upper_names], walk, arm.body.posture)
