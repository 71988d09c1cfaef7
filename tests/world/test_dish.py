"""The scene of SRC task 1: what is drawn, and how the joints move."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from teleop_sim.core.errors import UnknownName
from teleop_sim.core.streams import stream
from teleop_sim.world import console
from teleop_sim.world.dish import DishSignals, add_dish_world
from teleop_sim.world.dish_draw import DishSettings, DishWorld, draw_dish_world


def drawn(seed=1, **settings) -> DishWorld:
    return draw_dish_world(lambda name: stream(seed, 0, name), DishSettings(**settings))


def scene(world, step_s=0.004):
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.compiler.autolimits = False
    add_dish_world(spec, world)
    spec.option.timestep = step_s
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def qpos(model, data, joint):
    return float(data.qpos[model.joint(joint).qposadr[0]])


def test_values_stay_within_their_limits_and_the_same_streams_give_the_same_world():
    for seed in range(40):
        world = drawn(seed)
        assert world == drawn(seed)
        assert all(2.0 <= f <= 3.0 for f in world.wheel_friction_nm)
        assert -1.65 <= world.targets_rad[0] <= 2.20
        assert -0.2 <= world.targets_rad[1] <= 1.25
        assert 0.4 <= world.floor_friction <= 1.0
        assert math.hypot(*world.light.to_sun) == pytest.approx(1.0)
        assert all(abs(a - math.pi) <= 0.5 for a in world.wheel_start_rad)
    assert {drawn(seed).layout_id for seed in range(40)} == {1, 2, 3, 4, 5}


def test_fixing_one_value_leaves_the_others():
    free, fixed = drawn(3), drawn(3, floor_friction=(0.7, 0.7), console_jitter_m=0.0)
    assert fixed.floor_friction == 0.7
    assert replace(fixed, floor_friction=free.floor_friction, console=free.console) == free


def test_an_unknown_layout_is_refused_by_name():
    with pytest.raises(UnknownName, match="unknown name '6'"):
        drawn(layout_id=6)


@pytest.mark.parametrize("layout_id", [1, 2, 3, 4, 5])
def test_the_scene_matches_the_console_data(layout_id):
    world = drawn(layout_id=layout_id)
    _, data = scene(world)
    x, y, yaw = world.console
    turn = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
    for name, left, start in (("yawWheel", True, 0), ("pitchWheel", False, 1)):
        centre = np.array([x, y, -0.1]) + turn @ console.wheel_centre(left)
        assert data.body(name).xpos == pytest.approx(centre, abs=1e-9)
        assert data.body(name).xpos[2] == pytest.approx(0.81)
        knob = np.array([x, y, -0.1]) + turn @ console.knob_centre(left, world.wheel_start_rad[start])
        assert data.geom(f"{name}Knob").xpos == pytest.approx(knob, abs=1e-9)
    # The red yaw wheel is on the left of a robot that faces the console.
    gap = data.body("yawWheel").xpos - data.body("pitchWheel").xpos
    assert turn.T @ gap == pytest.approx([0.0, 0.4, 0.0], abs=1e-9)
    assert data.ncon == 0


def test_turning_a_wheel_clockwise_from_above_is_positive():
    model, data = scene(drawn(layout_id=1))
    centre, before = data.body("yawWheel").xpos.copy(), data.geom("yawWheelKnob").xpos.copy()
    data.qpos[model.joint("yawWheel").qposadr[0]] = 0.1
    mujoco.mj_forward(model, data)
    # Anticlockwise from above is a positive z component of arm x displacement.
    assert np.cross(before - centre, data.geom("yawWheelKnob").xpos - before)[2] < 0.0


def test_a_wheel_holds_below_its_friction_and_turns_above():
    world = drawn(layout_id=1)
    friction = world.wheel_friction_nm[0]
    model, data = scene(world)
    dof = model.joint("yawWheel").dofadr[0]
    data.qfrc_applied[dof] = 0.98 * friction
    for _ in range(2500):
        mujoco.mj_step(model, data)
    # The constraint is soft by 1e-4 of itself: 10 s under load creep less than half a degree of the wheel.
    assert abs(qpos(model, data, "yawWheel")) < 0.01
    data.qfrc_applied[dof] = friction + 0.5
    start, speed = data.time, float(data.qvel[dof])
    for _ in range(50):
        mujoco.mj_step(model, data)
    # Newton: (torque - friction) / inertia about the axis; 1 % for the softness.
    expected = 0.5 / console.WHEEL_INERTIA[2] * (data.time - start)
    assert float(data.qvel[dof]) - speed == pytest.approx(expected, rel=0.01)


def test_the_dish_follows_as_a_first_order_lag():
    model, data = scene(drawn(layout_id=1))
    data.ctrl[model.actuator("dishYaw").id] = 1.0
    while data.time < 1.01:
        mujoco.mj_step(model, data)
    # kp 1000 against damping 1000 + 10: time constant 1.01 s; inertia of 3 kg m2 adds 3 ms: 1 %.
    assert qpos(model, data, "dishYaw") == pytest.approx(1.0 - math.exp(-1.0), rel=0.01)
    data.ctrl[model.actuator("dishPitch").id] = 1.2
    for _ in range(1000):
        mujoco.mj_step(model, data)
    # Weightless: no droop.
    assert qpos(model, data, "dishPitch") == pytest.approx(1.2, abs=1e-6)


def test_the_dish_follows_the_wheels_only_from_checkpoint_1_on():
    signals = DishSignals(yaw_wheel_rad=10.0, pitch_wheel_rad=-5.0, dish_yaw_rad=0.3, dish_pitch_rad=0.1)
    assert signals.values() == {"dish_yaw": 0.3, "dish_pitch": 0.1}
    assert signals.dish_command_rad(0) == (0.0, 0.0)
    # Pitch stops at its joint limit of -0.2.
    assert signals.dish_command_rad(1) == pytest.approx((1.0, -0.2))


def test_a_box_comes_to_rest_on_the_walkway_with_the_drawn_friction():
    world = replace(drawn(layout_id=1), floor_friction=0.5)
    spec = mujoco.MjSpec()
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0
    body = spec.worldbody.add_body(name="sled", pos=[0.0, 0.0, 0.05])
    body.add_freejoint()
    low = [0.01, 0.001, 0.0001]
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.2, 0.2, 0.05], contype=2, conaffinity=1, friction=low, mass=10.0
    )
    add_dish_world(spec, world)
    model = spec.compile()
    data = mujoco.MjData(model)
    for _ in range(100):
        mujoco.mj_step(model, data)
    data.qvel[0] = 1.0
    start = float(data.qpos[0])
    for _ in range(500):
        mujoco.mj_step(model, data)
    # Coulomb: v^2 / (2 mu g) = 0.102 m. The world's friction counts, not the sled's own.
    assert float(data.qpos[0]) - start == pytest.approx(1.0 / (2 * 0.5 * 9.81), rel=0.05)
    # z = 0 is the walkway's surface.
    assert float(data.qpos[2]) == pytest.approx(0.05, abs=2e-3)
