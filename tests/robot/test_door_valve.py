"""What a hand does with a lever and a wheel in the physics, and the plans for it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from teleop_sim.core.errors import UnknownName
from teleop_sim.robot.affordance import Usability, moved
from teleop_sim.robot.affordance_table import Way, motion_table
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Act, Command, LetGo, Take
from teleop_sim.robot.drc_plans import (
    DRC_STANDS,
    LEAD_RAD,
    RHO_LEVER_M,
    Template,
    door_swing,
    drc_stand,
    gap_handle,
    lever_handle,
    lever_turn,
    opened,
    wheel_turn,
)
from teleop_sim.robot.episode import Episode, NoiseKey, perform
from teleop_sim.robot.hands import robot_of
from teleop_sim.robot.kinematics import kinematics_of
from teleop_sim.robot.pose_ik import PoseTarget
from teleop_sim.robot.skills.manipulate import arm_of, plan_stance, rest_posture
from teleop_sim.world import door, valve
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.door import Door, lever_rad, opened_rad
from teleop_sim.world.plant import Plant, Scenery
from teleop_sim.world.valve import Valve, turned_rad

TOOL = Usability("bars", (0.0, 0.0, 0.0))
AT = Template((0.7, 0.2, 1.0), 0.3)


class Robot:
    """A robot before a thing, and commands one after the other."""

    def __init__(self, name: str, scene: Scenery) -> None:
        spec = robot_of(name, "claw")
        self.body = Body(spec, Plant(spec.model, scene))
        self.state = self.body.standing()
        self.count = 0

    def do(self, command: Command) -> Episode:
        self.count += 1
        episode = perform(self.body, command, self.state, NoiseKey(1, 0, self.count))
        self.state = episode.end
        self.body.load(self.state)
        return episode


# Plans ---------------------------------------------------------------------------------------------------------------


def test_the_lever_goes_down_and_the_door_away():
    lever = np.array(lever_handle(AT).centre)
    down = moved(lever_turn(AT), math.radians(40.0), lever) - lever
    assert down[2] == pytest.approx(-RHO_LEVER_M * math.sin(math.radians(40.0)), abs=1e-12)
    away = moved(door_swing(AT), math.radians(5.0), lever) - lever
    assert away @ np.array(AT.way((1.0, 0.0, 0.0))) > 0.05


def test_the_opened_doors_frame_is_the_frame_moved_with_the_door():
    after = opened(AT, 0.4)
    end = np.array(AT.point((0.0, -door.LEVER_M, 0.0)))
    np.testing.assert_allclose(after.point((0.0, -door.LEVER_M, 0.0)), moved(door_swing(AT), 0.4, end), atol=1e-12)


def test_an_upright_turn_of_the_wheel_goes_to_the_robots_left():
    top = np.array(AT.point((0.0, 0.0, 0.18)))
    quarter = moved(wheel_turn(AT), math.pi / 2, top)
    np.testing.assert_allclose(quarter, AT.point((0.0, 0.18, 0.0)), atol=1e-12)


@pytest.mark.parametrize("spoke_deg", [0.0, 17.0, 250.0])
def test_the_rod_goes_behind_a_spoke_near_where_it_is_asked_for(spoke_deg):
    at, stand = Template((0.0, 0.0, 1.0), 0.0), drc_stand("atlas")
    _, y, z = gap_handle(at, math.radians(spoke_deg), stand).centre
    angle = math.atan2(y, z - 1.0)
    behind = (math.radians(spoke_deg) - angle) % (math.tau / valve.SPOKES)
    assert behind == pytest.approx(LEAD_RAD, abs=1e-9)
    assert abs(math.remainder(angle - stand.start_rad, math.tau)) <= math.pi / valve.SPOKES + 1e-9


def test_a_robot_without_a_stand_is_refused():
    with pytest.raises(UnknownName):
        drc_stand("valkyrie")


def test_a_rigid_way_turns_the_tool_with_the_thing():
    turn = np.eye(3)
    way = Way(lever_turn(Template((0.0, 0.0, 1.0), 0.0)), 0.5, np.array([0.0, -0.1, 1.0]), turn[:, 2], turn)
    target = way.at(0.5)
    assert isinstance(target, PoseTarget)
    np.testing.assert_allclose(target.rotation.T @ target.rotation, np.eye(3), atol=1e-12)
    # About x, by what the thing has turned.
    assert math.acos((np.trace(target.rotation) - 1.0) / 2.0) == pytest.approx(0.5)
    np.testing.assert_allclose(target.rotation[:, 0], [1.0, 0.0, 0.0], atol=1e-12)


def test_a_way_without_rotation_leaves_the_spin_free():
    way = Way(lever_turn(AT), 0.5, np.array([0.7, 0.1, 1.0]), np.array([1.0, 0.0, 0.0]))
    assert not isinstance(way.at(0.2), PoseTarget)


@pytest.mark.parametrize("name", sorted(DRC_STANDS))
def test_the_whole_wheel_is_in_reach_from_the_stand(name):
    spec = robot_of(name, "claw")
    body = Body(spec, Plant(spec.model, BareFloor()))
    body.load(body.standing())
    arm, stand = arm_of(body, "left"), drc_stand(name)
    _, stance = plan_stance(arm)
    rest = rest_posture(arm, stance)
    at = Template((*stand.valve, valve.HEIGHT_M), 0.0)
    start = np.array(gap_handle(at, 0.3, stand).centre)
    way = Way(wheel_turn(at), math.tau, start, np.array([1.0, 0.0, 0.0]))
    table = motion_table(kinematics_of(arm.robot), "left", stance, rest, rest, way)
    assert table.usable


# In the physics ------------------------------------------------------------------------------------------------------


def test_atlas_turns_a_valve_by_a_quarter():
    scene = Valve(place=(*drc_stand("atlas").valve, valve.HEIGHT_M), friction_nm=4.0)
    robot, at = Robot("atlas", scene), Template(scene.place, 0.0)
    assert robot.do(Take("left", gap_handle(at, scene.start_rad, drc_stand("atlas")), shut=True)).outcome == "taken"
    act = Act("left", wheel_turn(at), math.pi / 2, TOOL, 100.0, give_way_n=15.0, braced=True)
    # The gap is wider than what a hand may go without touch: it looks for the spoke first.
    assert robot.do(act).outcome == "grip_lost"
    turn = robot.do(act)
    assert turn.outcome == "reached"
    assert robot.do(LetGo("left", shut=True)).outcome == "released"
    # 10 degrees: 2 cm of the hand at 0.115 m, what its play in the table and the body's give let it be off.
    assert turned_rad(robot.body.plant) == pytest.approx(math.pi / 2, abs=math.radians(10.0))
    # The wheel resists with 4 N m at 0.115 m.
    assert turn.data.peak_n > 4.0 / 0.115
    assert not robot.state.fallen


@pytest.mark.parametrize(("name", "push_deg"), [("atlas", 20.0), ("thormang3", 15.0)])
def test_a_robot_opens_the_door_by_contact_alone(name, push_deg):
    scene = Door(place=(*drc_stand(name).door, door.LEVER_HEIGHT_M))
    robot, at = Robot(name, scene), Template(scene.place, 0.0)
    plant = robot.body.plant
    # The latch's gear is the model's only equality: nothing ties the hand to the lever.
    assert plant.model.neq == 1
    assert robot.do(Take("left", lever_handle(at))).outcome == "taken"
    firm = {"rigid": True, "give_way_n": 15.0}
    turn = robot.do(Act("left", lever_turn(at), math.radians(55.0), TOOL, **firm))
    assert lever_rad(plant) > math.radians(41.0)
    assert opened_rad(plant) < math.radians(2.0)
    push = robot.do(Act("left", door_swing(at), math.radians(push_deg), TOOL, **firm))
    # 2 degrees: 3 cm of the hand at 0.8 m from the hinges.
    assert opened_rad(plant) == pytest.approx(math.radians(push_deg), abs=math.radians(2.0))
    robot.do(Act("left", lever_turn(opened(at, push.data.amount)), -turn.data.amount, TOOL, **firm))
    robot.do(LetGo("left"))
    assert not robot.state.fallen
    assert opened_rad(plant) > math.radians(push_deg - 4.0)
    assert abs(lever_rad(plant)) < math.radians(2.0)


def test_a_door_whose_lever_is_not_turned_does_not_open():
    scene = Door(place=(*drc_stand("atlas").door, door.LEVER_HEIGHT_M))
    robot, at = Robot("atlas", scene), Template(scene.place, 0.0)
    robot.do(Take("left", lever_handle(at)))
    push = robot.do(Act("left", door_swing(at), 0.3, TOOL, rigid=True, give_way_n=15.0, time_limit_s=6.0))
    assert push.outcome in ("no_motion", "force_limit", "timed_out")
    assert opened_rad(robot.body.plant) < math.radians(2.0)


def test_a_hand_that_meets_a_spoke_on_its_way_in_is_drawn_back():
    stand = drc_stand("atlas")
    scene = Valve(place=(*stand.valve, valve.HEIGHT_M))
    robot, at = Robot("atlas", scene), Template(scene.place, 0.0)
    # The template's spokes are where the true gaps are.
    take = robot.do(Take("left", gap_handle(at, scene.start_rad + LEAD_RAD, stand), shut=True))
    assert take.outcome == "blocked"
    assert turned_rad(robot.body.plant) == pytest.approx(0.0, abs=math.radians(3.0))
    assert not robot.state.fallen


def test_a_take_out_of_reach_is_refused_before_anything_moves():
    robot = Robot("atlas", BareFloor())
    take = robot.do(Take("left", lever_handle(Template((2.0, 0.2, 1.0), 0.0))))
    assert take.outcome == "no_plan"
    assert take.physics_s == 0.0


def test_equal_commands_give_equal_episodes():
    scene = Valve(place=(*drc_stand("atlas").valve, valve.HEIGHT_M))
    ends = []
    for _ in range(2):
        robot, at = Robot("atlas", scene), Template(scene.place, 0.0)
        ends.append(robot.do(Take("left", gap_handle(at, scene.start_rad, drc_stand("atlas")), shut=True)).end)
    assert ends[0] == ends[1]
