"""Hands as data: built, weighed, mirrored, and what pads and fingers can hold."""

import math
from dataclasses import dataclass
from importlib.resources import as_file, files

import mujoco
import numpy as np
import pytest

from teleop_sim.core.errors import UnknownName
from teleop_sim.core.streams import stream
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import CircularAffordance, Follow, Grip, Reach
from teleop_sim.robot.episode import NoiseKey, perform
from teleop_sim.robot.fingers import VALKYRIE
from teleop_sim.robot.hands import HANDS, base_name, robot_of
from teleop_sim.robot.kinematics import build
from teleop_sim.robot.memo import Memo
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.templates import crank_stand
from teleop_sim.world import console
from teleop_sim.world import dish_layout as lay
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.description import Description, Joint, Link, Sole, load_description
from teleop_sim.world.digest import plant_digest
from teleop_sim.world.dish_draw import DishSettings, DishWorld, draw_dish_world
from teleop_sim.world.dish_scenery import DishScenery
from teleop_sim.world.hand_pads import PadHand
from teleop_sim.world.hand_parts import opened, turned
from teleop_sim.world.plant import Plant
from teleop_sim.world.robot_model import HandMount, RobotModel, Servo

FITTED = ["atlas+fingers", "atlas+pads", "thormang3+pads", "valkyrie+fingers", "valkyrie+pads"]
HAND_JOINTS = {"atlas+fingers": 22, "valkyrie+fingers": 26}


@pytest.fixture(scope="module", params=FITTED)
def fitted(request) -> Body:
    spec = robot_of(request.param)
    return Body(spec, Plant(spec.model, BareFloor()))


# Names -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_a_robot_by_its_name_alone_is_the_one_of_its_file(name):
    plain = plant_digest(Plant(ROBOTS[name]().model, BareFloor()))
    for spec in (robot_of(name), robot_of(name, "cage"), robot_of(f"{name}+cage")):
        assert spec.model.description.name == name
        assert plant_digest(Plant(spec.model, BareFloor())) == plain


def test_a_hand_is_part_of_the_name_of_what_is_built():
    assert robot_of("valkyrie", "pads").model.description.name == "valkyrie+pads"
    assert base_name("valkyrie+pads") == base_name("valkyrie") == "valkyrie"
    assert crank_stand("valkyrie+pads") is crank_stand("valkyrie")


@pytest.mark.parametrize("name", ["valkyri", "valkyrie+claws", "thormang3+fingers"])
def test_what_there_is_not_is_refused_with_what_there_is(name):
    with pytest.raises(UnknownName) as refused:
        robot_of(name)
    assert set(refused.value.args[2]) & (set(HANDS) | set(ROBOTS))


def test_hands_tell_plants_apart_and_builds_do_not():
    digests = {name: plant_digest(Plant(robot_of(name).model, BareFloor())) for name in [*FITTED, "valkyrie", "atlas"]}
    assert len(set(digests.values())) == len(digests)
    memo = Memo()
    body = memo.body(robot_of("valkyrie+fingers"), BareFloor())
    assert plant_digest(body.plant) == digests["valkyrie+fingers"]
    assert memo.body(robot_of("valkyrie+fingers"), BareFloor()) is body
    assert memo.body(robot_of("valkyrie+pads"), BareFloor()) is not body


# Mass and shape ----------------------------------------------------------------------------------------------------


def test_plans_and_physics_agree_on_the_hands_mass_and_centre(fitted):
    kin, plant = build(fitted.spec), fitted.plant
    assert kin.mass_kg == pytest.approx(float(plant.model.body_subtreemass[1]), abs=1e-9)
    fitted.load(fitted.standing())
    rotation, position = fitted.base()
    q = kin.assemble(rotation, position, kin.positions(fitted.joint_names), fitted.q())
    # Rounding: both sum the same sixty bodies.
    assert np.abs(kin.centre_of_mass(q) - plant.data.subtree_com[1]).max() < 1e-8


@pytest.mark.parametrize("robot", ["atlas", "valkyrie"])
def test_a_robot_with_its_own_fingers_weighs_what_its_source_says(robot):
    with as_file(files("teleop_sim.robot").joinpath(f"{robot}.json")) as path:
        published_kg = sum(link.mass_kg for link in load_description(path).links)
    plant = Plant(robot_of(robot, "fingers").model, BareFloor())
    assert float(plant.model.body_subtreemass[1]) == pytest.approx(published_kg, abs=1e-9)


