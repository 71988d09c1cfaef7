"""ViGIR's states about what people answer, footsteps, the head and control modes, by FlexBE class.

What an answer's bytes are: of ``SELECTED_OBJECT_ID`` the number of the template, one byte; of ``FOOTSTEP_PLAN_HEADER``
nothing, which takes the plan as it is, or another goal; of ``WAYPOINT_GOAL_POSE`` a goal. A goal is six bytes: x and y
in steps of 5 mm and yaw in steps of pi/32767, each 16 bits, big-endian, as in the message ``footstep_goal``.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Generator, Mapping
from types import MappingProxyType
from typing import Any

from teleop_sim.robot.commands import Look, PlanarPose, Walk
from teleop_sim.robot.commands import Step as Stride
from teleop_sim.robot.programs import template_hands as hands
from teleop_sim.robot.programs.places import after
from teleop_sim.robot.programs.steps import AskData, Program, Say, Step, Wait
from teleop_sim.robot.programs.template_work import StepOutcome, do, near, told, way_to
from teleop_sim.robot.programs.vigir_visit import Visit, planned, stepped
from teleop_sim.templates.library import library

MODE_S = 1.0
"""For a change of the control mode (assumed)."""
ASKS = 3
"""Answers that name no template before it is a data error (assumed)."""
DOWN_RAD = math.radians(45.0)
TILTS: Mapping[str, float] = MappingProxyType({"DOWN_45": DOWN_RAD, "STRAIGHT": 0.0})
GROUND_M, TURN_RAD = 0.005, math.pi / 32767
_GOAL = struct.Struct(">hhh")


# People


def ask(visit: Visit) -> Program:
    """Ask the operator for a template, a look at the footsteps, or a goal."""
    request = visit.parameter("request")
    if request == "SELECTED_OBJECT_ID":
        return (yield from _ask_template(visit, request))
    plan: Walk | None = visit.memory.facts.get("plan")
    if request == "FOOTSTEP_PLAN_HEADER" and (plan is None or there(visit, plan)):
        # A plan without steps needs no look.
        visit.write("data", plan)
        return "received"
    data: bytes = yield AskData(request)
    if not data and request == "FOOTSTEP_PLAN_HEADER":
        visit.write("data", plan)
        return "received"
    if not data:
        return "aborted"
    if len(data) != _GOAL.size:
        return "data_error"
    visit.write("data", Walk((goal_of(data),)))
    return "received"


def _ask_template(visit: Visit, request: str) -> Program:
    for _ in range(ASKS):
        data: bytes = yield AskData(request)
        if not data:
            return "aborted"
        if len(data) == 1 and visit.instance(data[0]) is not None:
            visit.write("data", data[0])
            return "received"
        yield Say(f"{visit.state}: there is no template {data[0]} here")
    return "data_error"


def goal_of(data: bytes) -> PlanarPose:
    """A goal from six bytes."""
    x, y, yaw = _GOAL.unpack(data)
    return x * GROUND_M, y * GROUND_M, yaw * TURN_RAD


PROMPTS: Mapping[str, str] = MappingProxyType(
    {
        "Optional_Template_Adjustment": "adjust the template if it does not fit",
        "Confirm_Closed_Fingers": "see that the fingers are as they should be",
        "Request_Hand_Adjustment": "adjust the hand if it would not slide in",
        "Request_Stick_Adjustment": "adjust the hand if it is not in between the spokes",
        "Adjust_Hand_Pose": "adjust the hand if it is not in between the spokes",
        "Align_Door_Log": "align the template with the door",
        "Align_Valve_Log": "align the template with the valve",
        "Open_Door_Manually": "open the door by hand",
        "Turn_Valve_Manually": "turn the valve by hand",
        "Check_Hand_Space": "see that the second hand has room",
        "Log_Remove_Hand": "take the hand off the handle",
        "Wait_For_Gather_Data": "look at the door before the robot goes on",
    }
)
"""What a person is told in a state; of others their name says it. The texts are ours: the originals are not published
with the machines."""


def log(visit: Visit) -> Program:
    """A line to the operators."""
    yield Say(f"{visit.state}: {PROMPTS.get(visit.state, visit.state.replace('_', ' ').lower())}")
    return "done"


# Feet


def get_stand(visit: Visit) -> Program:
    """Where to stand for the template. All of its stands are the one that our robots were measured at."""
    yield from ()
    at, preference = visit.instance(visit.read("template_id")), int(visit.read("preference") or 0)
    if at is None:
        return "failed"
    robot = at.robot.partition("+")[0]
    stands = [s for s in library().named(at.template).stands if (s.robot, s.side) == (robot, at.side)]
    if at.refusal() or preference >= len(stands):
        return "not_available"
    visit.write("stand_pose", at.stand)
    return "done"


def step_goal(visit: Visit) -> Program:
    """A goal for the feet from a pose: here both are the same."""
    yield from ()
    goal = visit.read("target_pose")
    if goal is None:
        return "failed"
    visit.write("step_goal", goal)
    return "done"


def plan_steps(visit: Visit) -> Program:
    """Footsteps to a goal: what is stored is the goal, the steps are planned when they are walked."""
    goal: PlanarPose | None = visit.read("step_goal")
    if goal is None or not (yield from planned(visit)):
        return "failed"
    plan = visit.memory.facts["plan"] = Walk((goal,))
    visit.write("plan_header", plan)
    return "planned"


def plan_relative(visit: Visit) -> Program:
    """A few steps forwards, backwards or sideways."""
    distance_m = abs(float(visit.read("distance") or 0.0))
    ahead, left = {
        "DIRECTION_FORWARD": (1.0, 0.0),
        "DIRECTION_BACKWARD": (-1.0, 0.0),
        "DIRECTION_LEFT": (0.0, 1.0),
        "DIRECTION_RIGHT": (0.0, -1.0),
    }.get(visit.parameter("direction"), (0.0, 0.0))
    if not (yield from planned(visit)):
        return "failed"
    visit.write("plan_header", Stride(ahead * distance_m, left * distance_m))
    return "planned"


def walk(visit: Visit) -> Program:
    """Walk what was planned; a robot that stands there already has walked."""
    plan = visit.read("plan_header")
    if isinstance(plan, Walk) and there(visit, plan):
        return "finished"
    if isinstance(plan, Walk):
        plan = way_to(visit.here, plan.path[-1])
    if not isinstance(plan, (Walk, Stride)):
        return "failed"
    yield from hands.free(visit.memory)
    end: StepOutcome = yield from _walked(visit, plan)
    return "finished" if end.outcome == "reached" else "failed"


def _walked(visit: Visit, plan: Walk | Stride) -> Generator[Step, Any, StepOutcome]:
    before = visit.memory.facts.get("pose")
    end = told((yield from do(plan)))
    if end.outcome == "reached" and visit.memory.facts.get("pose") is before:
        # Nobody measured the feet: go by the goal.
        goal = plan.path[-1] if isinstance(plan, Walk) else after(visit.here, plan)
        visit.memory.facts["pose"] = goal
    return (yield from stepped("stand", end))


def there(visit: Visit, plan: Walk) -> bool:
    """Does the robot stand at the goal?"""
    return near(visit.here, plan.path[-1])


def pose_in_frame(visit: Visit) -> Program:
    """A pose before the pelvis as one of the odometry frame."""
    yield from ()
    pose: PlanarPose | None = visit.read("pose_in")
    if pose is None:
        return "failed"
    visit.write("pose_out", after(visit.here, Stride(*pose)))
    return "done"


# Head and modes


def tilt(visit: Visit) -> Program:
    """Tilt the head."""
    yield from do(Look(TILTS.get(visit.parameter("desired_tilt"), 0.0)))
    return "done"


def look_at(visit: Visit) -> Program:
    """Look at a template, or straight on: the things worked on are an arm's length ahead, below the eyes."""
    yield from do(Look(0.0 if visit.read("frame") is None else DOWN_RAD))
    return "done"


def change_mode(visit: Visit) -> Program:
    """Change the control mode: here one controller does everything, and only the time is spent."""
    del visit
    yield Wait(MODE_S, "control mode")
    return "changed"


def check_mode(visit: Visit) -> Program:
    """The mode is as wanted: a robot that has walked stands."""
    yield from ()
    visit.write("control_mode", visit.parameter("target_mode"))
    return "correct"
