"""Optimised paths of torso and arm: expressions against Pinocchio, constraints against the path found."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin
import pytest

from teleop_sim.robot.arm_chain import Chain, casadi, outputs
from teleop_sim.robot.arm_path import LIMIT_RAD, MOVE_S, POINTS, RATE_RAD_S, TORQUE_SHARE, ArmPath, optimise
from teleop_sim.robot.body import Body
from teleop_sim.robot.chain_ik import ChainIk, Target, stance_of
from teleop_sim.robot.collision import Collisions
from teleop_sim.robot.crank_scene import Thing
from teleop_sim.robot.kinematics import Kinematics, kinematics_of
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.templates import rest_of
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import GRAVITY_M_S2, Plant


def standing(robot: str) -> tuple[Kinematics, np.ndarray]:
    spec = ROBOTS[robot]()
    body, kinematics = Body(spec, Plant(spec.model, BareFloor())), kinematics_of(robot)
    body.load(body.standing())
    rotation, position = body.base()
    return kinematics, kinematics.assemble(rotation, position, kinematics.positions(body.joint_names), body.q())


@pytest.mark.parametrize("robot", ["atlas", "valkyrie"])
def test_the_chains_expressions_are_pinocchios(robot: str) -> None:
    kinematics, q = standing(robot)
    ca, chain, rng = casadi(), Chain(kinematics, ROBOTS[robot](), "left", q), np.random.default_rng(4)
    point = np.array([2.0, 0.3, 0.4])
    ball = (Thing("ball", pin.SE3(np.eye(3), point), coal.Sphere(0.1)),)
    joints, base = ca.SX.sym("q", len(chain.chain)), ca.SX.sym("base", 3)
    one = ca.Function("one", [joints, base], list(outputs(chain, joints, base, ball)))
    moved = q.copy()
    moved[chain.chain] += rng.normal(0.0, 0.3, len(chain.chain))
    com, torque, clear = (np.array(value).ravel() for value in one(moved[chain.chain], moved[:3]))
    model, data = kinematics.model, kinematics.data
    # With the pelvis where it was, the middle of everything is exact.
    np.testing.assert_allclose(com, pin.centerOfMass(model, data, moved), atol=1e-9)
    gravity = pin.computeGeneralizedGravity(model, data, moved)[chain.chain - 1]
    assert model.gravity.linear[2] == pytest.approx(-GRAVITY_M_S2)
    np.testing.assert_allclose(torque, gravity, atol=1e-6)
    # The last ball of this arm's own is round the tool, 2 cm beyond its origin: its distance over the sum of radii.
    pin.forwardKinematics(model, data, moved)
    tool = pin.updateFramePlacement(model, data, kinematics.tools["left"]).act(np.array([0.0, 0.0, 0.02]))
    wanted = np.linalg.norm(tool - point) / (0.1 + 0.07 + 0.015)
    assert np.abs(clear - wanted).min() < 1e-6


@pytest.fixture(scope="module")
def past_a_post() -> tuple[Kinematics, np.ndarray, ArmPath, ChainIk, Collisions]:
    """Atlas' left hand to a place behind a post that stands where the straight way leads."""
    kinematics, q = standing("atlas")
    for name, value in rest_of("atlas").items():
        q[kinematics.positions((name,))] = value
    solver = ChainIk(kinematics, "left", stance_of(kinematics, q), q, torso=True)
    hand = kinematics.tool_pose(q, "left")
    goal = solver.solve(q, Target(hand[1] + [0.05, -0.35, 0.25], hand[0][:, 2]), 60)
    assert goal.within(0.002, 0.05)
    halfway = pin.interpolate(kinematics.model, q, goal.q, 0.5)
    post = (Thing("post", pin.SE3(np.eye(3), kinematics.tool_pose(halfway, "left")[1]), coal.Sphere(0.04)),)
    path = optimise(kinematics, ROBOTS["atlas"](), "left", q, goal.q, goal.q, post)
    return kinematics, q, path, solver, Collisions("atlas", post)


def test_a_path_round_a_post_is_found_where_the_straight_one_hits(
    past_a_post: tuple[Kinematics, np.ndarray, ArmPath, ChainIk, Collisions],
) -> None:
    _, start, path, solver, collisions = past_a_post
    assert path.solved
    assert collisions.along([start, path.q[-1]], 0.0) is not None
    assert collisions.along([start, *(solver.settle(q) for q in path.q)], 0.005) is None


def test_a_path_keeps_limits_speeds_and_torques(
    past_a_post: tuple[Kinematics, np.ndarray, ArmPath, ChainIk, Collisions],
) -> None:
    kinematics, start, path, _, _ = past_a_post
    names = (*kinematics.torso, *kinematics.arms["left"])
    places = kinematics.positions(names)
    joints = np.array([start, *path.q])[:, places]
    inner = joints[1:-1]
    # 1e-4 is what the solver may leave of each constraint.
    assert (inner >= kinematics.lower[places - 7] + LIMIT_RAD - 1e-4).all()
    assert (inner <= kinematics.upper[places - 7] - LIMIT_RAD + 1e-4).all()
    assert np.abs(np.diff(joints, axis=0)).max() <= RATE_RAD_S * MOVE_S / (POINTS + 1) + 1e-4
    effort = [ROBOTS["atlas"]().model.description.joint(name).effort_nm for name in names]
    for q in path.q:
        gravity = pin.computeGeneralizedGravity(kinematics.model, kinematics.data, q)[places - 1]
        assert (np.abs(gravity) <= (TORQUE_SHARE + 1e-3) * np.array(effort)).all()


def test_what_cannot_be_reached_is_not_called_solved() -> None:
    kinematics, q = standing("atlas")
    far = q.copy()
    # Further than nine instants at full speed lead.
    far[kinematics.positions(("l_arm_uwy",))] += 2 * RATE_RAD_S * MOVE_S
    assert not optimise(kinematics, ROBOTS["atlas"](), "left", q, far, q, ()).solved
