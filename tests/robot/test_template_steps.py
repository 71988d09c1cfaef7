"""The steps of the template workflow, driven by hand: what they yield, what they make of the replies."""

from __future__ import annotations

import math
from typing import get_args

import numpy as np
import pytest

from teleop_sim.channel import manipulation_messages as told
from teleop_sim.robot.affordance import moved
from teleop_sim.robot.commands import Act, Fingers, Grasp, LetGo, Posture, PreGrasp, Retreat, Step, Walk
from teleop_sim.robot.drc_plans import Template, drc_stand, gap_handle, lever_handle, opened
from teleop_sim.robot.programs.steps import Memory, Reply, StepName, StepResult
from teleop_sim.robot.programs.template_affordances import GRIPS, PUSH_RAD, TURN_RAD
from teleop_sim.robot.programs.template_steps import Instance, StepOutcome, hand_moved, instance_of, step_program
from teleop_sim.robot.programs.template_work import work_of
from teleop_sim.robot.skills.act import ActReport
from teleop_sim.templates.library import library
from teleop_sim.templates.poses import Pose, pose_of, rotation
from teleop_sim.templates.server import Server
from teleop_sim.world import door, valve

DOOR = Instance("door", Pose((0.72, 0.30, 1.016)), "atlas")
VALVE = Instance("DRC_valve", Pose((0.80, 0.30, 1.016)), "atlas")
TURN_CW, TURN_CCW, PUSH, UP = 0, 1, 2, 5
CLOSE, OPEN, INSERT, EXTRACT = 0, 1, 2, 3
ARM_M = math.hypot(door.HINGE[0], door.HINGE[1])
GOOD = {LetGo: "released"}


def acted(outcome, amount, reach=0.0):
    return Reply(outcome, outcome, ActReport(amount, reach, 1.0, 1.0, 0.0, "arm"), 1.0)


def good(command):
    if isinstance(command, Act):
        return acted("reached", command.amount)
    if isinstance(command, Fingers):
        return Reply("closed" if command.close else "opened", "", None, 1.0)
    return Reply(GOOD.get(type(command), "reached"), "", None, 1.0)


def drive(name, at, memory, which=0, amount=0.0, robot=good):
    """Commands of a step, and what came of it; ``robot`` replies, or a list of replies does."""
    program, answer, commands = step_program(name, at, which, amount, memory), None, []
    replies = iter(robot) if isinstance(robot, list) else None
    while True:
        try:
            command = program.send(answer)
        except StopIteration as end:
            return commands, end.value
        commands.append(command)
        answer = robot(command) if replies is None else next(replies)


def holding(at=DOOR):
    memory = Memory()
    for name in ("pregrasp", "open", "grasp", "close"):
        if at.template == "door" or name in ("pregrasp", "grasp"):
            drive(name, at, memory)
    return memory


def test_steps_and_outcomes_are_those_that_the_link_can_tell():
    assert get_args(StepName) == told.STEPS
    assert get_args(StepResult) == told.OUTCOMES


# Geometry


@pytest.mark.parametrize("yaw", [-2.5, 0.0, 0.4])
@pytest.mark.parametrize("spoke", [-1.2, 0.0, 0.3, 2.0])
def test_yaw_and_roll_of_a_valve_say_how_its_spokes_stand(yaw, spoke):
    # On the wheel: angles count from up, anticlockwise as the robot sees them.
    place = Template((1.0, 2.0, 1.0), yaw)
    end = place.point(valve.on_wheel(spoke, 0.18))
    turn = rotation((0.0, 0.0, yaw)) @ rotation((-spoke, 0.0, 0.0))
    at = Instance("DRC_valve", pose_of(np.array(place.place), turn), "atlas")
    assert at.place.yaw_rad == pytest.approx(yaw)
    assert at.spoke_rad == pytest.approx(spoke)
    # The library's first spoke goes up from the wheel's centre.
    spoke_end = at.pose.place(np.array([0.0, 0.0, 0.18]))
    assert spoke_end == pytest.approx(np.array(end))


def test_the_stand_is_where_the_thing_has_its_measured_place_before_the_feet():
    for yaw in (0.0, 1.0):
        at = Instance("door", Pose((3.0, 1.0, 1.016), (0.0, 0.0, yaw)), "thormang3+claw")
        x, y, heading = at.stand
        ahead, left = drc_stand("thormang3").door
        c, s = math.cos(heading), math.sin(heading)
        assert (x + c * ahead - s * left, y + s * ahead + c * left) == (pytest.approx(3.0), pytest.approx(1.0))
        assert heading == pytest.approx(yaw)


def test_what_lies_there_is_read_off_the_template_server():
    server, entry = Server("station").insert(library().named("door").type_id, Pose((1.0, 0.0, 1.0)))
    assert server.placed == (entry,)
    assert instance_of(entry, "atlas") == Instance("door", Pose((1.0, 0.0, 1.0)), "atlas", "left")


# A hand and a lever


