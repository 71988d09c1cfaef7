"""The door and the valve by themselves: latch, gear, friction, closer; and their scores."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.world import door, valve
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.door import Door
from teleop_sim.world.drc_scorer import DOOR_MARKS, VALVE_MARKS, JointScore, door_score, valve_score
from teleop_sim.world.plant import GRAVITY_M_S2
from teleop_sim.world.valve import Valve

PELVIS = np.zeros(7)


def alone(scene: BareFloor) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A scene without a robot, with the plant's options that matter here."""
    spec = mujoco.MjSpec()
    spec.compiler.degree, spec.compiler.autolimits = False, False
    spec.option.timestep, spec.option.gravity = 0.004, [0.0, 0.0, -GRAVITY_M_S2]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone, spec.option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 10.0
    scene.add_to(spec)
    model = spec.compile()
    return model, mujoco.MjData(model)


def held(data: mujoco.MjData, lever: Any, angle_rad: float) -> float:
    """Torque of a servo on the lever that also carries its spring [N m]."""
    spring_nm = Door().spring_nm * (angle_rad + door.PRELOAD_RAD) / (door.SPRING_AT_RAD + door.PRELOAD_RAD)
    return float(40.0 * (angle_rad - data.qpos[lever.qposadr[0]]) - 0.5 * data.qvel[lever.dofadr[0]] + spring_nm)


def pushed(lever_deg: float, push_n: float) -> float:
    """How far the door opens in 2 s with its lever held and a push at the lever."""
    model, data = alone(Door())
    lever, hinge = model.joint("doorLever"), model.joint("doorHinge")
    for step in range(750):
        data.qfrc_applied[lever.dofadr[0]] = held(data, lever, math.radians(lever_deg))
        data.qfrc_applied[hinge.dofadr[0]] = push_n * 0.85 if step > 250 else 0.0
        mujoco.mj_step(model, data)
    return float(data.qpos[hinge.qposadr[0]])


@pytest.mark.parametrize("push_n", [20.0, 150.0])
def test_the_latch_holds_the_door_until_the_lever_is_past_forty_degrees(push_n):
    # 3 degrees either way: 1 mm of the bolt's 20 mm throw over 60 degrees, which its round tip takes.
    assert pushed(0.0, push_n) < math.radians(1.0)
    assert pushed(36.0, push_n) < math.radians(1.0)
    assert pushed(43.0, push_n) > math.radians(10.0)


def test_the_levers_spring_brings_it_back_and_the_bolt_out():
    model, data = alone(Door())
    lever, bolt = model.joint("doorLever"), model.joint("doorBolt")
    data.qpos[lever.qposadr[0]] = math.radians(50.0)
    data.qpos[bolt.qposadr[0]] = -door.BOLT_THROW_M * 50.0 / 60.0
    for _ in range(500):
        mujoco.mj_step(model, data)
    assert abs(data.qpos[lever.qposadr[0]]) < math.radians(1.0)
    assert abs(data.qpos[bolt.qposadr[0]]) < 0.0005


def test_the_bolt_goes_with_the_lever():
    model, data = alone(Door())
    lever, bolt = model.joint("doorLever"), model.joint("doorBolt")
    for _ in range(500):
        data.qfrc_applied[lever.dofadr[0]] = held(data, lever, math.radians(48.0))
        mujoco.mj_step(model, data)
    wanted_m = -door.BOLT_THROW_M * data.qpos[lever.qposadr[0]] / door.LEVER_TRAVEL_RAD
    assert data.qpos[bolt.qposadr[0]] == pytest.approx(wanted_m, abs=0.0003)


def test_a_door_without_closer_stays_and_one_with_it_is_drawn_shut_by_its_weight():
    """Torque at a right angle is m g (width / 2) sin(lean), of panel, lever and bolt together."""
    for lean_rad in (0.0, math.radians(2.0)):
        model, data = alone(Door(closer_rad=lean_rad))
        hinge = model.joint("doorHinge")
        data.qpos[hinge.qposadr[0]] = math.pi / 2
        mujoco.mj_forward(model, data)
        panel = model.body("doorPanel").id
        mass_kg, arm_m = float(model.body_subtreemass[panel]), float(data.subtree_com[panel][0]) - door.HINGE[0]
        origin = Door().place[0]
        torque = mass_kg * GRAVITY_M_S2 * (arm_m - origin) * math.sin(lean_rad)
        assert data.qfrc_bias[hinge.dofadr[0]] == pytest.approx(torque, rel=0.01, abs=1e-9)


@pytest.mark.parametrize(("share", "turns"), [(0.95, False), (1.05, True)])
def test_the_valve_turns_beyond_its_friction_and_not_below(share, turns):
    model, data = alone(Valve(friction_nm=4.0))
    wheel = model.joint("valveWheel")
    for _ in range(1250):
        data.qfrc_applied[wheel.dofadr[0]] = share * 4.0
        mujoco.mj_step(model, data)
    turned = float(data.qpos[wheel.qposadr[0]])
    # Below its friction it creeps by less than a degree in 5 s.
    assert (turned > math.radians(90.0)) if turns else abs(turned) < math.radians(1.0)


def test_the_published_force_at_the_rim_is_within_what_is_drawn():
    """5 lbf at the edge of the wheel."""
    edge_nm = 5 * 4.448222 * valve.RADIUS_M
    assert edge_nm == pytest.approx(4.0, abs=0.01)


def test_spokes_stand_where_the_start_angle_says():
    model, data = alone(Valve(start_rad=0.4))
    mujoco.mj_forward(model, data)
    middle = data.geom("valveSpoke1").xpos - np.array(Valve().place)
    wanted = valve.on_wheel(0.4 + math.pi / 2, valve.RADIUS_M / 2)
    np.testing.assert_allclose(middle, wanted, atol=1e-9)


def test_scores_know_their_joints():
    names = ("a", "doorHinge", "valveWheel")
    assert door_score(names).joint == 1
    assert valve_score(names).joint == 2


def test_marks_are_passed_in_order_and_stay():
    score = JointScore(0, VALVE_MARKS)
    score, seen = score.at(0.0, PELVIS, np.array([math.radians(200.0)]))
    assert [number for number, _ in seen] == [1, 2]
    score, seen = score.at(1.0, PELVIS, np.array([0.0]))
    assert score.checkpoint == 2
    assert seen == ()


@given(st.lists(st.floats(-0.1, 1.6), min_size=1, max_size=30), st.integers(0, len(DOOR_MARKS)))
def test_quiet_samples_change_nothing_and_the_next_one_does(angles, passed):
    score = JointScore(0, DOOR_MARKS, passed)
    joints = np.array(angles)[:, None]
    quiet = score.quiet(np.arange(len(angles)), np.zeros((len(angles), 7)), joints)
    for k in range(quiet):
        assert score.at(0.0, PELVIS, joints[k]) == (score, ())
    if quiet < len(angles):
        assert score.at(0.0, PELVIS, joints[quiet])[1]