@pytest.mark.parametrize("name", sorted(HAND_JOINTS))
def test_every_finger_joint_is_there_and_has_a_servo(name):
    spec = robot_of(name)
    plant = Plant(spec.model, BareFloor())
    own = len(spec.model.description.joints)
    assert plant.nv_robot == 6 + own + HAND_JOINTS[name] == plant.model.nv
    assert plant.model.nu == own + HAND_JOINTS[name]


def test_valkyries_hands_mirror_each_other():
    """One tool frame is the other's mirror image across its y, as the palms are; fingers bend the other way."""
    right, left = (
        next(m.hand for m in robot_of("valkyrie+fingers").model.hands if m.side == side) for side in ("right", "left")
    )
    for a, b in zip(opened(right), opened(left), strict=True):
        assert a.solid.name == b.solid.name
        ends = [p.position_m + p.rotation @ np.array(p.solid.b_m) for p in (a, b)]
        assert np.abs(np.abs(ends[0]) - np.abs(ends[1])).max() < 1e-9


def test_a_finger_pushes_with_its_force_when_stretched():
    """Torque over the joint's way to the tip: 38.1 + 22.9 mm of the published joints and a tip of 22 mm."""
    hand = robot_of("valkyrie+fingers").model.hands[0].hand
    limits = {part.name: part.drive.limit for part in hand.parts}
    assert limits["IndexFingerPitch1"] == pytest.approx(VALKYRIE.data.tip_force_n * (0.0381 + 0.0229 + 0.022))
    assert limits["IndexFingerPitch3"] == pytest.approx(VALKYRIE.data.tip_force_n * 0.022)


def test_turning_is_mujocos():
    axis, angle = np.array([0.48, 0.6, 0.64]), 1.1
    quat, matrix = np.zeros(4), np.zeros(9)
    mujoco.mju_axisAngle2Quat(quat, axis, angle)
    mujoco.mju_quat2Mat(matrix, quat)
    assert np.abs(turned(axis, angle).ravel() - matrix).max() < 1e-12


def test_hands_stand_open(fitted):
    fitted.load(fitted.standing())
    for mount in fitted.spec.model.hands:
        wanted = [part.drive.open_q for part in mount.hand.parts]
        assert fitted.jaw_gap(mount.side) == pytest.approx(wanted, abs=1e-12)
        assert fitted.hand_force(mount.side) == 0.0


# Pads hold by friction ---------------------------------------------------------------------------------------------

BALL_KG, BALL_RADIUS_M = 0.5, 0.029


@dataclass(frozen=True)
class Squeezed(BareFloor):
    """A weightless ball between the pads of a hand that is bolted to the world."""

    pull_n: float = 0.0

    def add_to(self, spec: mujoco.MjSpec) -> None:
        spec.delete(spec.joint("root"))
        ball = spec.worldbody.add_body(name="ball", pos=[0.0, 0.0, 1.1], gravcomp=1.0)
        ball.add_freejoint(name="ball")
        ball.add_geom(
            name="ball",
            size=[BALL_RADIUS_M, 0.0, 0.0],
            mass=BALL_KG,
            friction=[self.friction, 0.005, 0.0001],
            condim=4,
            solref=(0.004, 1.0),
            contype=1,
            conaffinity=6,
            group=0,
        )

    def tick(self, plant: Plant, memory: tuple[float, ...]) -> tuple[float, ...]:
        plant.data.xfrc_applied[plant.model.body("ball").id, 2] = self.pull_n if plant.time_s > 1.0 else 0.0
        for jaw in ("leftJaw0", "leftJaw1"):
            plant.set_control(jaw, 0.06)
        return memory


