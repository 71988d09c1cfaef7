"""ViGIR's states one by one, driven by hand; whole machines are in ``tests/machines/test_drc_machines.py``."""

from __future__ import annotations

import math

import pytest

from teleop_sim.channel.messages import FootstepGoal
from teleop_sim.core.errors import UnknownName
from teleop_sim.machines.declare import FELL
from teleop_sim.machines.drc import door_machine, valve_machine
from teleop_sim.robot.commands import Act, Fingers, Grasp, LetGo, Look, PreGrasp, Retreat, Walk
from teleop_sim.robot.commands import Step as Stride
from teleop_sim.robot.programs.pacing import pacing
from teleop_sim.robot.programs.steps import AskData, Memory, Reply, Say, Stepped, Wait
from teleop_sim.robot.programs.template_affordances import default_amount
from teleop_sim.robot.programs.template_work import Instance, Work
from teleop_sim.robot.programs.vigir import BODIES, vigir_programs
from teleop_sim.robot.programs.vigir_sums import CALCULATIONS, DECISIONS
from teleop_sim.robot.programs.vigir_visit import NO_ANSWER_S, PLANNING_S, Goal, Move
from teleop_sim.robot.skills.act import ActReport
from teleop_sim.templates.library import library
from teleop_sim.templates.poses import Pose
from teleop_sim.templates.server import Server

PROGRAMS = vigir_programs(pacing("eager"), "atlas")
PLACE = Pose((0.72, 0.30, 1.016))
SERVER = Server("station").insert(library().named("door").type_id, PLACE)[0]
DOOR = Instance("door", PLACE, "atlas")
VALVE = Instance("DRC_valve", PLACE, "atlas")
OPEN = 1


def visit(program, reads=None, parameters=None, path="State", replies=(), facts=None):
    """What a program yields, its event and what it writes."""
    known = {"templates": lambda: SERVER.placed, "pose": (0.0, 0.0, 0.0)} | (facts or {})
    memory = Memory(known, reads or {}, parameters or {}, path=path)
    running, answer, steps, left = PROGRAMS[program](memory), None, [], list(replies)
    while True:
        try:
            step = running.send(answer)
        except StopIteration as end:
            return steps, end.value, memory.writes
        steps.append(step)
        answer = None if isinstance(step, (Wait, Say, Stepped)) else left.pop(0)


def reply(outcome="reached", data=None):
    return Reply(outcome, outcome, data, 1.0)


def acted(outcome, amount):
    return reply(outcome, ActReport(amount, 0.0, 1.0, 1.0, 0.0, "arm"))


# People


@pytest.mark.parametrize(
    ("answers", "event"),
    [([b"\x00"], "received"), ([b""], "aborted"), ([b"\x07", b"\x00"], "received"), ([b"\x07"] * 3, "data_error")],
)
def test_a_template_is_asked_for_until_one_is_named_that_is_there(answers, event):
    steps, came, writes = visit("InputState", parameters={"request": "SELECTED_OBJECT_ID"}, replies=answers)
    assert came == event
    assert writes == ({"data": 0} if event == "received" else {})
    assert [s for s in steps if isinstance(s, AskData)] == [AskData("SELECTED_OBJECT_ID")] * len(answers)


def test_a_plan_is_taken_as_it_is_or_goes_to_another_goal():
    plan, ask = Walk(((2.0, 0.0, 0.0),)), {"request": "FOOTSTEP_PLAN_HEADER"}
    assert visit("InputState", {}, ask, replies=[b""], facts={"plan": plan})[1:] == ("received", {"data": plan})
    # The same six bytes as the message's body.
    other = FootstepGoal(1.5, -0.25, 0.7).encode()[1:]
    _, event, writes = visit("InputState", {}, ask, replies=[other], facts={"plan": plan})
    assert event == "received"
    assert writes["data"].path[0] == pytest.approx((1.5, -0.25, 0.7), abs=1e-4)
    goal = {"request": "WAYPOINT_GOAL_POSE"}
    assert visit("InputState", {}, goal, replies=[other])[2] == writes
    assert visit("InputState", {}, goal, replies=[b""])[1] == "aborted"
    assert visit("InputState", {}, goal, replies=[b"\x01\x02"])[1] == "data_error"


