"""Reach: bring the open hand over a handle, then straight down to it along the axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.chain_ik import ChainIk, two_stage
from teleop_sim.robot.circle_table import CircleTable, circle_of
from teleop_sim.robot.commands import Reach
from teleop_sim.robot.skill import Done, Motion
from teleop_sim.robot.skills.clear_way import way_there
from teleop_sim.robot.skills.manipulate import (
    JAW_OPEN,
    Arm,
    arm_of,
    follow_path,
    hold,
    plan_stance,
    rest_posture,
    straight_path,
    table_of,
)

LIFT_M = 0.1
"""Height over the handle before going down: the bars reach 2 cm beyond the tool, the knob 3 cm (assumed)."""
DESCENT_S = 1.5
SETTLE_S = 0.3
REFUSE_LIFTED_M = 0.02


@dataclass(frozen=True)
class ReachReport:
    """How near the hand came and with which joints.

    ``position_error_m`` and ``axis_error_rad`` are felt at the end; ``plan_*`` are the table's worst residuals
    round the whole circle; ``stage`` is ``arm`` or ``chain``.
    """

    position_error_m: float
    axis_error_rad: float
    plan_position_m: float
    plan_axis_rad: float
    stage: str


def reach(body: Body, command: Reach, rng: np.random.Generator) -> Motion:
    """Reach a handle. Ends ``reached`` or ``no_plan``; data: ``ReachReport`` (None if nothing moved)."""
    arm = arm_of(body, command.side)
    table = table_of(arm, command.affordance)
    if not table.usable:
        return Done("no_plan", _refusal(table))
    solver, path, lifted_error_m = _descent(arm, table, command)
    if lifted_error_m > REFUSE_LIFTED_M:
        return Done("no_plan", f"the hand stays {lifted_error_m * 1e3:.0f} mm off the place over the handle")
    way = way_there(arm, solver, path[0], command.affordance)
    if way.touches is not None:
        return Done("no_plan", "no way to the handle: {} would touch {}".format(*way.touches))
    jaws = arm.jaws(JAW_OPEN)
    yield from follow_path(arm, way.q[:, arm.upper], 1.5, jaws)
    yield from hold(arm, SETTLE_S, jaws)
    yield from follow_path(arm, path[1:, arm.upper], DESCENT_S, jaws)
    yield from hold(arm, SETTLE_S, jaws)
    report = _judge(arm, table, command)
    return Done("reached", f"hand {report.position_error_m * 1e3:.0f} mm off, {table.stage} joints", report)


def _refusal(table: CircleTable) -> str:
    off_mm, tilt_deg = table.position_error_m * 1e3, np.degrees(table.axis_error_rad)
    return f"the handle's circle is out of reach: {off_mm:.0f} mm, {tilt_deg:.0f} degrees off"


def _descent(arm: Arm, table: CircleTable, command: Reach) -> tuple[ChainIk, np.ndarray, float]:
    """Solver, configurations from the lifted place down to the table's own posture, the lifted hand's error [m]."""
    _, stance = plan_stance(arm)
    rest = rest_posture(arm, stance)
    solver = dict(two_stage(arm.kinematics, arm.side, stance, rest))[table.stage]
    target = circle_of(command.affordance).place(command.affordance.angle_rad)
    bottom = solver.solve(table.at(command.affordance.angle_rad), target, 12)
    path, lifted = straight_path(solver, bottom.q, target, -LIFT_M * target.approach, rows=9)
    return solver, path[::-1], lifted.position_error_m


def _judge(arm: Arm, table: CircleTable, command: Reach) -> ReachReport:
    rotation, position = arm.hand()
    target = circle_of(command.affordance).place(command.affordance.angle_rad)
    cosine = float(np.clip(rotation[:, 2] @ target.approach, -1.0, 1.0))
    return ReachReport(
        position_error_m=float(np.linalg.norm(position - target.position)),
        axis_error_rad=float(np.arccos(cosine)),
        plan_position_m=table.position_error_m,
        plan_axis_rad=table.axis_error_rad,
        stage=table.stage,
    )