def test_a_lever_is_turned_pushed_with_let_up_and_let_go():
    memory = Memory({"world": ((0.1, 0.2, 0.3),)})
    before, _ = drive("pregrasp", DOOR, memory)
    assert before == [PreGrasp("left", lever_handle(DOOR.place), False, ((0.1, 0.2, 0.3),))]
    assert drive("open", DOOR, memory)[0] == [Fingers("left", False)]
    assert drive("grasp", DOOR, memory)[0] == [Grasp("left", lever_handle(DOOR.place), False)]
    assert drive("close", DOOR, memory)[0] == [Fingers("left", True)]
    (turn,), end = drive("affordance", DOOR, memory, TURN_CW)
    assert (turn.amount, turn.rigid, turn.give_way_n) == (TURN_RAD, True, 15.0)
    assert end == StepOutcome("reached", TURN_RAD, "reached")
    (push,), end = drive("affordance", DOOR, memory, PUSH)
    assert push.amount == pytest.approx(PUSH_RAD["atlas"])
    assert end.amount == pytest.approx(PUSH_RAD["atlas"] * ARM_M), "in metres, as the library counts a push"
    commands, end = drive("release", DOOR, memory)
    assert [type(c) for c in commands] == [Act, LetGo]
    assert commands[0].amount == -TURN_RAD
    # The lever's axis has gone along with the door.
    assert commands[0].affordance.origin == opened(DOOR.place, PUSH_RAD["atlas"]).place
    assert end.outcome == "released"
    assert work_of(memory, DOOR).hand == "home"


def test_the_hand_that_pushes_goes_on_the_levers_circle_about_the_hinges():
    memory = holding()
    (push,), _ = drive("affordance", DOOR, memory, PUSH, amount=0.05)
    start = np.array(DOOR.place.place)
    end = moved(push.affordance, push.amount, start)
    assert np.linalg.norm(end - start) == pytest.approx(0.05, rel=1e-3)
    assert end[0] > start[0]


def test_a_lever_comes_up_no_further_than_it_was_turned():
    memory = holding()
    drive("affordance", DOOR, memory, TURN_CW, robot=[acted("force_limit", 0.6)])
    (up,), end = drive("affordance", DOOR, memory, TURN_CCW)
    assert up.amount == -0.6
    assert end.amount == pytest.approx(0.6), "in the affordance's own sense"
    assert drive("release", DOOR, memory)[0] == [LetGo("left", False)]


def test_a_push_beyond_the_arms_reach_goes_nearly_as_far_as_it_can():
    commands, end = drive(
        "affordance", DOOR, holding(), PUSH, robot=[acted("no_plan", 0.0, 0.2), acted("reached", 0.19)]
    )
    assert [c.amount for c in commands] == [pytest.approx(PUSH_RAD["atlas"]), pytest.approx(0.19)]
    assert end.amount == pytest.approx(0.19 * ARM_M)


def test_a_hand_that_loses_the_lever_holds_nothing():
    memory = holding()
    drive("affordance", DOOR, memory, TURN_CW)
    _, end = drive("affordance", DOOR, memory, PUSH, robot=[acted("grip_lost", 0.05)])
    assert end.outcome == "grip_lost"
    assert (work_of(memory, DOOR).hand, work_of(memory, DOOR).lever_rad) == ("astray", 0.0)
    assert [type(c) for c in drive("pregrasp", DOOR, memory)[0]] == [PreGrasp]


def test_a_hand_at_the_lever_comes_back_before_it_goes_to_it_anew():
    memory = holding()
    drive("affordance", DOOR, memory, TURN_CW)
    commands, _ = drive("pregrasp", DOOR, memory)
    assert [type(c) for c in commands] == [Act, Fingers, Retreat, PreGrasp]
    again = [type(c) for c in drive("grasp", DOOR, holding())[0]]
    assert again == [Fingers, Retreat, PreGrasp, Grasp]


def test_a_template_that_is_laid_anew_says_where_the_thing_is():
    memory = holding()
    drive("affordance", DOOR, memory, PUSH)
    assert work_of(memory, DOOR).opened_rad > 0.3
    moved_to = Instance("door", Pose((0.73, 0.30, 1.016)), "atlas")
    assert work_of(memory, moved_to).opened_rad == 0.0
    assert work_of(memory, moved_to).hand == "at"


def test_a_hand_that_a_person_has_led_to_the_lever_can_close_and_turn_it():
    memory = Memory()
    hand_moved(memory)
    drive("close", DOOR, memory)
    commands, end = drive("affordance", DOOR, memory, TURN_CW)
    assert len(commands) == 1
    assert end.outcome == "reached"


# A rod and a wheel


def test_a_rod_that_meets_spokes_tries_three_gaps():
    memory = Memory()
    drive("pregrasp", VALVE, memory)
    blocked = Reply("blocked", "a spoke", None, 1.0)
    commands, end = drive("grasp", VALVE, memory, robot=lambda c: blocked if isinstance(c, Grasp) else good(c))
    assert [type(c) for c in commands] == [Grasp, PreGrasp, Grasp, PreGrasp, Grasp]
    assert len({c.handle.centre for c in commands}) == 3
    assert end.outcome == "blocked"
    assert all(c.shut for c in commands)


