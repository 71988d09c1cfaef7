"""The robot's body and its control law against independent computations."""

import mujoco
import numpy as np
import pytest

from teleop_sim.robot import law, law_math
from teleop_sim.robot.body import Body
from teleop_sim.robot.skill import Tick
from teleop_sim.robot.valkyrie import valkyrie
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import Plant


@pytest.fixture(scope="module")
def body():
    spec = valkyrie()
    return Body(spec, Plant(spec.model, BareFloor()))


def test_the_robot_weighs_what_the_paper_says_without_its_fingers_lost(body):
    hands = sum(mount.hand.mass_kg for mount in body.spec.model.hands)
    # 135.2 kg in Table I of the paper, 135.9 kg in the published model.
    assert body.plant.model.body_subtreemass[1] - hands == pytest.approx(135.9, abs=0.01)


def test_it_stands_with_soles_flat_and_weight_between_them(body):
    body.load(body.standing())
    left, right = body.soles()
    assert left.position[2] == pytest.approx(right.position[2], abs=1e-9)
    assert abs(left.position[2]) < 1e-3
    middle = (left.position + right.position) / 2
    # Bisection on the hips stops at 1e-9 rad; the left and right halves of the robot differ by some millimetres.
    assert body.com()[0] == pytest.approx(middle[0], abs=1e-6)
    assert body.com()[1] == pytest.approx(middle[1], abs=0.01)


def test_actuators_stand_in_the_order_of_the_degrees_of_freedom(body):
    model = body.plant.model
    for k in range(body.plant.nv_robot - 6):
        assert model.actuator_trnid[k, 0] == model.dof_jntid[6 + k]


def test_solve_agrees_with_lapack():
    rng = np.random.default_rng(0)
    for _ in range(50):
        A, b = rng.normal(size=(6, 6)), rng.normal(size=(6, 4))
        x = b.copy()
        law_math.solve(A.copy(), x)
        assert x == pytest.approx(np.linalg.solve(A, b), rel=1e-6, abs=1e-6)


def _moving(body, seed):
    """A standing robot pushed off its pose, all joints moving."""
    rng = np.random.default_rng(seed)
    body.load(body.standing())
    data = body.plant.data
    data.qpos[7:] += rng.normal(0, 0.05, len(data.qpos) - 7)
    data.qvel[:] = rng.normal(0, 0.1, len(data.qvel))
    mujoco.mj_step1(body.plant.model, data)
    return data


@pytest.mark.parametrize("seed", range(5))
def test_the_laws_wrenches_carry_the_base_and_its_accelerations_hold_the_soles(body, seed):
    """M qdd + h on the base equals the soles' wrenches through MuJoCo's own Jacobians; soles decelerate as asked."""
    data, model = _moving(body, seed), body.plant.model
    a, g, memory = body._arrays, body._gains, body._memory
    nv = body.plant.nv_robot
    zero = np.zeros(nv - 6)
    velocity = law.com_velocity(a, g.mass_kg)
    body.set_stand()
    left = law.centre_of_pressure(body.stand, g, memory, a, velocity)
    Jl, R = np.empty((2, 6, 6)), law_math.base_rotation(a.qpos)
    qref = data.qpos[a.qposadr[6:]].copy()
    qdd = law.accelerations(body.stand, g, memory, a, qref, zero, velocity, Jl, R)
    full, force = np.zeros(model.nv), np.zeros(model.nv)
    full[:nv] = qdd
    mujoco.mj_mulM(model, data, force, full)
    tau = force[:nv] + data.qfrc_bias[:nv]
    wrenches = law.foot_wrenches(body.stand, g, a, tau, R, left)
    carried = np.zeros(model.nv)
    jacobians = []
    for i, foot in enumerate(("leftFoot", "rightFoot")):
        jp, jr = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacSite(model, data, jp, jr, model.site(f"{foot}_sole").id)
        carried += jp.T @ wrenches[i, :3] + jr.T @ wrenches[i, 3:]
        jacobians.append(np.vstack([jp, jr]))
    assert carried[:6] == pytest.approx(tau[:6], abs=1e-6)
    # The drift of a sole (J' qvel) by a finite difference of MuJoCo's Jacobian along the motion: error of order 1e-6.
    qpos, step = data.qpos.copy(), 1e-6
    mujoco.mj_integratePos(model, data.qpos, data.qvel, step)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    for i, foot in enumerate(("leftFoot", "rightFoot")):
        jp, jr = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacSite(model, data, jp, jr, model.site(f"{foot}_sole").id)
        drift = (np.vstack([jp, jr]) - jacobians[i]) / step @ data.qvel
        speed = jacobians[i] @ data.qvel
        assert jacobians[i][:, :nv] @ qdd + drift == pytest.approx(-g.stance_damping * speed, abs=2e-3)
    data.qpos[:] = qpos


def test_the_centre_of_pressure_never_leaves_the_soles(body):
    rng = np.random.default_rng(1)
    body.load(body.standing())
    a, g, memory = body._arrays, body._gains, body._memory
    for _ in range(200):
        row = body.stand.copy()
        row[law.XI : law.XI + 2] += rng.normal(0, 0.3, 2)
        row[law.STANCE] = rng.integers(3)
        law.centre_of_pressure(row, g, memory, a, rng.normal(0, 0.5, 3))
        x, y = memory[law.COP], memory[law.COP + 1]
        half = np.array([g.half_length_m, g.half_width_m])
        low, high = a.sole[:, :2].min(0) - half, a.sole[:, :2].max(0) + half
        assert low[0] <= x <= high[0]
        assert low[1] <= y <= high[1]


def test_arms_follow_their_reference(body):
    body.load(body.standing())
    goal = body.posture.copy()
    goal[body.upper_names.index("rightElbowPitch")] += 0.3
    start = body.posture.copy()
    for k in range(100):
        assert body.tick(Tick(start + (goal - start) * min(1.0, k / 50)))
    # 0.05 rad is what soft wrists and gravity leave in trials; the controller has no integral term.
    assert np.abs(body.upper() - goal).max() < 0.05


def test_hands_open_and_close(body):
    body.load(body.standing())
    for _ in range(50):
        body.tick(Tick(body.posture, jaws=(1.0, 0.0)))
    stroke = body.spec.model.hands[0].hand.parts[0].drive.upper
    assert body.jaw_gap("left") == pytest.approx((stroke, stroke), abs=1e-3)
    assert body.jaw_gap("right") == pytest.approx((0.0, 0.0), abs=1e-3)
