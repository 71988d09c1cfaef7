"""Forces at ankles and wrists and the inertial unit: against statics, and against MuJoCo's own sensors."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
import pytest

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Walk
from teleop_sim.robot.episode import NoiseKey, perform
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.senses import Senses, feel
from teleop_sim.robot.skill import Tick
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.disturbances import CALM, Disturbances, Payload
from teleop_sim.world.plant import GRAVITY_M_S2, Plant

NAMES = sorted(ROBOTS)
KEY = NoiseKey(1, 0, 1)
LOAD_KG, LOAD_AT_M = 0.8, np.array([0.02, -0.05, 0.03])
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Instrumented(BareFloor):
    """A floor, and MuJoCo's own sensors in the robot that stands on it."""

    feet: tuple[str, str] = ("", "")
    root: str = ""

    def add_to(self, spec: mujoco.MjSpec) -> None:
        super().add_to(spec)
        site, kind = mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtSensor
        for foot in self.feet:
            spec.add_sensor(name=f"{foot}_f", type=kind.mjSENS_FORCE, objtype=site, objname=f"{foot}_sole")
            spec.add_sensor(name=f"{foot}_t", type=kind.mjSENS_TORQUE, objtype=site, objname=f"{foot}_sole")
        spec.body(self.root).add_site(name="unit")
        spec.add_sensor(name="unit_a", type=kind.mjSENS_ACCELEROMETER, objtype=site, objname="unit")
        spec.add_sensor(name="unit_g", type=kind.mjSENS_GYRO, objtype=site, objname="unit")


def standing(name: str, what: Disturbances = CALM) -> Body:
    """At rest: 3 s after it was put down."""
    spec = ROBOTS[name]()
    description = spec.model.description
    feet = (description.sole.left, description.sole.right)
    scenery = Instrumented(feet=feet, root=description.root)
    body = Body(spec, Plant(spec.model, scenery, disturbances=what))
    body.load(body.standing())
    for _ in range(150):
        body.tick(Tick(body.posture))
    return body


@pytest.fixture(scope="module", params=NAMES)
def still(request) -> tuple[Body, Senses]:
    body = standing(request.param)
    return body, feel(body)


def axes(body: Body, link: str) -> np.ndarray:
    return body.plant.data.body(link).xmat.reshape(3, 3).copy()


def test_feet_carry_everything_but_themselves(still):
    body, felt = still
    model, sole = body.plant.model, body.spec.model.description.sole
    feet = (sole.left, sole.right)
    carried_kg = model.body_subtreemass[1] - sum(model.body(name).mass[0] for name in feet)
    total = sum(axes(body, name) @ wrench.force_n for name, wrench in zip(feet, felt.feet, strict=True))
    # At rest to a thousandth, as the ground's force is; sideways the feet push against each other.
    assert total[2] == pytest.approx(-GRAVITY_M_S2 * carried_kg, rel=1e-3)
    assert np.abs(total[:2]).max() < 1e-3 * GRAVITY_M_S2 * carried_kg
    assert all(wrench.force_n[2] < -0.3 * GRAVITY_M_S2 * carried_kg for wrench in felt.feet)


def test_a_wrist_carries_its_hand(still):
    body, felt = still
    model, data = body.plant.model, body.plant.data
    for mount in body.spec.model.hands:
        palm = model.body(mount.palm).id
        turned, wrench = axes(body, mount.palm), felt.wrists[mount.side]
        weight = GRAVITY_M_S2 * model.body_subtreemass[palm] * UP
        lever = data.subtree_com[palm] - data.xpos[palm]
        # The wrist holds the hand up: equal and opposite to its weight, and to its weight's moment. What is left of
        # motion (0.01 rad/s) is some hundredths of a newton.
        assert turned @ wrench.force_n == pytest.approx(weight, abs=0.01 * weight[2])
        assert turned @ wrench.moment_nm == pytest.approx(np.cross(lever, weight), abs=0.01 * weight[2] * 0.1)


