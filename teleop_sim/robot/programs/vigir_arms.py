"""ViGIR's states about templates, arms and fingers, by FlexBE class.

What a plan holds is what is to be done; whether there is a way turns out when it is carried out, because planning is
part of the robot's skills. So an arm that cannot go there ends in the executing state's ``failed``, and of the planning
states' failures only that the planner does not answer is left. A motion is ``done`` that went as far as the thing let
it; one that met something, lost the thing or has no way is ``failed``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Literal

from teleop_sim.robot.hands import base_name
from teleop_sim.robot.predefined import predefined
from teleop_sim.robot.programs import template_hands as hands
from teleop_sim.robot.programs.steps import Program
from teleop_sim.robot.programs.template_affordances import LEAST_RAD, affordance, default_amount
from teleop_sim.robot.programs.template_work import VALVE, Instance, StepProgram, affordance_id, do, work_of
from teleop_sim.robot.programs.vigir_visit import Body, Goal, Move, Visit, planned, stepped
from teleop_sim.templates.library import library

HAND_TYPES: Mapping[str, str] = MappingProxyType({"atlas": "robotiq", "thormang3": "vt_hand"})
"""Hands that the published grasps are for."""
DONE = ("reached", "force_limit", "no_motion")
OPENING = 0.5
"""Configuration of the fingers, 0 open and 1 closed, from which on the hand is shut (assumed)."""


# Templates


def get_pose(kind: Literal["grasp", "pregrasp"], key: str) -> Body:
    """A (pre-)grasp of the template, written to a key."""

    def body(visit: Visit) -> Program:
        yield from ()
        at, preference = visit.instance(visit.read("template_id")), int(visit.read("preference") or 0)
        if at is None:
            return "failed"
        if at.refusal() or preference >= _grasps(at):
            return "not_available"
        visit.write(key, Goal(at, kind, preference))
        return "done"

    return body


def _grasps(at: Instance) -> int:
    """Grasps in the library for this robot's published hand. Ours takes a lever in one way, a wheel in the next gap."""
    kind = HAND_TYPES.get(base_name(at.robot), "cage")
    return len(library().named(at.template).grasps_of(kind, at.side))


def get_affordance(visit: Visit) -> Program:
    """An affordance of the template, by name."""
    yield from ()
    at = visit.instance(visit.read("template_id"))
    if at is None:
        return "failed"
    which = None if at.refusal() else affordance_id(at.template, visit.parameter("identifier"))
    known = None if which is None else at.affordance(which)
    if which is None or known is None:
        return "not_available"
    visit.write("affordance", Move(at, which, default_amount(at.robot, at.template, known)))
    return "done"


# Plans


def plan_pose(visit: Visit) -> Program:
    """A way to a pose, round what the world model holds."""
    goal = visit.read("target_pose")
    if not isinstance(goal, Goal) or not (yield from planned(visit)):
        return "failed"
    visit.write("joint_trajectory", goal)
    return "planned"


def plan_line(visit: Visit) -> Program:
    """A straight way along way-points."""
    waypoints = visit.read("waypoints")
    goal = waypoints[-1] if isinstance(waypoints, tuple) and waypoints else None
    visit.write("plan_fraction", 0.0)
    if not isinstance(goal, Goal) or not (yield from planned(visit)):
        return "failed"
    visit.write("joint_trajectory", replace(goal, straight=True))
    visit.write("plan_fraction", 1.0)
    return "planned"


def plan_affordance(visit: Visit) -> Program:
    """An affordance; one that needs no motion (``template_affordances``: turning a rod back) is planned by nothing."""
    move = visit.read("affordance")
    visit.write("plan_fraction", 0.0)
    if not isinstance(move, Move) or not (yield from planned(visit)):
        return "failed"
    visit.write("joint_trajectory", move)
    if _idle(visit, move):
        return "incomplete"
    visit.write("plan_fraction", 1.0)
    return "done"


def _idle(visit: Visit, move: Move) -> bool:
    known = move.at.affordance(move.which)
    closing = known is not None and known.name == "close"
    return move.at.template == VALVE and closing and work_of(visit.memory, move.at).hand != "at"


# Motions


def execute(visit: Visit) -> Program:
    """Carry out what was planned."""
    planned_now = visit.read("joint_trajectory")
    if isinstance(planned_now, Move):
        return (yield from _affordance(visit, planned_now))
    if not isinstance(planned_now, Goal):
        return "failed"
    at, kind = planned_now.at, planned_now.kind
    end = yield from stepped(kind, (yield from _arm(visit, planned_now)))
    if end.outcome != "reached":
        return "failed"
    if kind == "grasp" and not at.rod and work_of(visit.memory, at).hand == "at":
        # Fingers belong to the grasp: a cage holds a lever only when it is shut (Atlas' machine has no state for it).
        yield from stepped("close", (yield from hands.fingers(visit.memory, at, True)))
    return "done"


def _arm(visit: Visit, goal: Goal) -> StepProgram:
    memory, at = visit.memory, goal.at
    back = goal.straight and work_of(memory, at).hand == "at"
    if back and (goal.kind == "pregrasp" or "Hand_Back" in memory.path):
        return (yield from hands.retreat(memory, at))
    if goal.kind == "pregrasp":
        return (yield from hands.pregrasp(memory, at, goal.preference))
    return (yield from hands.grasp(memory, at))


def _affordance(visit: Visit, move: Move) -> Program:
    end = yield from stepped("affordance", (yield from affordance(visit.memory, move.at, move.which, move.amount)))
    visit.memory.facts["went"] = end.amount / move.amount if move.amount else 0.0
    # A wheel that has turned before something went wrong has turned: whether far enough is asked next.
    turned = move.at.template == VALVE and end.amount > LEAST_RAD
    return "done" if end.outcome in DONE or turned else "failed"


def move_fingers(visit: Visit) -> Program:
    """Open or close the hand."""
    close = float(visit.parameter("configuration") or 0.0) >= OPENING
    work = visit.memory.facts.get("work")
    if work is None:
        return "failed"
    yield from stepped("close" if close else "open", (yield from hands.fingers(visit.memory, work.at, close)))
    return "done"


def posture(visit: Visit) -> Program:
    """A posture of the robot's library, if it has it for that side; a hand that is at something comes off it first."""
    command = predefined(visit.robot, visit.parameter("target_pose"), visit.side)
    if command is None:
        return "failed"
    yield from hands.free(visit.memory)
    yield from do(command)
    return "done"