def test_a_plan_without_steps_is_not_shown():
    here = Walk(((0.02, 0.0, 0.0),))
    steps, event, writes = visit("InputState", {}, {"request": "FOOTSTEP_PLAN_HEADER"}, facts={"plan": here})
    assert (steps, event, writes) == ([], "received", {"data": here})
    assert visit("ExecuteStepPlanActionState", {"plan_header": here})[:2] == ([], "finished")


def test_prompts_say_what_is_wanted():
    (said,), event, _ = visit("LogState", path="Open_Door/Confirm_Closed_Fingers")
    assert said == Say("Confirm_Closed_Fingers: see that the fingers are as they should be")
    assert event == "done"


# Templates


def test_poses_and_affordances_come_from_the_template_that_lies_there():
    keys = {"template_id": 0, "hand_side": "left", "preference": 1}
    assert visit("GetTemplateGraspState", keys)[1:] == ("done", {"grasp": Goal(DOOR, "grasp", 1)})
    assert visit("GetTemplatePregraspState", keys)[2] == {"pre_grasp": Goal(DOOR, "pregrasp", 1)}
    assert visit("GetTemplatePregraspState", keys | {"preference": 9})[1] == "not_available"
    assert visit("GetTemplatePregraspState", keys | {"template_id": 3})[1] == "failed"
    assert visit("GetTemplatePregraspState", keys | {"hand_side": "right"})[1] == "not_available"
    assert visit("GetTemplateStandPoseState", keys | {"preference": 0})[2] == {"stand_pose": DOOR.stand}
    got = visit("GetTemplateAffordanceState", keys, {"identifier": "<by hand side: turnCW | turnCCW>"})
    assert got[1:] == ("done", {"affordance": Move(DOOR, 0, pytest.approx(math.radians(55.0)))})
    assert visit("GetTemplateAffordanceState", keys, {"identifier": "wave"})[1] == "not_available"


# Plans and motions


@pytest.mark.parametrize(
    ("program", "reads", "good"),
    [
        ("PlanEndeffectorPoseState", {"target_pose": Goal(DOOR, "pregrasp")}, "planned"),
        ("PlanEndeffectorCartesianWaypointsState", {"waypoints": (Goal(DOOR, "grasp"),)}, "planned"),
        ("PlanAffordanceState", {"affordance": Move(DOOR, 0, 1.0)}, "done"),
        ("PlanFootstepsState", {"step_goal": (1.0, 0.0, 0.0)}, "planned"),
        ("FootstepPlanRelativeState", {"distance": 0.3}, "planned"),
    ],
)
def test_planning_takes_a_second_and_longer_when_nobody_answers(program, reads, good):
    assert visit(program, reads)[:2] == ([Wait(PLANNING_S, "planning")], good)
    (wait,), event, _ = visit(program, reads, facts={"onboard": lambda: False})
    assert (wait.seconds, event) == (NO_ANSWER_S, "failed")


def test_what_is_planned_is_carried_out_and_told():
    goal = Goal(DOOR, "grasp", straight=True)
    steps, event, _ = visit("ExecuteTrajectoryMsgState", {"joint_trajectory": goal}, replies=[reply(), reply("closed")])
    assert [type(s) for s in steps] == [Grasp, Stepped, Fingers, Stepped]
    assert steps[1] == Stepped("grasp", "reached")
    assert event == "done"
    far = Goal(DOOR, "pregrasp")
    steps, event, _ = visit("ExecuteTrajectoryMsgState", {"joint_trajectory": far}, replies=[reply("no_plan")])
    assert ([type(s) for s in steps], event) == ([PreGrasp, Stepped], "failed")
    assert visit("ExecuteTrajectoryMsgState", {"joint_trajectory": None})[1] == "failed"