@pytest.mark.parametrize("name", NAMES)
def test_a_mass_in_the_hand_is_felt_at_the_wrist_with_its_lever(name):
    palm = ROBOTS[name]().model.hands[0].palm
    held = Payload(palm, LOAD_KG, (float(LOAD_AT_M[0]), float(LOAD_AT_M[1]), float(LOAD_AT_M[2])), known=True)
    empty, loaded = standing(name), standing(name, Disturbances(payload=held))
    side = empty.spec.model.hands[0].side
    # The arm sags a little: compare in the world's axes.
    before, after = (feel(body).wrists[side] for body in (empty, loaded))
    more_n = axes(loaded, palm) @ after.force_n - axes(empty, palm) @ before.force_n
    weight = LOAD_KG * GRAVITY_M_S2 * UP
    assert more_n == pytest.approx(weight, abs=0.01 * weight[2])
    # Its moment about the wrist, beside that of the hand where it now is.
    model, data = empty.plant.model, loaded.plant.data
    hand_kg = model.body_subtreemass[model.body(palm).id]
    at = empty.plant.data.subtree_com[model.body(palm).id] - empty.plant.data.body(palm).xpos
    hand_at = axes(loaded, palm) @ axes(empty, palm).T @ at
    expected = np.cross(hand_at, hand_kg * GRAVITY_M_S2 * UP) + np.cross(axes(loaded, palm) @ LOAD_AT_M, weight)
    assert axes(loaded, palm) @ after.moment_nm == pytest.approx(expected, abs=0.02)
    assert data.qvel == pytest.approx(np.zeros_like(data.qvel), abs=0.02)


def test_the_inertial_unit_feels_gravity_and_no_turning(still):
    body, felt = still
    root = body.spec.model.description.root
    assert axes(body, root) @ felt.pelvis.force_m_s2 == pytest.approx(GRAVITY_M_S2 * UP, abs=0.01)
    assert np.abs(felt.pelvis.rate_rad_s).max() < 1e-3


def test_in_free_fall_it_feels_nothing():
    spec = ROBOTS["thormang3"]()
    body = Body(spec, Plant(spec.model, BareFloor()))
    body.plant.data.qpos[2] += 5.0
    # Limp: what the servos do would shake the pelvis.
    body.plant.model.actuator_forcerange[:] = 0.0
    for _ in range(3):
        body.plant.begin_tick()
        body.plant.end_tick()
    assert np.abs(feel(body).pelvis.force_m_s2).max() < 0.2
    assert max(np.abs(wrench.force_n).max() for wrench in feel(body).feet) < 0.5


@pytest.mark.parametrize("name", NAMES)
def test_readings_in_mid_walk_are_those_of_mujocos_own_sensors(name):
    body = standing(name)
    perform(body, Walk(((0.6, 0.0, 0.0),)), body.standing(), KEY, until_s=2.6)
    felt, plant = feel(body), body.plant
    sole = body.spec.model.description.sole
    weight_n = GRAVITY_M_S2 * plant.model.body_subtreemass[1]
    for foot, wrench in zip((sole.left, sole.right), felt.feet, strict=True):
        force_n, moment_nm = plant.sensor(f"{foot}_f"), plant.sensor(f"{foot}_t")
        # MuJoCo's site lies under the sole.
        lever = plant.model.site(f"{foot}_sole").pos
        assert wrench.force_n == pytest.approx(force_n, abs=1e-3 * weight_n)
        assert wrench.moment_nm == pytest.approx(moment_nm + np.cross(lever, force_n), abs=1e-4 * weight_n)
    assert felt.pelvis.force_m_s2 == pytest.approx(plant.sensor("unit_a"), abs=0.02)
    # Rates are those after the step, MuJoCo's those before it.
    assert felt.pelvis.rate_rad_s == pytest.approx(plant.sensor("unit_g"), abs=0.01)


def test_feeling_changes_nothing():
    body = standing("valkyrie")
    before = body.save()
    feel(body)
    assert body.save() == before