def test_a_wheel_is_turned_by_strokes_with_new_grips():
    memory = holding(VALVE)
    whole = math.radians(370.0)
    replies = {"n": 0}

    def robot(command):
        if isinstance(command, Act):
            replies["n"] += 1
            return acted("no_plan", 0.0, 3.0) if command.amount > 3.0 else acted("reached", command.amount)
        return good(command)

    commands, end = drive("affordance", VALVE, memory, OPEN, robot=robot)
    went = [c.amount for c in commands if isinstance(c, Act) and c.amount <= 3.0]
    assert went == [pytest.approx(2.85), pytest.approx(2.85), pytest.approx(whole - 5.7)]
    assert [type(c) for c in commands if not isinstance(c, Act)] == [LetGo, PreGrasp, Grasp] * (GRIPS - 1)
    assert end == StepOutcome("reached", pytest.approx(whole), "reached")
    # The rod goes in where the spokes are now.
    grasps = [c for c in commands if isinstance(c, Grasp)]
    assert grasps[0].handle.centre == pytest.approx(gap_handle(VALVE.place, 2.85, drc_stand("atlas")).centre)


def test_a_rod_that_has_not_touched_yet_goes_on():
    commands, end = drive(
        "affordance", VALVE, holding(VALVE), OPEN, 1.0, robot=[acted("grip_lost", 0.3), acted("reached", 1.0)]
    )
    assert len(commands) == 2
    assert end.amount == 1.0


def test_what_stops_a_wheel_is_told_with_how_far_it_went():
    robot = [acted("no_motion", 1.0), *[good(c) for c in (LetGo("left"), None, None)], acted("no_motion", 0.5)]
    robot += [*[good(c) for c in (LetGo("left"), None, None)], acted("no_motion", 0.1)]
    _, end = drive("affordance", VALVE, holding(VALVE), OPEN, robot=robot)
    assert (end.outcome, end.amount) == ("no_motion", pytest.approx(1.6))


def test_closing_a_wheel_without_a_rod_in_it_moves_nothing():
    memory = Memory()
    drive("pregrasp", VALVE, memory)
    assert drive("affordance", VALVE, memory, CLOSE) == ([], StepOutcome("reached", 0.0, _any(memory)))


def _any(memory):
    return drive("affordance", VALVE, memory, CLOSE)[1].cause


def test_inserting_and_extracting_are_ways_in_and_back():
    memory = Memory()
    drive("pregrasp", VALVE, memory)
    assert [type(c) for c in drive("affordance", VALVE, memory, INSERT)[0]] == [Grasp]
    (back,), _ = drive("affordance", VALVE, memory, EXTRACT)
    assert back == Retreat("left", back.handle, 0.05)


# Feet, home, refusals


def test_feet_move_only_with_the_hand_at_home():
    far = Instance("door", Pose((2.72, 0.30, 1.016)), "atlas")
    assert drive("stand", far, Memory())[0] == [Walk((far.stand,))]
    near = Instance("door", Pose((1.02, 0.30, 1.016)), "atlas")
    (steps,), _ = drive("stand", near, Memory())
    assert steps == Step(pytest.approx(0.3), pytest.approx(0.0), pytest.approx(0.0))
    assert drive("stand", DOOR, Memory()) == ([], StepOutcome("reached", 0.0, "it stands there already"))
    memory = holding()
    assert [type(c) for c in drive("stand", far, memory)[0]] == [LetGo, Walk]


def test_home_is_where_arms_are_for_walking():
    assert drive("home", DOOR, Memory())[0] == [Posture("walk")]
    assert drive("home", DOOR, holding())[0] == [LetGo("left", False)]


def test_what_nobody_knows_how_to_do_is_refused():
    assert drive("pregrasp", Instance("DRC_drill", Pose(), "atlas"), Memory())[1].outcome == "refused"
    assert drive("pregrasp", Instance("door", Pose(), "atlas", "right"), Memory())[1].outcome == "refused"
    assert drive("affordance", DOOR, holding(), 77)[1].outcome == "refused"
    assert drive("attach", DOOR, holding())[1].outcome == "refused"
    assert drive("affordance", DOOR, Memory(), TURN_CW)[1] == StepOutcome("no_plan", 0.0, "the hand is at home")


def test_a_fall_ends_a_step():
    _, end = drive("affordance", VALVE, holding(VALVE), OPEN, robot=[Reply("fell", "slid", None, 1.0)])
    assert end == StepOutcome("fell", 0.0, "slid")


def test_other_affordances_are_lines_as_published():
    (line,), end = drive("affordance", DOOR, holding(), UP)
    assert (line.affordance.kind, line.affordance.axis, line.amount) == ("linear", (0.0, 0.0, 1.0), 0.05)
    assert end.amount == 0.05