def test_a_hand_that_is_in_goes_straight_back():
    goal, facts = Goal(VALVE, "pregrasp", straight=True), {"work": Work(VALVE, "at", True)}
    steps, event, _ = visit("ExecuteTrajectoryMsgState", {"joint_trajectory": goal}, replies=[reply()], facts=facts)
    assert [type(s) for s in steps] == [Retreat, Stepped]
    assert event == "done"


@pytest.mark.parametrize(
    ("outcome", "event"),
    [
        ("reached", "done"),
        ("force_limit", "done"),
        ("no_motion", "done"),
        ("grip_lost", "failed"),
        ("timed_out", "failed"),
    ],
)
def test_a_motion_is_done_that_went_as_far_as_the_thing_let_it(outcome, event):
    move, facts = {"joint_trajectory": Move(DOOR, 0, 0.96)}, {"work": Work(DOOR, "at", True)}
    steps, came, _ = visit("ExecuteTrajectoryMsgState", move, replies=[acted(outcome, 0.5)], facts=facts)
    assert isinstance(steps[0], Act)
    assert steps[1] == Stepped("affordance", outcome, 0.5)
    assert came == event


def test_a_wheel_that_turned_before_the_rod_slipped_out_is_left_to_a_person():
    move, facts = {"joint_trajectory": Move(VALVE, OPEN, 1.0)}, {"work": Work(VALVE, "at", True)}
    ways = [acted("grip_lost", 0.6), reply("released"), reply(), reply("blocked"), *[reply(), reply("blocked")] * 2]
    steps, event, _ = visit("ExecuteTrajectoryMsgState", move, replies=ways, facts=facts)
    assert (steps[-1], event) == (Stepped("affordance", "blocked", 0.6), "done")


def test_turning_a_rod_back_needs_no_motion():
    close = Move(VALVE, 0, 3.5)
    _, event, writes = visit("PlanAffordanceState", {"affordance": close})
    assert (event, writes["plan_fraction"]) == ("incomplete", 0.0)
    steps, event, _ = visit("ExecuteTrajectoryMsgState", {"joint_trajectory": close})
    assert (steps, event) == ([Stepped("affordance", "reached", 0.0)], "done")


def test_a_fall_is_a_fall():
    goal = {"joint_trajectory": Goal(DOOR, "pregrasp")}
    assert visit("ExecuteTrajectoryMsgState", goal, replies=[reply("fell")])[1] == FELL


def test_a_hand_at_the_lever_comes_off_before_torso_or_feet_move():
    facts = {"work": Work(DOOR, "at", True)}
    side = visit("MoveitPredefinedPoseState", {"side": "left"}, {"target_pose": "TURN_TORSO_FULL"}, "S",
                 [reply("released"), reply()], dict(facts))  # fmt: skip
    assert ([type(s).__name__ for s in side[0]], side[1]) == (["LetGo", "Posture"], "done")
    plan = {"plan_header": Stride(-0.3)}
    steps, event, _ = visit("ExecuteStepPlanActionState", plan, replies=[reply("released"), reply()], facts=dict(facts))
    assert ([type(s) for s in steps], event) == ([LetGo, Stride, Stepped], "finished")
    unknown = visit("MoveitPredefinedPoseState", {}, {"target_pose": "HEADSTAND"})
    assert unknown[:2] == ([], "failed")


