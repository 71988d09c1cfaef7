"""Picking, carrying, placing and inserting: what the hands do, judged by where things are and what touches them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from teleop_sim.core.errors import UnknownName
from teleop_sim.robot.body import Body, RobotState
from teleop_sim.robot.commands import Carry, Command, Handle, Insert, Pick, Place, Side, Step, Vector
from teleop_sim.robot.episode import Episode, NoiseKey, perform
from teleop_sim.robot.grasps import bar_handle, hand_stand, stand_at, stand_before
from teleop_sim.robot.pose_ik import PoseIk, angle_between, pose_target
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.skill import Tick
from teleop_sim.robot.skills.manipulate import arm_of, plan_stance, rest_posture
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.belief import Belief, Load
from teleop_sim.world.carry_scene import BOX, PLUG, BoxKind, CarryScene, PlugKind, Socket, handle_pose, touching
from teleop_sim.world.disturbances import Disturbances, Payload, believed
from teleop_sim.world.plant import GRAVITY_M_S2, Plant

SIDE: Side = "right"
KEY = NoiseKey(1, 0, 1)
HIGH_M = 1.0
JAWS = frozenset({"rightJaw0", "rightJaw1"})


def body_in(robot: str, scene: BareFloor) -> tuple[Body, RobotState]:
    spec = ROBOTS[robot]()
    body = Body(spec, Plant(spec.model, scene))
    state = body.standing()
    body.load(state)
    return body, state


def box_scene(robot: str = "valkyrie", kind: BoxKind | None = None) -> CarryScene:
    figures = hand_stand(robot)
    box = BoxKind() if kind is None else kind
    at = (figures.ahead_m, -figures.aside_m, figures.inwards_rad)
    under_m = HIGH_M - box.handle_m
    return CarryScene(stand=at, stand_m=under_m, table=(9.0, 9.0, 0.0), table_m=under_m, box=box)


def handle_at(scene: CarryScene, robot: str = "valkyrie", off: Vector = (0.0, 0.0, 0.0)) -> Handle:
    assert scene.box is not None
    x, y, yaw = scene.stand
    centre = (x + off[0], y + off[1], scene.stand_m + scene.box.handle_m + off[2])
    down = (0.0, 0.0, scene.box.half[2] - scene.box.handle_m)
    return bar_handle(robot, centre, yaw + math.pi / 2, yaw, scene.box.mass_kg, down)


# What the controller is told ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_a_load_that_is_told_is_a_payload_that_was_known(name: str) -> None:
    # The other way to the same model: a heavier link in the description, compiled by MuJoCo.
    robot = ROBOTS[name]().model
    palm = robot.hands[0].palm
    told = Belief(robot, GRAVITY_M_S2, 0)
    told.bear((Load(palm, 2.5, (0.1, -0.2, 0.05), 0.12),))
    payload = Payload(palm, 2.5, (0.1, -0.2, 0.05), 0.12, known=True)
    built = Belief(believed(robot, Disturbances(payload=payload)), GRAVITY_M_S2, 0)
    body, _ = body_in(name, BareFloor())
    velocity = np.random.default_rng(1).normal(size=body.plant.model.nv)
    for belief in (told, built):
        belief.feel(body.plant.data.qpos, velocity, np.zeros(2))
    np.testing.assert_allclose(told.data.M, built.data.M, atol=1e-12)
    np.testing.assert_allclose(told.data.qfrc_bias, built.data.qfrc_bias, atol=1e-12)
    np.testing.assert_allclose(told.data.subtree_com[1], built.data.subtree_com[1], atol=1e-12)
    told.bear(())
    told.feel(body.plant.data.qpos, velocity, np.zeros(2))
    np.testing.assert_allclose(told.data.qfrc_bias, bias_unladen(body, velocity), atol=1e-12)


def bias_unladen(body: Body, velocity: np.ndarray) -> np.ndarray:
    bare = Belief(body.spec.model, GRAVITY_M_S2, 0)
    bare.feel(body.plant.data.qpos, velocity, np.zeros(2))
    return np.asarray(bare.data.qfrc_bias)


def test_what_is_carried_is_part_of_the_state() -> None:
    body, state = body_in("valkyrie", BareFloor())
    loads = (Load("rightPalm", 1.0, (0.0, -0.2, 0.0)),)
    body.carry(loads)
    loaded = body.save()
    assert loaded.loads == loads
    heavy_m = body.com()
    body.load(state)
    assert not body.loads
    body.load(loaded)
    assert body.save().loads == loads
    np.testing.assert_array_equal(body.com(), heavy_m)
    # 1 kg at the hand, more than 0.3 m ahead, in 137 kg: at least 2 mm.
    body.carry(())
    assert heavy_m[0] - body.com()[0] > 0.002


# Where to stand and how to take hold ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(ROBOTS))
@pytest.mark.parametrize("side", ["left", "right"])
def test_from_its_stand_a_robot_has_the_handle_where_its_data_say(name: str, side: Side) -> None:
    figures, centre, bar = hand_stand(name), (1.3, -0.4, 0.9), 0.8
    x, y, yaw = stand_at(name, side, centre, bar, 0.5)
    c, s = math.cos(yaw), math.sin(yaw)
    ahead, left = c * (1.3 - x) + s * (-0.4 - y), -s * (1.3 - x) + c * (-0.4 - y)
    sign = 1 if side == "left" else -1
    assert (ahead, left) == pytest.approx((figures.ahead_m, sign * figures.aside_m))
    approach = np.array(bar_handle(name, centre, bar, yaw, 1.0, (0.0, 0.0, 0.0)).approach)
    assert approach @ [math.cos(bar), math.sin(bar), 0.0] == pytest.approx(0.0, abs=1e-12)
    turned = math.remainder(math.atan2(approach[1], approach[0]) - yaw, math.tau)
    assert turned == pytest.approx(-sign * figures.inwards_rad)


def test_a_robot_without_data_is_refused() -> None:
    with pytest.raises(UnknownName, match="valkyrie"):
        stand_before("asimo", SIDE, (1.0, 0.0, 1.0), 0.0)


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_the_whole_pose_of_a_hand_is_reached(name: str) -> None:
    body, _ = body_in(name, BareFloor())
    arm = arm_of(body, SIDE)
    _, stance = plan_stance(arm)
    rest = rest_posture(arm, stance)
    solver = PoseIk(arm.kinematics, SIDE, stance, rest, torso=True)
    rotation, position = arm.kinematics.tool_pose(rest, SIDE)
    wanted = position + np.array([0.03, 0.02, -0.03])
    found = solver.solve(rest, pose_target(wanted, rotation), 60)
    assert found.within(1e-3, 5e-3)
    again, place = arm.kinematics.tool_pose(found.q, SIDE)
    assert np.linalg.norm(place - wanted) < 1e-3
    assert angle_between(again, rotation) < 5e-3


# By contact --------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def picked() -> tuple[Body, Episode, CarryScene]:
    scene = box_scene()
    body, state = body_in("valkyrie", scene)
    return body, perform(body, Pick(SIDE, handle_at(scene)), state, KEY), scene


def test_a_box_is_picked_and_held(picked: tuple[Body, Episode, CarryScene]) -> None:
    body, episode, scene = picked
    assert scene.box is not None
    body.load(episode.end)
    assert episode.outcome == "held"
    assert touching(body.plant, BOX) == JAWS
    # Weight at the wrist: exact at rest; 1 % is what still swings.
    assert episode.data.weight_n == pytest.approx(scene.box.mass_kg * GRAVITY_M_S2, rel=0.01)
    assert body.loads[0].mass_kg == pytest.approx(scene.box.mass_kg, rel=0.01)
    before = handle_pose(body.plant, BOX).position
    assert before[2] == pytest.approx(HIGH_M + 0.1, abs=0.01)
    for _ in range(round(5.0 / body.tick_s)):
        assert body.tick(Tick(body.posture, jaws=body.jaws))
    # Contacts creep by 0.04 mm/s (carry_scene.GRIP), in the hand and under the feet: 1 mm in 5 s is plenty.
    assert np.linalg.norm(handle_pose(body.plant, BOX).position - before) < 1e-3
    assert touching(body.plant, BOX) == JAWS


def test_the_same_pick_has_the_same_end(picked: tuple[Body, Episode, CarryScene]) -> None:
    _, episode, scene = picked
    body, state = body_in("valkyrie", scene)
    assert perform(body, Pick(SIDE, handle_at(scene)), state, KEY).end == episode.end


def test_a_box_is_carried_and_put_back(picked: tuple[Body, Episode, CarryScene]) -> None:
    body, episode, scene = picked
    carried = perform(body, Carry(SIDE), episode.end, KEY)
    assert carried.outcome == "carried"
    walked = perform(body, Step(forward_m=-0.3), carried.end, KEY)
    assert walked.outcome == "reached"
    assert touching(body.plant, BOX) == JAWS
    back = perform(body, Step(forward_m=0.3), walked.end, KEY)
    placed = perform(body, Place(SIDE, handle_at(scene)), back.end, KEY)
    assert placed.outcome == "placed"
    assert touching(body.plant, BOX) == {"stand"}
    assert handle_pose(body.plant, BOX).rotation[2, 2] > 0.999
    assert body.loads == ()


def test_where_no_ground_comes_the_box_stays_in_the_hand(picked: tuple[Body, Episode, CarryScene]) -> None:
    body, episode, scene = picked
    away = perform(body, Step(forward_m=-0.4), episode.end, KEY)
    placed = perform(body, Place(SIDE, handle_at(scene, off=(-0.4, 0.0, 0.08))), away.end, KEY)
    assert placed.outcome == "no_ground"
    assert touching(body.plant, BOX) == JAWS
    assert body.loads


@pytest.mark.parametrize(
    ("off", "mass_kg", "outcome"),
    [
        ((0.0, 0.0, 0.15), 2.0, "missed"),  # The cage closes over the bar.
        ((0.0, 0.0, 0.05), 12.0, "blocked"),  # A bar of the open cage runs into the handle; 2 kg would be pushed along.
        ((1.0, 0.0, 0.0), 2.0, "no_plan"),
    ],
)
def test_a_hand_sent_to_the_wrong_place_says_so(off: Vector, mass_kg: float, outcome: str) -> None:
    scene = box_scene(kind=BoxKind(mass_kg=mass_kg))
    body, state = body_in("valkyrie", scene)
    episode = perform(body, Pick(SIDE, handle_at(scene, off=off)), state, KEY)
    assert episode.outcome == outcome
    assert body.loads == ()
    assert not touching(body.plant, BOX) & JAWS


def test_a_thing_much_heavier_than_told_is_held_with_its_felt_weight() -> None:
    scene = box_scene(kind=BoxKind(mass_kg=2.0))
    handle = replace(handle_at(scene), mass_kg=1.5)
    body, state = body_in("valkyrie", scene)
    episode = perform(body, Pick(SIDE, handle), state, KEY)
    assert episode.outcome == "held"
    assert body.loads[0].mass_kg == pytest.approx(2.0, rel=0.02)


# Into a hole -------------------------------------------------------------------------------------------------------

PLUG_KIND = PlugKind()
TIP_M = PLUG_KIND.grip_m / 2 + PLUG_KIND.peg_m
MOUTH: Vector = (0.5, -0.08, 0.88)


def plug_scene(depth_m: float = 0.05) -> CarryScene:
    return CarryScene(
        stand=(5.0, 5.0, 0.0),
        stand_m=0.5,
        table=(7.0, 7.0, 0.0),
        table_m=0.5,
        box=None,
        plug=PLUG_KIND,
        rack=(0.5, -0.3, 0.0),
        rack_m=0.9,
        socket=Socket((MOUTH[0], MOUTH[1], 0.0), MOUTH[2], depth_m=depth_m),
    )


def plugged(depth_m: float, off: Vector, search_m: float) -> tuple[Body, Episode]:
    body, state = body_in("valkyrie", plug_scene(depth_m))
    x, y, z = (float(v) for v in handle_pose(body.plant, PLUG).position)
    held = perform(body, Pick(SIDE, Handle((x, y, z), (0.0, 0.0, -1.0), None, 0.5), 0.16), state, KEY)
    assert held.outcome == "held"
    mouth = (MOUTH[0] + off[0], MOUTH[1] + off[1], MOUTH[2] + off[2])
    command: Command = Insert(SIDE, mouth, (0.0, 0.0, -1.0), TIP_M, 0.05, search_m)
    return body, perform(body, command, held.end, KEY)


def test_a_plug_goes_into_a_socket_that_is_a_centimetre_aside() -> None:
    body, episode = plugged(0.05, (0.01, -0.006, 0.003), 0.025)
    assert episode.outcome == "inserted"
    tip = body.plant.site("plug_tip").position - MOUTH
    # Funnel and hole are 57 mm deep, the hole's play is 4 mm.
    assert tip[2] < -0.045
    assert np.abs(tip[:2]).max() < 0.006
    assert not touching(body.plant, PLUG) & JAWS
    assert body.loads == ()


def test_a_hole_too_shallow_ends_at_the_limit_of_force() -> None:
    body, episode = plugged(0.015, (0.0, 0.0, 0.0), 0.005)
    assert episode.outcome == "force_limit"
    assert touching(body.plant, PLUG) & JAWS
    # The limit, and what the arm's inertia adds in the 0.2 s of averaging.
    assert 40.0 < episode.data.force_n < 100.0


def test_where_there_is_no_hole_none_is_found() -> None:
    body, episode = plugged(0.05, (0.06, 0.0, 0.0), 0.01)
    assert episode.outcome == "not_found"
    assert touching(body.plant, PLUG) & JAWS
