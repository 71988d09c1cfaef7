"""What each disturbance does to a plant, by the law that it must obey."""

import math
from functools import cache, partial

import mujoco
import numpy as np
import pytest

from teleop_sim.core.streams import stream
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Scan
from teleop_sim.robot.perception import camera
from teleop_sim.robot.perception.rays import SensorPose
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.skill import Tick
from teleop_sim.robot.skills.sensing import camera_pose, light, picture, scan
from teleop_sim.scenarios.disturbances import disturbance_ranges
from teleop_sim.scenarios.schema import Disturbances as Table
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.description import Description, Joint, Link, Sole
from teleop_sim.world.dish_draw import DishSettings, draw_dish_world
from teleop_sim.world.dish_scenery import DishScenery
from teleop_sim.world.disturbance_draw import Ground, draw_disturbances
from teleop_sim.world.disturbances import CALM, PATCH_HEIGHT_M
from teleop_sim.world.plant import GRAVITY_M_S2, TICK_S, Plant, Scenery
from teleop_sim.world.robot_model import RobotModel, Servo

GROUND = Ground(((0.0, 0.0), (4.0, 0.0)), 0.8)
NAMES = sorted(ROBOTS)


def plant_with(table: dict[str, object], name: str = "valkyrie", scenery: Scenery | None = None) -> Plant:
    """A plant as a scenario's table [disturbances] makes it."""
    model = ROBOTS[name]().model
    ranges = disturbance_ranges(Table.model_validate(table))
    what = draw_disturbances(partial(stream, 1, 0), ranges, GROUND, model)
    return Plant(model, scenery or BareFloor(), disturbances=what)


@cache
def calm(name: str = "valkyrie") -> Plant:
    return plant_with({}, name)


def test_a_table_that_says_nothing_makes_the_calm_plant() -> None:
    assert calm().disturbances == CALM


def standing_n(plant: Plant, name: str) -> float:
    """Force of the ground on both soles of a robot at rest [N]."""
    body = Body(ROBOTS[name](), plant)
    body.load(body.standing())
    for _ in range(150):
        body.tick(Tick(body.posture))
    forces = np.zeros(6)
    total = 0.0
    for number in range(plant.data.ncon):
        mujoco.mj_contactForce(plant.model, plant.data, number, forces)
        total += float(plant.data.contact.frame[number].reshape(3, 3)[0] @ [0.0, 0.0, 1.0]) * forces[0]
    return abs(total)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("known", [False, True])
def test_a_payload_presses_on_the_ground_with_its_weight(name: str, known: bool) -> None:
    mass_kg = {"thormang3": 0.5}.get(name, 2.0)
    table = {"payload": {"link": "left_hand", "mass_kg": mass_kg, "known": known}}
    more_n = standing_n(plant_with(table, name), name) - standing_n(calm(name), name)
    # A robot at rest to a thousandth of its weight, as in the checks of the ground's force.
    weight_n = GRAVITY_M_S2 * float(calm(name).model.body_subtreemass[1])
    assert more_n == pytest.approx(mass_kg * GRAVITY_M_S2, abs=1e-3 * weight_n)


@pytest.mark.parametrize("factor", [0.97, 1.03])
def test_a_heavier_robot_presses_so_much_more(factor: float) -> None:
    now, before = (standing_n(plant, "valkyrie") for plant in (plant_with({"mass_factor": factor}), calm()))
    assert now / before == pytest.approx(factor, abs=2e-3)


def test_the_trunk_s_centre_of_mass_is_off_by_what_is_stated() -> None:
    trunk = ROBOTS["valkyrie"]().model.trunk
    at = [p.model.body(trunk).ipos for p in (calm(), plant_with({"com_error_m": 0.02}))]
    assert np.linalg.norm(at[1] - at[0]) == pytest.approx(0.02)


def test_a_bump_is_as_high_as_stated_where_it_lies() -> None:
    plant = plant_with({"bumps": {"height_m": 0.03, "at_m": [[2.0, 0.5]], "yaw_rad": 0.0}})
    plant.load(plant.save())
    from_above = np.array([[0.0, 0.0, -1.0]])
    here = {x: plant.cast(np.array([x, 0.5, 1.0]), from_above, 5.0)[0][0] for x in (1.84, 1.86, 2.14, 2.16)}
    # 0.3 m long: from 1.85 to 2.15.
    assert here == pytest.approx({1.84: 1.0, 1.86: 0.97, 2.14: 0.97, 2.16: 1.0}, abs=1e-9)