def test_heads_and_modes():
    assert visit("TiltHeadState", {}, {"desired_tilt": "DOWN_45"}, replies=[reply()])[0] == [Look(math.pi / 4)]
    assert visit("LookAtTargetState", {"frame": None}, replies=[reply()])[0] == [Look(0.0)]
    assert visit("ChangeControlModeActionState")[1] == "changed"
    assert visit("CheckCurrentControlModeState", {}, {"target_mode": "STAND"})[1:] == (
        "correct",
        {"control_mode": "STAND"},
    )
    pose = {"pose_in": (1.5, 0.0, 0.0)}
    out = visit("GetPoseInFrameState", pose, facts={"pose": (1.0, 2.0, math.pi / 2)})[2]["pose_out"]
    assert out == pytest.approx((1.0, 3.5, math.pi / 2))


# The small functions


@pytest.mark.parametrize(
    ("path", "value", "result"),
    [
        ("Increase_Preference_Index", 0, 1),
        ("A/Convert_Waypoints", "pose", ("pose",)),
        ("Set_Rotation", Move(VALVE, OPEN, 1.0), Move(VALVE, OPEN, math.radians(400.0))),
        ("Set_Full_Rotation", Move(VALVE, OPEN, 1.0), Move(VALVE, OPEN, math.radians(200.0))),
        ("Set_Test_Rotation", Move(VALVE, OPEN, 1.0), Move(VALVE, OPEN, math.radians(25.0))),
        ("Calc_Pushing_Side", "left", "right"),
        ("Generate_Traversing_Waypoint", 1.5, (1.5, 0.0, 0.0)),
    ],
)
def test_calculations(path, value, result):
    assert visit("CalculationState", {"input_value": value}, path=path)[1:] == ("done", {"output_value": result})


@pytest.mark.parametrize(
    ("path", "value", "event"),
    [
        ("Decide_Request_Template", None, "request"),
        ("Decide_Request_Template", 0, "continue"),
        ("Prepare/Replan_if_Incomplete", 0.89, "replan"),
        ("Prepare/Replan_if_Incomplete", 0.9, "continue"),
        ("Open_Door/Place_Handle_Hand/Decide_If_Open", 0, "open"),
        ("Open_Door/Release_Handle/Decide_If_Open", 1, "retract"),
        ("Decide_Turn_Direction", -0.7, "down"),
        ("Decide_Turn_Further", 0.96, "turn_again"),
        ("Decide_If_Test", 0, "test"),
        ("Decide_If_Test", 0.1, "full"),
    ],
)
def test_decisions(path, value, event):
    assert visit("DecisionState", {"input_value": value}, path=path)[1] == event


def test_what_an_arm_has_turned_counts_not_what_was_planned():
    keys = {"back_rotation": 0.5, "plan_fraction": 1.0}
    added = visit("FlexibleCalculationState", keys, path="Accumulate_Rotation", facts={"went": 0.25})
    assert added[2] == {"output_value": 0.75}
    scaled = {"affordance": Move(DOOR, 1, 0.96), "fraction": -0.5}
    assert visit("FlexibleCalculationState", scaled, path="Reduce_Affordance_Displacement")[2] == {
        "output_value": Move(DOOR, 1, 0.48)
    }


def test_every_small_function_of_the_four_machines_is_there():
    for made in (door_machine, valve_machine):
        for robot in ("atlas", "thormang3"):
            whole = made(robot)
            for path in whole.state_names:
                leaf = whole.leaf(path)
                table = {"CalculationState": CALCULATIONS, "DecisionState": DECISIONS}.get(leaf.program, {})
                names = (leaf.name, "/".join(path.split("/")[-2:]))
                assert not table or any(name in table for name in names), path
    with pytest.raises(UnknownName, match="Increase_Preference_Index"):
        visit("CalculationState", {"input_value": 0}, path="Increase_Preference")


def test_default_amounts_are_what_the_studies_used():
    push = library().named("door").affordance("push")
    assert default_amount("thormang3+claw", "door", push) < default_amount("atlas", "door", push)
    assert set(BODIES) == set(PROGRAMS)
    with pytest.raises(UnknownName, match="thormang3"):
        vigir_programs(pacing("eager"), "valkyrie")
