"""Grip: close or open a hand; after closing, a small tug tells whether something is in it."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.chain_ik import Target
from teleop_sim.robot.commands import Grip
from teleop_sim.robot.skill import Done, Motion, Tick
from teleop_sim.robot.skills.manipulate import (
    JAW_OPEN,
    JAW_SHUT,
    Arm,
    arm_of,
    follow_path,
    hold,
    move_jaws,
    plan_stance,
    solve_two_stage,
)

MOVE_S = 0.6
"""Time for the jaws' 24 mm stroke: 40 mm/s (assumed)."""
SETTLE_S = 0.2
TUG_M = 0.015
TUG_S = 0.5
FELT_N = 6.0
"""Free air gives 0 N and a wheel with 2 N m of friction 16 N at 0.123 m; a third of that (assumed)."""


@dataclass(frozen=True)
class GripReport:
    """Peak force in the hand during the tug one way and the other [N], and the hand's joints [m or rad]."""

    forward_n: float
    back_n: float
    jaws: tuple[float, ...]


def grip(body: Body, command: Grip, rng: np.random.Generator) -> Motion:
    """Close (ends ``felt`` or ``not_felt``; data: ``GripReport``) or open (ends ``opened``) a hand."""
    arm = arm_of(body, command.side)
    if not command.close:
        yield from move_jaws(arm, JAW_OPEN, MOVE_S)
        return Done("opened", "jaws open")
    jaws = arm.jaws(JAW_SHUT)
    yield from move_jaws(arm, JAW_SHUT, MOVE_S)
    yield from hold(arm, SETTLE_S, jaws)
    home = body.posture.copy()
    forces = []
    for goal in _tugs(arm):
        forces.append((yield from _pull(arm, np.array([goal]), jaws)))
        yield from follow_path(arm, home[None, :], TUG_S, jaws)
    yield from hold(arm, TUG_S, jaws)
    report = GripReport(forces[0], forces[1], body.jaw_gap(command.side))
    # Both ways: a bar that merely leans against a handle from outside feels one way only.
    if min(forces) >= FELT_N:
        return Done("felt", f"{min(forces):.0f} N against the tug", report)
    return Done("not_felt", f"only {min(forces):.1f} N against the tug", report)


def _tugs(arm: Arm) -> list[np.ndarray]:
    """Upper-body postures with the hand moved to either side across the jaws' direction."""
    q, stance = plan_stance(arm)
    rotation, position = arm.kinematics.tool_pose(q, arm.side)
    goals = []
    for sign in (1.0, -1.0):
        target = Target(position + sign * TUG_M * rotation[:, 1], rotation[:, 2])
        solution, _ = solve_two_stage(arm, stance, q, q, target)
        goals.append(solution.q[arm.upper])
    return goals


def _pull(arm: Arm, path: np.ndarray, jaws: tuple[float, float]) -> Generator[Tick, None, float]:
    """Go there and stay a little; return the greatest force felt in the hand [N]."""
    peak_n = 0.0
    for tick in follow_path(arm, path, TUG_S, jaws):
        yield tick
        peak_n = max(peak_n, arm.body.hand_force(arm.side))
    return peak_n