def sledge() -> RobotModel:
    """A block on two stiff soles."""

    def link(name: str, mass_kg: float) -> Link:
        return Link(name, mass_kg, (0.0, 0.0, 0.05), (0.1 * mass_kg, 0.0, 0.0, 0.1 * mass_kg, 0.0, 0.1 * mass_kg))

    def hinge(child: str, y_m: float) -> Joint:
        return Joint(f"{child}Hinge", "block", child, (0.0, y_m, 0.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), -1, 1, 1e6, 1)

    links, joints = (
        (link("block", 20.0), link("left", 1.0), link("right", 1.0)),
        (hinge("left", 0.2), hinge("right", -0.2)),
    )
    sole = Sole("left", "right", (0.3, 0.15, 0.05), (0.0, 0.0, 0.025))
    servos = {joint.name: Servo(kp=1e5, kv=1e3, armature=1.0) for joint in joints}
    return RobotModel(Description("sledge", "block", links, joints, (), sole), servos, (), (), "block")


@pytest.mark.parametrize(("at_x_m", "friction"), [(0.5, 0.15), (0.5, 0.3), (10.0, 0.8)])
def test_on_a_patch_things_stop_by_its_friction_and_beside_it_by_the_floor_s(at_x_m: float, friction: float) -> None:
    patch = {"friction": min(friction, 0.3), "at_m": [[at_x_m, 0.0]], "length_m": 3.0, "yaw_rad": 0.0}
    ranges = disturbance_ranges(Table.model_validate({"patches": patch}))
    what = draw_disturbances(partial(stream, 1, 0), ranges, GROUND, sledge())
    plant = Plant(sledge(), BareFloor(GROUND.friction), disturbances=what)
    plant.data.qpos[2] = PATCH_HEIGHT_M if at_x_m < 1.0 else 0.0
    settled, speed = 25, 1.0
    for tick in range(settled + 100):
        if tick == settled:
            start_m, plant.data.qvel[0] = float(plant.data.qpos[0]), speed
        plant.begin_tick()
        plant.end_tick()
    # s = v^2 / (2 mu g); soles chatter as they slide, as in the checks of Coulomb's law.
    assert plant.data.qpos[0] - start_m == pytest.approx(speed**2 / (2 * friction * GRAVITY_M_S2), rel=0.1)


@pytest.mark.parametrize("force_n", [10.0, 40.0])
def test_a_push_gives_the_momentum_of_its_force_and_time(force_n: float) -> None:
    table = {"pushes": {"force_n": force_n, "duration_s": 0.2, "every_s": 0.1, "direction_rad": 0.5, "count": 1}}
    plant = plant_with(table, "thormang3")
    # In the air nothing else acts sideways: p = F t.
    plant.data.qpos[2] += 5.0
    for _ in range(30):
        plant.begin_tick()
        plant.end_tick()
    mujoco.mj_subtreeVel(plant.model, plant.data)
    momentum = plant.data.subtree_linvel[1][:2] * plant.model.body_subtreemass[1]
    assert momentum == pytest.approx(0.2 * force_n * np.array([math.cos(0.5), math.sin(0.5)]), rel=1e-3)


def test_a_weak_joint_gives_no_more_than_is_left() -> None:
    plant = plant_with({"strength": {"*Knee*": 0.6}})
    strong = plant_with({})
    for p in (strong, plant):
        for joint in ("leftKneePitch", "leftHipYaw"):
            p.set_control(joint, 100.0)
        p.begin_tick()
        p.end_tick()
    description = ROBOTS["valkyrie"]().model.description
    given_nm = [[float(p.data.actuator(j).force[0]) for j in ("leftKneePitch", "leftHipYaw")] for p in (strong, plant)]
    effort_nm = [description.joint(j).effort_nm for j in ("leftKneePitch", "leftHipYaw")]
    assert given_nm[0] == pytest.approx(effort_nm)
    assert given_nm[1] == pytest.approx([0.6 * effort_nm[0], effort_nm[1]])


