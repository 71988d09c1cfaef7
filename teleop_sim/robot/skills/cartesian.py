"""Cartesian: lead a hand's tool straight to a pose, the operator's direct command; guarded, also in contact."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from teleop_sim.robot.body import Body
from teleop_sim.robot.chain_ik import Solution
from teleop_sim.robot.collision import Collisions
from teleop_sim.robot.commands import Cartesian
from teleop_sim.robot.pose_ik import PoseIk, PoseTarget, angle_between, pose_target
from teleop_sim.robot.skill import Done, Motion
from teleop_sim.robot.skills.enter import refusal
from teleop_sim.robot.skills.guarding import guard_n
from teleop_sim.robot.skills.manipulate import STRETCH, Arm, arm_of, plan_stance, rest_posture
from teleop_sim.robot.skills.servoing import FELT_TICKS, Led, line, stay

SPEED_M_S, TURN_RAD_S = 0.1, 0.5
"""Peak of the tool's way (assumed: twice a nudge's; a reach of 0.5 m in 10 s can be watched)."""
LEAST_S = 0.4
BEHIND_M, BEHIND_RAD = 0.02, 0.2
"""A hand so far from where it was led has met something (assumed: as one that goes in, and half of a nod)."""
ROW_M, ROW_RAD = 0.03, 0.15
"""Between two planned postures (assumed)."""


@dataclass(frozen=True)
class CartesianReport:
    """What was felt: force beyond the first [N], distance [m] and angle [rad] that were left."""

    met_n: float
    left_m: float
    left_rad: float


@dataclass(frozen=True)
class Plan:
    """Postures (rows, nq) along the line, and how well the worst serves."""

    path: np.ndarray
    worst: Solution


def cartesian(body: Body, command: Cartesian, rng: np.random.Generator) -> Motion:
    """See ``Cartesian``; data: ``CartesianReport`` once the hand has moved.

    The robot itself is kept clear of; what else is in the way is felt only. A hand that was stopped stays where it is,
    pressing as its leash lets it.
    """
    arm = arm_of(body, command.side)
    goal = pose_target(np.array(command.position), np.asarray(pin.exp3(np.array(command.rotation_rad))))
    plan = _planned(arm, goal)
    why = refusal(plan.worst) or _touches(arm, plan)
    if why:
        return Done("no_plan", why)
    led = Led(arm)
    led.goal = plan.path[-1]
    # The average of the wrist's force is full before it is taken for what the hand felt at the start.
    yield from stay(led, FELT_TICKS * body.tick_s)
    first, guard, met_n = led.force(), guard_n(body), 0.0

    def stopped() -> bool:
        nonlocal met_n
        met_n = max(met_n, float(np.linalg.norm(led.force() - first)))
        return met_n > guard

    met = yield from line(led, goal.position, goal.rotation, _seconds(arm, goal), stopped, settle_s=0.4)
    rotation, position = arm.hand()
    left_m = float(np.linalg.norm(goal.position - position))
    report = CartesianReport(met_n, left_m, angle_between(rotation, goal.rotation))
    there = not met and left_m <= BEHIND_M and report.left_rad <= BEHIND_RAD
    return Done("reached" if there else "blocked", f"{met_n:.0f} N at most, {left_m * 1e3:.0f} mm left", report)


def _planned(arm: Arm, goal: PoseTarget) -> Plan:
    """Postures along the straight line, torso and arm, from where the hand is told to be."""
    now, stance = plan_stance(arm)
    solver = PoseIk(arm.kinematics, arm.side, stance, rest_posture(arm, stance), torso=True)
    rotation, position = arm.hand()
    turn, way = pin.log3(rotation.T @ goal.rotation), goal.position - position
    long = max(float(np.linalg.norm(way)) / ROW_M, float(np.linalg.norm(turn)) / ROW_RAD)
    q, rows, found = now, [now], []
    for share in np.linspace(0.0, 1.0, max(2, math.ceil(long) + 1))[1:]:
        target = pose_target(position + share * way, rotation @ np.asarray(pin.exp3(share * turn)))
        solution = solver.solve(q, target, 30)
        q = solution.q
        rows.append(q)
        found.append(solution)
    return Plan(np.array(rows), max(found, key=lambda each: each.position_error_m + 0.1 * each.axis_error_rad))


def _touches(arm: Arm, plan: Plan) -> str:
    """In words, what of the robot would meet what, or nothing; a robot that touches itself already is let go on."""
    minded = Collisions(arm.robot, ())
    if minded.touching(plan.path[0], 0.0) is not None:
        return ""
    touches = minded.along(list(plan.path), 0.0)
    return "" if touches is None else "no way there: {} would touch {}".format(*touches)


def _seconds(arm: Arm, goal: PoseTarget) -> float:
    rotation, position = arm.hand()
    way_s = float(np.linalg.norm(goal.position - position)) / SPEED_M_S
    turn_s = angle_between(rotation, goal.rotation) / TURN_RAD_S
    return max(LEAST_S, STRETCH * max(way_s, turn_s))
