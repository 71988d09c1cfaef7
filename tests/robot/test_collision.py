"""What postures touch: coal's gaps against MuJoCo's, and ways that keep clear of a console."""

from __future__ import annotations

import functools
import math

import coal
import mujoco
import numpy as np
import pinocchio as pin
import pytest

from teleop_sim.core.errors import UnknownName
from teleop_sim.robot.body import Body
from teleop_sim.robot.chain_ik import ChainIk, Target, stance_of, two_stage
from teleop_sim.robot.circle_table import circle_of
from teleop_sim.robot.collision import Collisions
from teleop_sim.robot.commands import CircularAffordance, Side
from teleop_sim.robot.crank_scene import Thing, crank_things
from teleop_sim.robot.kinematics import Kinematics, kinematics_of
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.tables import forget, handle_table
from teleop_sim.robot.templates import CRANK_STANDS, crank_stand, rest_of
from teleop_sim.robot.ways import drawn_back, free_way
from teleop_sim.world import console
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.dish_draw import DishSettings, draw_dish_world
from teleop_sim.world.dish_scenery import DishScenery
from teleop_sim.world.plant import Plant

SIDES: tuple[Side, Side] = ("left", "right")
ROBOT_NAMES = sorted(CRANK_STANDS)


def wheel(robot: str, side: Side, angle_rad: float = 3.0) -> CircularAffordance:
    """The wheel before a robot that stands at the origin where it should."""
    stand, zero, axis = crank_stand(robot), *console.wheel_axes()[::2]
    y = stand.aside_m if side == "left" else -stand.aside_m
    centre = (stand.ahead_m, y, console.WHEEL_HEIGHT_M - console.WALKWAY_HEIGHT_M)
    return CircularAffordance(centre, axis, zero, console.KNOB_ORBIT_M, console.KNOB_HEIGHT_M, angle_rad)


def standing(robot: str) -> tuple[Kinematics, np.ndarray]:
    spec = ROBOTS[robot]()
    body, kinematics = Body(spec, Plant(spec.model, BareFloor())), kinematics_of(robot)
    body.load(body.standing())
    rotation, position = body.base()
    return kinematics, kinematics.assemble(rotation, position, kinematics.positions(body.joint_names), body.q())


def resting(robot: str, kinematics: Kinematics, q: np.ndarray) -> np.ndarray:
    rest = q.copy()
    for name, value in rest_of(robot).items():
        rest[kinematics.positions((name,))] = value
    return rest


@pytest.mark.parametrize("robot", ROBOT_NAMES)
def test_gaps_are_those_of_the_physics(robot: str) -> None:
    """The same posture before the same console in both: two independent libraries of distances."""
    settings = DishSettings(layout_id=1, console_jitter_m=0.0, console_jitter_rad=0.0, clutter=(0, 0))
    world = draw_dish_world(lambda _: np.random.default_rng(3), settings)
    spec, kinematics = ROBOTS[robot](), kinematics_of(robot)
    body = Body(spec, Plant(spec.model, DishScenery(world)))
    x, y, yaw = world.console
    turn = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
    zero, _, axis = (tuple(map(float, turn @ np.array(a))) for a in console.wheel_axes())
    hub = turn @ np.array(console.wheel_centre(True)) + [x, y, -console.WALKWAY_HEIGHT_M]
    centre = (float(hub[0]), float(hub[1]), float(hub[2]))
    angle = world.wheel_start_rad[0]
    handle = CircularAffordance(centre, axis, zero, console.KNOB_ORBIT_M, console.KNOB_HEIGHT_M, angle)  # type: ignore[arg-type]
    collisions = Collisions(robot, crank_things(handle, "left"))
    body.load(body.standing())
    data, model, rng = body.plant.data, body.plant.model, np.random.default_rng(5)
    data.qpos[:2] = hub[:2] - turn[:2, 0] * 0.6
    data.qpos[3:7] = [math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)]
    for name in body.upper_names:
        body.plant.set_angle(name, body.plant.angle(name) + rng.normal(0.0, 0.2))
    body.plant.load(body.plant.save())
    rotation, position = body.base()
    q = kinematics.assemble(rotation, position, kinematics.positions(body.joint_names), body.q())
    pin.computeDistances(kinematics.model, kinematics.data, collisions.model, collisions.data, q)
    same = {"wheel": "yawWheelDisc", **{f"console {n}": f"console{n}" for n in range(len(console.BLOCKS))}}
    checked = 0
    for pair, result in zip(collisions.model.collisionPairs, collisions.data.distanceResults, strict=True):
        names = [collisions.model.geometryObjects[i].name for i in (pair.first, pair.second)]
        ids = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, same.get(name, name)) for name in names]
        if min(ids) < 0 or result.min_distance < 0.0:
            continue
        gap_m = mujoco.mj_geomDistance(model, data, ids[0], ids[1], 3.0, np.zeros(6))
        # Both iterate to 1e-6 m; cylinders' rims cost MuJoCo some more.
        assert result.min_distance == pytest.approx(gap_m, abs=1e-4), names
        checked += 1
    assert checked > 200


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("robot", ROBOT_NAMES)
def test_no_posture_round_the_circle_touches_anything(robot: str, side: Side) -> None:
    kinematics, q = standing(robot)
    affordance = wheel(robot, side)
    stance, rest = stance_of(kinematics, q), resting(robot, kinematics, q)
    table = handle_table(robot, side, stance, rest, affordance)
    assert table.usable
    for k, posture in enumerate(table.q[::4]):
        turned = wheel(robot, side, 2 * math.pi * 4 * k / len(table.q))
        # Plans keep 2 cm between arm and trunk; the flange is 26 mm over the knob by the hand's measures.
        assert Collisions(robot, crank_things(turned, side)).nearest(posture).gap_m > 0.015


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("robot", ROBOT_NAMES)
def test_ways_to_and_from_the_handle_keep_clear(robot: str, side: Side) -> None:
    kinematics, q = standing(robot)
    stance, rest = stance_of(kinematics, q), resting(robot, kinematics, q)
    for angle in (0.0, 1.6, 3.1, 4.7):
        affordance = wheel(robot, side, angle)
        collisions = Collisions(robot, crank_things(affordance, side))
        table = handle_table(robot, side, stance, rest, affordance)
        solver = dict(two_stage(kinematics, side, stance, rest))[table.stage]
        over = solver.solve(table.at(angle), circle_of(affordance).place(angle, lift_m=0.1), 40).q
        way = free_way(collisions, q, over, rest, functools.partial(drawn_back, solver, over))
        assert way.touches is None
        np.testing.assert_array_equal(way.q[-1], over)
        assert collisions.along([q, *way.q], 0.005) is None


