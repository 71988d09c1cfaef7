"""Postures for a hand, or a tool in it, that moves along a line, a circle or a screw: computed once, then streamed."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import pinocchio as pin

from teleop_sim.robot.affordance import Affordance, Usability, metres_per_unit, moved, turned
from teleop_sim.robot.chain_ik import ChainIk, Solution, Stance, Target
from teleop_sim.robot.commands import Side
from teleop_sim.robot.kinematics import Kinematics
from teleop_sim.robot.pose_ik import PoseIk, pose_target

SPACING_M, SPACING_RAD = 0.01, 0.13
"""Between two rows: a chord of 7.5 degrees (as the crank's table has) or 1 cm, which a straight line in joints misses
by less than 0.3 mm at these arms' lengths."""
BEYOND_M = 0.04
"""Rows go on by so much past both ends: a hand under load is told to be further than it is (assumed)."""
ARM_POSITION_M, ARM_AXIS_RAD = 0.003, 0.1
"""Residuals with which the arm alone is good enough (assumed)."""
REFUSE_POSITION_M, REFUSE_AXIS_RAD = 0.012, 0.3
"""Residuals beyond which a row is out of reach: what the cage was measured to hold (``circle_table``)."""
DRAWN_M = 0.2
"""Way of the tool on which the arm turns to the posture that is drawn to (assumed)."""
JUMP_RAD = 0.2
"""Between two rows: a joint that turns further takes the hand off the way meanwhile (assumed: wrists are to turn by
0.18 rad in the time of a row)."""
FIRST_STEPS, ROW_STEPS = 60, 15
DAMPING: Final = 1e-3
"""Of the sideways correction's least squares [m^2/rad^2]: keeps it finite near a stretched arm (assumed)."""


@dataclass(frozen=True)
class MotionTable:
    """Postures along an affordance, evenly spaced in amount; the first and last rows lie a little beyond the ends.

    Attributes:
        amounts: (n,) of each row, ascending or descending from 0.
        q: (n, nq) whole configurations.
        push: (n, 3, nv) joint torques [N m] with which the tool pushes 1 N along x, y, z.
        aside: (n, 3, nv) joint changes [rad] that move the tool 1 m along x, y, z and keep its approach axis.
        position_error_m, axis_error_rad: the worst residuals of the rows between 0 and the amount asked for.
        jump_rad: the largest joint step between two rows.
        reach: how much of the amount is in reach, in its unit, never negative.
        stage: ``arm`` or ``chain``.

    """

    amounts: np.ndarray
    q: np.ndarray
    push: np.ndarray
    aside: np.ndarray
    position_error_m: float
    axis_error_rad: float
    jump_rad: float
    reach: float
    stage: str

    @property
    def usable(self) -> bool:
        """Whether the hand can go all the way."""
        return self.position_error_m <= REFUSE_POSITION_M and self.axis_error_rad <= REFUSE_AXIS_RAD


@dataclass(frozen=True)
class Way:
    """What a table is asked for: an affordance, how far, and the tool's place and pointing at the start.

    ``rotation``: (3, 3) of the tool at the start, where it must turn with the thing; None leaves its spin free.
    """

    affordance: Affordance
    amount: float
    start: np.ndarray
    pointing: np.ndarray
    rotation: np.ndarray | None = None

    def at(self, amount: float) -> Target:
        """Where the tool goes."""
        place = moved(self.affordance, amount, self.start)
        if self.rotation is None:
            return Target(place, turned(self.affordance, amount, self.pointing))
        axes = [turned(self.affordance, amount, axis) for axis in self.rotation.T]
        return pose_target(place, np.column_stack(axes))


def with_tool(kinematics: Kinematics, side: Side, usability: Usability) -> Kinematics:
    """The planning model with a usability in the place of the hand's tool frame.

    A model of its own: a frame that is added later is written past the end of older Data.
    """
    model = kinematics.model.copy()
    tool = model.frames[kinematics.tools[side]]
    inner = pin.SE3(_pointing(np.array(usability.pointing)), np.array(usability.position))
    name = f"{side}:{usability.name}"
    number = int(model.addFrame(pin.Frame(name, tool.parentJoint, tool.placement * inner, pin.FrameType.OP_FRAME)))
    return replace(kinematics, model=model, data=model.createData(), tools={**kinematics.tools, side: number})


def _pointing(z: np.ndarray) -> np.ndarray:
    """A rotation (3, 3) whose z axis is that unit vector, turned as little as can be."""
    turn: np.ndarray = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), z).toRotationMatrix()
    return turn


