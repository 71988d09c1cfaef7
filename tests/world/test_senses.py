"""Force, moment and inertial sensors against statics."""

import mujoco
import numpy as np
import pytest

from teleop_sim.robot.body import Body
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.skill import Tick
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import GRAVITY_M_S2, Plant
from teleop_sim.world.senses import inertial, wrenches


@pytest.fixture(scope="module", params=sorted(ROBOTS))
def body(request):
    spec = ROBOTS[request.param]()
    body = Body(spec, Plant(spec.model, BareFloor()))
    body.load(body.standing())
    for _ in range(150):
        body.tick(Tick(body.posture))
    return body


def test_the_ground_carries_the_weight(body):
    model, data = body.plant.model, body.plant.data
    mujoco.mj_forward(model, data)
    force, up = np.zeros(6), 0.0
    for i in range(data.ncon):
        mujoco.mj_contactForce(model, data, i, force)
        up += force[0]
    assert up == pytest.approx(GRAVITY_M_S2 * model.body_subtreemass[1], rel=1e-3)


def test_ankles_carry_all_but_the_feet(body):
    sole, model = body.spec.model.description.sole, body.plant.model
    felt = wrenches(body.plant, (sole.left, sole.right))
    feet_kg = sum(model.body(name).mass[0] for name in (sole.left, sole.right))
    down = -sum(w.force_n[2] for w in felt)
    # Standing for 3 s: what is left of motion is below a thousandth of the weight.
    assert down == pytest.approx(GRAVITY_M_S2 * (model.body_subtreemass[1] - feet_kg), rel=2e-3)


def test_wrists_carry_their_hands(body):
    palms = tuple(mount.palm for mount in body.spec.model.hands)
    for palm, felt in zip(palms, wrenches(body.plant, palms), strict=True):
        weight = GRAVITY_M_S2 * body.plant.model.body_subtreemass[body.plant.model.body(palm).id]
        assert np.linalg.norm(felt.force_n) == pytest.approx(weight, rel=0.01)


def test_the_inertial_unit_feels_gravity(body):
    felt = inertial(body.plant, body.spec.model.description.root)
    assert np.linalg.norm(felt.force_m_s2) == pytest.approx(GRAVITY_M_S2, rel=2e-3)
    assert felt.force_m_s2[2] > 9.7
    assert np.abs(felt.rate_rad_s).max() < 0.01