def test_a_post_in_the_way_is_found_and_walked_round() -> None:
    kinematics, q = standing("atlas")
    q = resting("atlas", kinematics, q)
    stance, solver = stance_of(kinematics, q), dict(two_stage(kinematics, "left", stance_of(kinematics, q), q))["arm"]
    circle = circle_of(wheel("atlas", "left"))
    over = solver.solve(q, circle.place(3.0, lift_m=0.15), 60).q
    halfway = pin.interpolate(kinematics.model, q, over, 0.5)
    post = Thing("post", pin.SE3(np.eye(3), kinematics.tool_pose(halfway, "left")[1]), coal.Sphere(0.03))
    collisions = Collisions("atlas", (post,))
    assert collisions.nearest(q).gap_m > 0.02
    assert collisions.nearest(over).gap_m > 0.02
    found = collisions.along([q, over], 0.0)
    assert found is not None
    assert found[1] == "post"
    straight = free_way(collisions, q, over, q, list)
    assert straight.touches is not None
    # Home, raised by 0.2 m: over the post and in.
    raised = Target(kinematics.tool_pose(q, "left")[1] + [0.0, 0.0, 0.3], circle.place(3.0).approach)
    lifted = ChainIk(kinematics, "left", stance, q, torso=False).solve(q, raised, 60).q
    assert free_way(collisions, q, over, q, lambda: [lifted]).touches is None


def test_tables_are_remembered_whatever_the_angle() -> None:
    kinematics, q = standing("atlas")
    stance = stance_of(kinematics, q)
    forget()
    first = handle_table("atlas", "left", stance, q, wheel("atlas", "left", 1.0))
    assert handle_table("atlas", "left", stance, q, wheel("atlas", "left", 2.0)) is first
    forget()
    again = handle_table("atlas", "left", stance, q, wheel("atlas", "left", 1.0))
    assert again is not first
    assert again.q.tobytes() == first.q.tobytes()


def test_a_robot_without_a_stand_is_named() -> None:
    with pytest.raises(UnknownName, match="valkyrie"):
        crank_stand("asimo")


@pytest.mark.parametrize("robot", ROBOT_NAMES)
def test_an_answer_does_not_depend_on_what_was_asked_before(robot: str) -> None:
    kinematics, q = standing(robot)
    model, rng = kinematics.model, np.random.default_rng(3)
    postures = [pin.integrate(model, q, np.r_[np.zeros(6), rng.normal(0.0, 0.4, model.nv - 6)]) for _ in range(30)]

    def gaps(robot_among: Collisions, order: list[int]) -> dict[int, list[float]]:
        found = {}
        for k in order:
            robot_among.nearest(postures[k])
            found[k] = [result.min_distance for result in robot_among.data.distanceResults]
        return found

    things = crank_things(wheel(robot, "right"), "right")
    forwards = gaps(Collisions(robot, things), list(range(30)))
    assert forwards == gaps(Collisions(robot, things), list(reversed(range(30))))
