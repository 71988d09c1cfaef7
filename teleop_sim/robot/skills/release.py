"""Release: open the hand, draw it back off the handle along the axis, bring the arm home."""

from __future__ import annotations

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.chain_ik import Target
from teleop_sim.robot.commands import Release
from teleop_sim.robot.skill import Done, Motion
from teleop_sim.robot.skills.clear_way import way_home
from teleop_sim.robot.skills.manipulate import (
    JAW_OPEN,
    arm_of,
    follow_path,
    hold,
    move_jaws,
    plan_stance,
    solve_two_stage,
    straight_path,
)

BACK_M = 0.12
BACK_S = 1.5
OPEN_S = 0.5
SETTLE_S = 0.2


def release(body: Body, command: Release, rng: np.random.Generator) -> Motion:
    """Let go of a handle. Always ends ``released``.

    The way back starts where the hand is felt to be, not where the plan thought it: a hand that a load has pushed
    aside would otherwise sweep the handle along.
    """
    arm = arm_of(body, command.side)
    jaws = arm.jaws(JAW_OPEN)
    yield from move_jaws(arm, JAW_OPEN, OPEN_S)
    yield from hold(arm, SETTLE_S, jaws)
    q, stance = plan_stance(arm)
    rotation, position = arm.hand()
    start = Target(position, rotation[:, 2])
    solution, solver = solve_two_stage(arm, stance, q, q, start)
    path, _ = straight_path(solver, solution.q, start, BACK_M * np.array(command.affordance.axis), rows=9)
    way = way_home(arm, solver, path[-1], command.affordance)
    yield from follow_path(arm, path[:, arm.upper], BACK_S, jaws)
    yield from follow_path(arm, way.q[:, arm.upper], 1.5, jaws)
    yield from hold(arm, SETTLE_S, jaws)
    touched = "" if way.touches is None else ", though {} was to touch {}".format(*way.touches)
    return Done("released", f"hand open, arm home{touched}")