def gripper() -> RobotModel:
    """A palm with pads; its tool frame is upright in the root, 0.5 m from the palm's joint."""
    none = (0.0, 0.0, 0.0)
    links = tuple(Link(name, 1.0, none, (0.01, 0.0, 0.0, 0.01, 0.0, 0.01)) for name in ("block", "left", "right"))
    joints = tuple(
        Joint(name, "block", name, (0.0, y, 0.0), none, (0.0, 1.0, 0.0), -1.0, 1.0, 1e4, 1.0)
        for name, y in (("left", 0.5), ("right", -0.5))
    )
    firm = {joint.name: Servo(1e5, 1e3, 1.0) for joint in joints}
    mount = HandMount("left", "left", np.array([0.0, -0.5, 0.0]), np.eye(3), PadHand())
    far = Sole("left", "right", (1e-3, 1e-3, 1e-3), (0.0, 9.0, 0.0))
    return RobotModel(Description("gripper", "block", links, joints, (), far), firm, (), (mount,), "block")


def drawn_m(friction: float, pull_n: float) -> float:
    """How far a ball moves when it is pulled along the pads' faces for 0.4 s."""
    plant = Plant(gripper(), Squeezed(friction, pull_n=pull_n))
    height, start_m = int(plant.model.joint("ball").qposadr[0]) + 2, 0.0
    for k in range(70):
        plant.begin_tick()
        plant.end_tick()
        if k == 48:
            start_m = float(plant.data.qpos[height])
    return float(plant.data.qpos[height]) - start_m


@pytest.mark.parametrize("friction", [0.2, 0.8])
def test_a_ball_slips_out_of_pads_where_coulomb_says(friction):
    """Two pads that press with their limit of 60 N hold 2 mu N; bounds of 10 % as for soles and cage."""
    holds_n = 2 * friction * PadHand().force_n
    # Under the threshold it creeps by 3 mm/s at 80 N, over it it is gone by metres.
    assert drawn_m(friction, 0.9 * holds_n) < 2e-3
    assert drawn_m(friction, 1.1 * holds_n) > 0.1


# Hands at the crank ------------------------------------------------------------------------------------------------


def dish_world() -> DishWorld:
    settings = DishSettings(floor_friction=(0.8, 0.8), contact_friction=(0.8, 0.8))
    return draw_dish_world(lambda name: stream(2, 0, name), settings)


def at_the_pitch_wheel(body: Body, world: DishWorld) -> CircularAffordance:
    """Put the robot down at its stand; the handle as it is."""
    robot = body.spec.model.description.name
    centre = console.wheel_centre(False)
    x, y, yaw = lay.compose(world.console, crank_stand(robot).pose(centre[:2], 0.0, "right"))
    body.load(body.standing())
    data = body.plant.data
    x, y, _ = lay.compose((x, y, yaw), (float(data.qpos[0]), float(data.qpos[1]), 0.0))
    data.qpos[:2], data.qpos[3:7] = [x, y], [math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)]
    body.plant.load(body.plant.save())
    body.set_stand()
    cx, cy, turn = world.console
    c, s = math.cos(turn), math.sin(turn)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    zero, _, axis = (rotation @ np.array(a) for a in console.wheel_axes())
    hub = rotation @ np.array(centre) + [cx, cy, -console.WALKWAY_HEIGHT_M]
    at, up, spoke = ((float(v[0]), float(v[1]), float(v[2])) for v in (hub, axis, zero))
    return CircularAffordance(at, up, spoke, console.KNOB_ORBIT_M, console.KNOB_HEIGHT_M, world.wheel_start_rad[1])


class Encoded(DishScenery):
    """The wheel's own angle is sent, as if it had an encoder."""

    def status(self, plant: Plant, _: tuple[float, ...]) -> dict[str, float]:
        return {"wheel": plant.angle("pitchWheel")}


@pytest.mark.parametrize("name", ["atlas+fingers", "valkyrie+fingers"])
def test_fingers_take_the_knob_and_turn_it_a_little(name):
    world, spec = dish_world(), robot_of(name)
    body = Body(spec, Plant(spec.model, Encoded(world)))
    handle = at_the_pitch_wheel(body, world)
    state = body.save()
    commands = (Reach("right", handle), Grip("right", close=True), Follow("right", handle, -1, "wheel", 0.5, 0.07))
    ended = []
    for k, command in enumerate(commands):
        episode = perform(body, command, state, NoiseKey(2, 0, k))
        state = episode.end
        ended.append(episode.outcome)
    assert ended == ["reached", "felt", "reached"]
    # 60 % of the tolerance is where a turn may rest.
    assert body.plant.angle("pitchWheel") == pytest.approx(0.5, abs=0.6 * 0.07 + 1e-3)