def motion_table(
    kinematics: Kinematics, side: Side, stance: Stance, rest: np.ndarray, now: np.ndarray, way: Way
) -> MotionTable:
    """Plan in two stages: the 7-joint arm alone, then, if that leaves too much, torso and arm.

    A function of its arguments. The search begins at the posture ``now`` and goes from row to row, drawn to that at
    first and over ``DRAWN_M`` more and more to ``rest``: another posture for the same place would be reached over
    places that are not on the way, and the posture of the start may not do for many turns.
    """
    amounts, first, last = _rows(way)
    unit_m, tables = metres_per_unit(way.affordance, way.start), []
    shares = np.clip(math.copysign(unit_m / DRAWN_M, way.amount) * amounts, 0.0, 1.0)
    for stage in ("arm", "chain"):
        rests = [now + share * (rest - now) for share in shares]
        solvers: list[ChainIk] = [PoseIk(kinematics, side, stance, drawn, torso=stage == "chain") for drawn in rests]
        table = _table(solvers, stage, now, way, amounts, (first, last))
        near = table.position_error_m <= ARM_POSITION_M and table.axis_error_rad <= ARM_AXIS_RAD
        if near and table.jump_rad <= JUMP_RAD:
            return table
        tables.append(table)
    return min(tables, key=lambda t: (-t.reach, t.jump_rad > JUMP_RAD, t.position_error_m + 0.1 * t.axis_error_rad))


def _rows(way: Way) -> tuple[np.ndarray, int, int]:
    """Amounts of the rows, in the order of the motion, and the numbers of those at 0 and at the amount itself."""
    unit_m = metres_per_unit(way.affordance, way.start)
    spacing = SPACING_M / max(unit_m, 1e-6)
    if way.affordance.kind != "linear":
        spacing = min(spacing * 2.0, SPACING_RAD)
    count = max(1, math.ceil(abs(way.amount) / spacing))
    step = math.copysign(max(abs(way.amount), 1e-9) / count, way.amount)
    beyond = math.ceil(BEYOND_M / max(abs(step) * unit_m, 1e-6))
    beyond = min(beyond, count + 3)
    return step * np.arange(-beyond, count + beyond + 1), beyond, beyond + count


def _table(
    solvers: list[ChainIk], stage: str, now: np.ndarray, way: Way, amounts: np.ndarray, ends: tuple[int, int]
) -> MotionTable:
    first, last = ends
    rows: dict[int, Solution] = {first: solvers[first].solve(now, way.at(0.0), FIRST_STEPS)}
    for k in range(first + 1, len(amounts)):
        rows[k] = solvers[k].solve(rows[k - 1].q, way.at(amounts[k]), ROW_STEPS)
    for k in range(first - 1, -1, -1):
        rows[k] = solvers[k].solve(rows[k + 1].q, way.at(amounts[k]), ROW_STEPS)
    asked = [rows[k] for k in range(first, last + 1)]
    good = [row.within(REFUSE_POSITION_M, REFUSE_AXIS_RAD) for row in asked]
    far = good.index(False) - 1 if False in good else len(good) - 1
    slopes = [_slopes(solvers[k], rows[k].q) for k in range(len(amounts))]
    return MotionTable(
        amounts=amounts,
        q=np.array([rows[k].q for k in range(len(amounts))]),
        push=np.array([push for push, _ in slopes]),
        aside=np.array([aside for _, aside in slopes]),
        position_error_m=max(row.position_error_m for row in asked),
        axis_error_rad=max(row.axis_error_rad for row in asked),
        jump_rad=float(np.abs(np.diff([row.q[7:] for row in asked], axis=0)).max()),
        reach=abs(float(amounts[first + max(far, 0)])),
        stage=stage,
    )


def _slopes(solver: ChainIk, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows ``push`` and ``aside`` of a table, (3, nv) each: the Jacobian's transpose, and its inverse for the arm.

    The inverse is damped least squares (Nakamura and Hanafusa 1986) over the arm's seven joints alone; the tool's spin
    about its own axis stays free.
    """
    kinematics = solver.kinematics
    model, data = kinematics.model, kinematics.data
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    tool = kinematics.tools[solver.side]
    jacobian = pin.getFrameJacobian(model, data, tool, pin.LOCAL_WORLD_ALIGNED)
    across = data.oMf[tool].rotation[:, :2].T
    arm = kinematics.positions(kinematics.arms[solver.side]) - 1
    task = np.vstack([jacobian[:3, arm], 0.3 * across @ jacobian[3:, arm]])
    inverse = task.T @ np.linalg.inv(task @ task.T + DAMPING * np.eye(5))
    aside = np.zeros((3, model.nv))
    aside[:, arm] = inverse[:, :3].T
    return jacobian[:3].copy(), aside
