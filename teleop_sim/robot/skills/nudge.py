"""Nudge: move a hand by a small offset, the operator's direct command."""

from __future__ import annotations

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.chain_ik import Target
from teleop_sim.robot.commands import Nudge
from teleop_sim.robot.skill import Done, Motion
from teleop_sim.robot.skills.manipulate import arm_of, follow_path, hold, plan_stance, solve_two_stage, straight_path

SPEED_M_S = 0.05
"""Assumed: slow enough to be watched."""
REFUSE_M = 0.01
SETTLE_S = 0.3


def nudge(body: Body, command: Nudge, rng: np.random.Generator) -> Motion:
    """Move a hand by ``command.offset`` [m], keeping its approach axis.

    Ends ``reached`` or ``no_plan``; data: the distance [m] the hand was felt to move.
    """
    arm = arm_of(body, command.side)
    q, stance = plan_stance(arm)
    rotation, position = arm.kinematics.tool_pose(q, arm.side)
    pelvis, _ = body.base()
    offset = (rotation if command.frame == "hand" else pelvis) @ np.array(command.offset)
    start = Target(position, rotation[:, 2])
    goal, solver = solve_two_stage(arm, stance, q, q, Target(position + offset, start.approach))
    if not goal.within(REFUSE_M, 0.3):
        return Done("no_plan", f"the hand would stay {goal.position_error_m * 1e3:.0f} mm away")
    path, _ = straight_path(solver, q, start, offset, rows=6)
    length_m = float(np.linalg.norm(offset))
    _, before = arm.hand()
    yield from follow_path(arm, path[1:, arm.upper], max(0.4, length_m / SPEED_M_S), body.jaws)
    yield from hold(arm, SETTLE_S, body.jaws)
    moved_m = float(np.linalg.norm(arm.hand()[1] - before))
    return Done("reached", f"hand moved {moved_m * 1e3:.0f} mm", moved_m)
