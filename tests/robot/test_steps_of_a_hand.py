"""The parts of taking a thing, hands and joints moved by hand, and postures that have names."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
import pytest

from teleop_sim.core.fingerprint import fingerprint
from teleop_sim.robot.affordance import moved
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import (
    Cartesian,
    Command,
    Fingers,
    Grasp,
    Handle,
    Joints,
    Posture,
    PreGrasp,
    Retreat,
    Take,
    Vector,
)
from teleop_sim.robot.drc_plans import LEAD_RAD, Template, drc_stand, gap_handle, lever_handle, lever_turn
from teleop_sim.robot.episode import Episode, NoiseKey, perform
from teleop_sim.robot.hands import robot_of
from teleop_sim.robot.predefined import ARMS, HOMES, TURNS, angles_of, predefined
from teleop_sim.robot.skills.enter import BACK_M, BEHIND_M
from teleop_sim.robot.skills.guarding import MOST_N, guard_n
from teleop_sim.robot.skills.joints import OFF_RAD
from teleop_sim.robot.tool_poses import tool_pose
from teleop_sim.world import door, valve
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.door import Door, lever_rad, opened_rad
from teleop_sim.world.plant import Plant, Scenery
from teleop_sim.world.valve import Valve, turned_rad

ROBOTS = ("atlas", "thormang3")
FAR = Handle((2.0, 0.3, 1.0), (1.0, 0.0, 0.0), None, 0.0)


class Robot:
    """A robot before a thing, and commands one after the other."""

    def __init__(self, name: str, scene: Scenery) -> None:
        spec = robot_of(name, "claw")
        self.body = Body(spec, Plant(spec.model, scene))
        self.state = self.body.standing()
        self.body.load(self.state)
        self.count = 0

    def do(self, command: Command) -> Episode:
        self.count += 1
        episode = perform(self.body, command, self.state, NoiseKey(1, 0, self.count))
        self.state = episode.end
        self.body.load(self.state)
        return episode

    def tool(self) -> tuple[np.ndarray, Vector]:
        position, rotation = tool_pose(self.body, "left")
        return np.array(position), rotation


def at_door(name: str) -> tuple[Robot, Template]:
    scene = Door(place=(*drc_stand(name).door, door.LEVER_HEIGHT_M))
    return Robot(name, scene), Template(scene.place, 0.0)


def at_valve(name: str, spoke_off_rad: float = 0.0) -> tuple[Robot, Handle]:
    scene = Valve(place=(*drc_stand(name).valve, valve.HEIGHT_M))
    at = Template(scene.place, 0.0)
    return Robot(name, scene), gap_handle(at, scene.start_rad + spoke_off_rad, drc_stand(name))


def to(position: np.ndarray, rotation: Vector) -> Cartesian:
    x, y, z = (float(v) for v in position)
    return Cartesian("left", (x, y, z), rotation)


def arm_angles(robot: Robot) -> np.ndarray:
    names = robot.body.spec.arms["left"]
    return np.array([robot.body.plant.angle(name) for name in names])


# Before a handle, in, closed, back -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ROBOTS)
def test_the_parts_end_where_taking_ends(name):
    whole, at = at_door(name)
    parts, _ = at_door(name)
    handle = lever_handle(at)
    assert whole.do(Take("left", handle)).outcome == "taken"
    assert parts.do(PreGrasp("left", handle)).outcome == "reached"
    before_m = np.array(handle.centre) - parts.tool()[0]
    # 1 cm: what a posture may leave, and what the arm does.
    np.testing.assert_allclose(before_m, [BACK_M, 0.0, 0.0], atol=0.01)
    assert abs(lever_rad(parts.body.plant)) < math.radians(1.0)
    assert parts.do(Grasp("left", handle)).outcome == "reached"
    closed = parts.do(Fingers("left", True))
    assert closed.outcome == "closed"
    assert closed.data.squeeze_n > 20.0
    # 5 mm: each of them is led to the same place, and gives way while it closes.
    np.testing.assert_allclose(parts.tool()[0], whole.tool()[0], atol=0.005)


def test_a_hand_closes_on_nothing_and_opens_again():
    robot = Robot("thormang3", BareFloor())
    before = robot.tool()[0]
    assert robot.do(Fingers("left", True)).outcome == "closed"
    assert robot.body.jaws[0] > 1.0
    assert robot.body.jaws[1] == 0.0
    opened = robot.do(Fingers("left", False))
    assert opened.outcome == "opened"
    assert robot.body.jaws == (0.0, 0.0)
    # Light as its jaws are, the arm that gives way sags by its own friction alone.
    np.testing.assert_allclose(robot.tool()[0], before, atol=0.01)


def test_an_obstacle_on_the_way_is_no_plan_and_one_elsewhere_is_none():
    robot, at = at_door("atlas")
    handle = lever_handle(at)
    x, y, z = handle.centre
    spurious = robot.do(PreGrasp("left", handle, obstacles=((x - BACK_M - 0.1, y, z),)))
    assert spurious.outcome == "no_plan"
    assert "obstacle" in spurious.cause
    assert spurious.physics_s == 0.0
    assert robot.do(PreGrasp("left", handle, obstacles=((x - BACK_M, y - 1.0, z + 1.0),))).outcome == "reached"


def test_a_hand_that_is_elsewhere_does_not_go_in():
    robot, at = at_door("atlas")
    grasp = robot.do(Grasp("left", lever_handle(at)))
    assert grasp.outcome == "no_plan"
    assert "before it" in grasp.cause
    assert grasp.physics_s == 0.0


def test_a_handle_out_of_reach_is_refused_before_anything_moves():
    episode = Robot("atlas", BareFloor()).do(PreGrasp("left", FAR))
    assert episode.outcome == "no_plan"
    assert episode.physics_s == 0.0


def test_a_blocked_hand_comes_back_to_before_the_handle():
    robot, handle = at_valve("atlas", LEAD_RAD)
    assert robot.do(PreGrasp("left", handle, shut=True)).outcome == "reached"
    start = robot.tool()[0]
    grasp = robot.do(Grasp("left", handle, shut=True))
    assert grasp.outcome == "blocked"
    assert grasp.data.met_n > 20.0 or grasp.data.behind_m > BEHIND_M
    # 3 cm: it goes back by what it has come in, to a posture that it has left under a force.
    np.testing.assert_allclose(robot.tool()[0], start, atol=0.03)
    assert turned_rad(robot.body.plant) == pytest.approx(0.0, abs=math.radians(3.0))
    assert robot.body.jaws[0] > 1.0


def test_a_hand_goes_in_where_a_template_was_moved_to_after_it_had_come_before_it():
    robot, handle = at_valve("atlas")
    x, y, z = handle.centre
    off = Handle((x, y + 0.03, z - 0.02), handle.approach, None, 0.0)
    robot.do(PreGrasp("left", off, shut=True))
    assert robot.do(Grasp("left", handle, shut=True)).outcome == "reached"
    np.testing.assert_allclose(robot.tool()[0], handle.centre, atol=0.01)
    back = robot.do(Retreat("left", handle))
    assert back.outcome == "reached"
    assert back.data == pytest.approx(0.10, abs=BEHIND_M)


# By hand -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("side", ["left", "right"])
def test_where_a_hand_is_said_to_be_is_where_the_physics_has_it(name, side):
    robot = Robot(name, BareFloor())
    robot.do(Posture(f"DOOR_OPEN_POSE_TURNED.{side}"))
    before = robot.body.save()
    position, rotation = tool_pose(robot.body, side)
    site = robot.body.plant.site(f"{side}Tcp")
    # The same kinematics from the same description: rounding alone. A message's millimetre would do.
    np.testing.assert_allclose(position, site.position, atol=1e-9)
    np.testing.assert_allclose(pin.exp3(np.array(rotation)), site.rotation, atol=1e-9)
    assert robot.body.save() == before


@pytest.mark.parametrize("name", ROBOTS)
def test_a_tool_goes_straight_to_a_pose(name):
    robot = Robot(name, BareFloor())
    start, rotation = robot.tool()
    goal = start + np.array([-0.05, 0.05, 0.04])
    turned = pin.log3(np.asarray(pin.exp3(np.array([0.0, 0.0, 0.2]))) @ pin.exp3(np.array(rotation)))
    x, y, z = (float(v) for v in turned)
    episode = robot.do(to(goal, (x, y, z)))
    assert episode.outcome == "reached"
    np.testing.assert_allclose(robot.tool()[0], goal, atol=0.005)
    np.testing.assert_allclose(robot.tool()[1], turned, atol=0.03)
    # Never faster than 0.1 m/s or 0.5 rad/s: a minimum jerk's peak is 15/8 of its mean.
    assert episode.physics_s > 1.875 * max(np.linalg.norm(goal - start) / 0.1, 0.2 / 0.5)


def test_a_pose_out_of_reach_is_refused_before_anything_moves():
    robot = Robot("atlas", BareFloor())
    position, rotation = robot.tool()
    episode = robot.do(to(position + np.array([1.0, 0.0, 0.0]), rotation))
    assert episode.outcome == "no_plan"
    assert "out of reach" in episode.cause
    assert episode.physics_s == 0.0


@pytest.mark.parametrize("name", ROBOTS)
def test_a_tool_led_into_a_door_is_stopped_and_the_robot_stands(name):
    robot, at = at_door(name)
    robot.do(PreGrasp("left", lever_handle(at), shut=True))
    position, rotation = robot.tool()
    episode = robot.do(to(position + np.array([0.15, -0.12, 0.0]), rotation))
    assert episode.outcome == "blocked"
    # What it has gained in speed comes on top.
    assert guard_n(robot.body) <= episode.data.met_n < 1.5 * guard_n(robot.body)
    assert not robot.state.fallen
    assert opened_rad(robot.body.plant) < math.radians(2.0)


def test_a_light_robots_hand_stops_sooner():
    assert guard_n(Robot("atlas", BareFloor()).body) == MOST_N
    body = Robot("thormang3", BareFloor()).body
    # Its weight's 6 cm at a height of 1 m.
    assert guard_n(body) == pytest.approx(0.06 * 9.81 * float(body.plant.model.body_subtreemass[1]), rel=0.01)


@pytest.mark.parametrize("name", ROBOTS)
def test_an_operator_turns_a_lever_by_poses_alone(name):
    robot, at = at_door(name)
    handle = lever_handle(at)
    for command in (PreGrasp("left", handle), Grasp("left", handle), Fingers("left", True)):
        robot.do(command)
    place, rotation = robot.tool()
    turn, wanted = lever_turn(at), math.radians(45.0)
    turned = pin.log3(pin.exp3(wanted * np.array(turn.axis)) @ pin.exp3(np.array(rotation)))
    x, y, z = (float(v) for v in turned)
    for share in (1 / 3, 2 / 3):
        between = pin.log3(pin.exp3(share * wanted * np.array(turn.axis)) @ pin.exp3(np.array(rotation)))
        u, v, w = (float(value) for value in between)
        assert robot.do(to(moved(turn, share * wanted, place), (u, v, w))).outcome == "reached"
    assert robot.do(to(moved(turn, wanted, place), (x, y, z))).outcome == "reached"
    # 4 degrees: 6 mm of the hand at 85 mm, half the play of a claw of 12 mm round a lever of 10.
    assert lever_rad(robot.body.plant) == pytest.approx(wanted, abs=math.radians(4.0))
    assert not robot.state.fallen


@pytest.mark.parametrize("name", ROBOTS)
def test_joints_go_where_they_are_told_in_the_robots_own_order(name):
    robot = Robot(name, BareFloor())
    goal = arm_angles(robot) + 0.1
    episode = robot.do(Joints("left_arm", tuple(map(float, goal))))
    assert episode.outcome == "reached"
    np.testing.assert_allclose(arm_angles(robot), goal, atol=OFF_RAD)


def test_joints_that_cannot_be_told_are_refused_and_nothing_moves():
    robot = Robot("atlas", BareFloor())
    angles = tuple(map(float, arm_angles(robot)))
    beyond = robot.body.spec.model.description.joint(robot.body.spec.arms["left"][0]).upper_rad + 0.01
    for command, word in (
        (Joints("left_arm", angles[:6]), "7 joints"),
        (Joints("left_arm", (beyond, *angles[1:])), "limits of l_arm_shz"),
        (Joints("left_leg", (0.0,) * 6), "left_leg"),
        (Joints("right_hand", (0.0,)), "right_hand"),
    ):
        episode = robot.do(command)
        assert episode.outcome == "refused"
        assert word in episode.cause
        assert episode.physics_s == 0.0


def test_an_angle_rounded_beyond_a_limit_is_the_limit():
    robot = Robot("atlas", BareFloor())
    name = robot.body.spec.torso[0]
    limit = robot.body.spec.model.description.joint(name).upper_rad
    episode = robot.do(Joints("torso", (limit + 0.0015, 0.0, 0.0)))
    assert episode.outcome == "reached"
    assert not robot.state.fallen


# Postures with names -------------------------------------------------------------------------------------------------


def every_posture(robot: str) -> list[Posture]:
    names = ("TURN_TORSO_CENTER_POSE", *(name.partition(".")[0] for name in HOMES), *TURNS[robot], *ARMS[robot])
    found = [predefined(robot, name, side) for name in names for side in ("left", "right")]
    return [posture for posture in found if posture is not None]


@pytest.mark.parametrize("name", ROBOTS)
def test_every_posture_is_reached_and_the_robot_stands(name):
    robot = Robot(name, BareFloor())
    for posture in every_posture(name):
        episode = robot.do(posture)
        assert (posture, episode.outcome) == (posture, "reached")
    assert not robot.state.fallen


@pytest.mark.parametrize("name", ROBOTS)
def test_every_posture_is_within_the_joints_limits(name):
    body = Robot(name, BareFloor()).body
    home = dict(zip(body.upper_names, body.named_posture("walk"), strict=True))
    for posture in every_posture(name):
        angles = angles_of(body.spec, posture.name, home)
        assert angles
        for joint, angle in angles.items():
            limits = body.spec.model.description.joint(joint)
            assert limits.lower_rad <= angle <= limits.upper_rad


def test_a_posture_is_a_sides_own_or_the_same_for_all():
    assert predefined("atlas+claw", "TURN_TORSO_FULL", "left") == Posture("TURN_TORSO_FULL.left")
    assert predefined("atlas", "STAND_POSE", "both_arms") == Posture("STAND_POSE")
    assert predefined("atlas", "TURN_TORSO_FULL", "both_arms") is None
    assert predefined("atlas", "CAR_ENTRY_LEGS_POSE", "left") is None
    assert predefined("valkyrie", "STAND_POSE", "left") is None


def test_commands_are_values():
    handle = FAR
    commands = [
        PreGrasp("left", handle),
        PreGrasp("left", handle, obstacles=((1.0, 0.0, 1.0),)),
        Grasp("left", handle),
        Retreat("left", handle),
        Fingers("left", True),
        Cartesian("left", (0.5, 0.2, 1.0), (0.0, 0.0, 0.0)),
        Joints("torso", (0.1,)),
    ]
    assert len({fingerprint(command) for command in commands}) == len(commands)
    assert len(set(commands)) == len(commands)