def test_a_joint_with_friction_holds_below_it_and_moves_above() -> None:
    joint, share = "leftHipYaw", 0.2
    effort = ROBOTS["valkyrie"]().model.description.joint(joint).effort_nm
    moved = []
    for torque in (0.9, 1.2):
        plant = plant_with({"joint_friction": share})
        plant.model.opt.gravity[:] = 0.0
        plant.model.actuator_gainprm[:] = plant.model.actuator_biasprm[:] = 0.0
        plant.data.qpos[2] += 5.0
        before = plant.angle(joint)
        at = int(plant.model.joint(joint).dofadr[0])
        for _ in range(10):
            plant.data.qfrc_applied[at] = torque * share * effort
            plant.begin_tick()
            plant.end_tick()
        moved.append(abs(plant.angle(joint) - before))
    # Friction creeps a little below its bound, as all soft constraints do.
    assert moved[0] < 0.1 * moved[1]


def test_a_late_feel_is_as_old_as_stated() -> None:
    body = Body(ROBOTS["valkyrie"](), plant_with({"delay_s": 3 * TICK_S}))
    body.load(body.standing())
    assert body.plant.disturbances.deceives
    heights = []
    for _ in range(6):
        body.tick(Tick(body.posture))
        heights.append((float(body.plant.data.qpos[2]), float(body._belief.data.qpos[2])))
    assert [felt for _, felt in heights[4:]] == pytest.approx([true for true, _ in heights[0:2]], abs=1e-12)


# Senses --------------------------------------------------------------------------------------------------------------


@cache
def dish() -> DishScenery:
    return DishScenery(draw_dish_world(partial(stream, 3, 0), DishSettings(layout_id=2)))


def seeing(table: dict[str, object]) -> Body:
    body = Body(ROBOTS["valkyrie"](), plant_with({"senses": table}, scenery=dish()))
    body.load(body.standing())
    return body


def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def test_a_turned_camera_sees_what_a_straight_one_would_see_from_there() -> None:
    yaw = 0.05
    wrong, right = seeing({"camera_turn_rad": [0.0, 0.0, yaw]}), seeing({})
    turn = np.array([[math.cos(yaw), -math.sin(yaw), 0.0], [math.sin(yaw), math.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    pose = camera_pose(right)
    there = camera.take(right.plant, SensorPose(pose.rotation @ turn, pose.position), light(right), rng())
    assert (picture(wrong, rng()) == there).mean() > 0.999
    assert (picture(wrong, rng()) == picture(right, rng())).mean() < 0.9


def test_brightness_and_noise_of_images_are_as_stated() -> None:
    plain, bright = (picture(seeing(table), rng()).astype(float) for table in ({}, {"exposure": 0.5, "pixel_noise": 0}))
    quiet = picture(seeing({"pixel_noise": 0}), rng()).astype(float)
    noisy = picture(seeing({"pixel_noise": 3}), rng()).astype(float)
    lit = (quiet > 20) & (quiet < 235)
    # Images are whole numbers from 0 to 255.
    assert bright[lit] == pytest.approx(0.5 * quiet[lit], abs=1.0)
    assert (noisy - quiet)[lit].std() == pytest.approx(3 * (plain - quiet)[lit].std(), rel=0.05)


def cloud(table: dict[str, object]) -> np.ndarray:
    motion = scan(seeing(table), Scan(), rng())
    with pytest.raises(StopIteration) as ended:
        next(motion)
    return ended.value.value.data.points


def test_a_shifted_lidar_sees_the_ground_higher() -> None:
    exact, raised = (cloud({"range_noise": 0, "lidar_shift_m": [0.0, 0.0, z]}) for z in (0.0, -0.03))
    # Of the walkway ahead, 1.5 m wide and at height 0; the soil beside it is 0.1 m lower.
    ground = [
        float(np.median(p[(np.abs(p[:, 1]) < 0.6) & (p[:, 0] > 0.5) & (p[:, 0] < 3.0), 2])) for p in (exact, raised)
    ]
    assert ground == pytest.approx([0.0, 0.03], abs=0.003)


def test_noise_of_ranges_is_as_stated() -> None:
    quiet, plain, loud = (cloud({"range_noise": factor}) for factor in (0, 1, 4))
    assert len(quiet) == len(plain) == len(loud)
    one, four = (np.linalg.norm(points - quiet, axis=1).std() for points in (plain, loud))
    assert four == pytest.approx(4 * one, rel=0.02)
