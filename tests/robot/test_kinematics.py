"""The planning model against the physical one, and inverse kinematics against geometry and finite differences."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.robot.body import Body
from teleop_sim.robot.chain_ik import GAP_M, ChainIk, Stance, Target, stance_of, two_stage
from teleop_sim.robot.circle_table import SINK_M, CircleTable, circle_of, circle_table
from teleop_sim.robot.clearance import slope, trunk_gaps
from teleop_sim.robot.commands import CircularAffordance, Side
from teleop_sim.robot.hand import CAGE, tool_in_palm
from teleop_sim.robot.kinematics import Kinematics, kinematics_of
from teleop_sim.robot.templates import rest_of
from teleop_sim.robot.valkyrie import valkyrie
from teleop_sim.world import console
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import Plant

SIDES: tuple[Side, Side] = ("left", "right")


@pytest.fixture(scope="module")
def kinematics() -> Kinematics:
    return kinematics_of("valkyrie")


@pytest.fixture(scope="module")
def body() -> Body:
    spec = valkyrie()
    return Body(spec, Plant(spec.model, BareFloor()))


def felt(body: Body, kinematics: Kinematics) -> np.ndarray:
    rotation, position = body.base()
    return kinematics.assemble(rotation, position, kinematics.positions(body.joint_names), body.q())


@pytest.fixture(scope="module")
def standing(body: Body, kinematics: Kinematics) -> np.ndarray:
    body.load(body.standing())
    return felt(body, kinematics)


def wheel(side: Side, ahead_m: float, aside_m: float, yaw_rad: float, angle_rad: float) -> CircularAffordance:
    """A console's wheel before a robot that stands at the origin; ``aside_m`` outwards from its middle."""
    out = 1.0 if side == "left" else -1.0
    turn = np.array([[math.cos(yaw_rad), -math.sin(yaw_rad), 0], [math.sin(yaw_rad), math.cos(yaw_rad), 0], [0, 0, 1]])
    zero, _, axis = (tuple(float(v) for v in turn @ np.array(a)) for a in console.wheel_axes())
    centre = (ahead_m, out * aside_m, console.WHEEL_HEIGHT_M - console.WALKWAY_HEIGHT_M)
    return CircularAffordance(centre, axis, zero, console.KNOB_ORBIT_M, console.KNOB_HEIGHT_M, angle_rad)  # type: ignore[arg-type]


def plan(
    kinematics: Kinematics, standing: np.ndarray, side: Side, affordance: CircularAffordance, points: int = 48
) -> tuple[CircleTable, Stance]:
    stance = stance_of(kinematics, standing)
    rest = standing.copy()
    for name, value in rest_of("valkyrie").items():
        rest[kinematics.positions((name,))] = value
    return circle_table(kinematics, side, stance, rest, affordance, points), stance


def test_planning_model_and_physics_put_hands_soles_and_mass_in_the_same_places(
    body: Body, kinematics: Kinematics
) -> None:
    rng = np.random.default_rng(4)
    for _ in range(5):
        body.load(body.standing())
        for name in body.joint_names:
            body.plant.set_angle(name, rng.uniform(-0.5, 0.5))
        body.plant.data.qpos[:3] = rng.normal(size=3)
        quat = rng.normal(size=4)
        body.plant.data.qpos[3:7] = quat / np.linalg.norm(quat)
        body.plant.load(body.plant.save())
        q = felt(body, kinematics)
        for side in SIDES:
            rotation, position = kinematics.tool_pose(q, side)
            site = body.plant.site(f"{side}Tcp")
            # Two libraries, one description: only rounding differs (1e-15 m a joint).
            np.testing.assert_allclose(rotation, site.rotation, atol=1e-9)
            np.testing.assert_allclose(position, site.position, atol=1e-9)
        for sole, frame in zip(body.soles(), kinematics.soles, strict=True):
            here = pin.updateFramePlacement(kinematics.model, kinematics.data, frame)
            np.testing.assert_allclose(here.translation, sole.position, atol=1e-9)
        # Open jaws are symmetric about the tool's axis, as the four bars of the planning model are.
        np.testing.assert_allclose(kinematics.centre_of_mass(q), body.com(), atol=1e-9)


def test_total_mass_is_the_robots_and_both_cages(kinematics: Kinematics, body: Body) -> None:
    total_kg = float(body.plant.model.body_subtreemass[1])
    assert pin.computeTotalMass(kinematics.model) == pytest.approx(total_kg, abs=1e-9)
    # 135.9 kg is the published total; two cages come on top. 0.05: it is published to one decimal.
    assert total_kg == pytest.approx(135.9 + 2 * CAGE.mass_kg, abs=0.05)


def test_joints_are_found_by_name_in_any_order(kinematics: Kinematics) -> None:
    names = tuple(reversed(kinematics.joint_names))
    values = np.arange(len(names), dtype=float) / 100
    q = kinematics.assemble(np.eye(3), np.zeros(3), kinematics.positions(names), values)
    np.testing.assert_array_equal(q[7:], values[::-1])


@pytest.mark.parametrize("side", SIDES)
def test_tool_frame_is_right_handed_and_leans_to_the_palms_side(side: Side) -> None:
    _, rotation = tool_in_palm(side)
    np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    assert rotation[0, 2] == pytest.approx(math.sin(CAGE.tilt_rad))


@settings(deadline=None)
@given(angle=st.floats(-3.1, 3.1), left=st.booleans())
def test_the_tool_goes_where_the_console_says_the_knob_is(angle: float, left: bool) -> None:
    zero, _, axis = console.wheel_axes()
    affordance = CircularAffordance(
        console.wheel_centre(left), axis, zero, console.KNOB_ORBIT_M, console.KNOB_HEIGHT_M, 0.0
    )
    circle = circle_of(affordance)
    np.testing.assert_allclose(
        circle.place(angle, lift_m=SINK_M).position, console.knob_centre(left, angle), atol=1e-12
    )
    assert circle.angle_of(circle.place(angle, 0.3).position) == pytest.approx(angle, abs=1e-9)
    step = circle.place(angle + 1e-6).position - circle.place(angle - 1e-6).position
    # Central difference of a circle of 0.123 m: error of order 1e-12 over a step of 2e-6.
    np.testing.assert_allclose(step / 2e-6 / affordance.radius_m, circle.direction(angle), atol=1e-6)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("ahead_m", "aside_m", "yaw_rad"), list(product((0.525, 0.585), (0.25, 0.31), (-0.09, 0.09))))
def test_the_whole_circle_is_reached_from_the_stance(
    kinematics: Kinematics, standing: np.ndarray, side: Side, ahead_m: float, aside_m: float, yaw_rad: float
) -> None:
    affordance = wheel(side, ahead_m, aside_m, yaw_rad, 3.0)
    table, stance = plan(kinematics, standing, side, affordance, points=24)
    assert table.usable
    # The search stops at 0.5 mm a task coordinate.
    assert table.position_error_m < 1e-3
    assert table.axis_error_rad < 0.01
    assert table.limit_margin_rad > 0.0
    # 15 degrees of handle a row: a table that does not close would jump by the size of a redundant motion.
    assert table.seam_rad < 0.45
    # Held to first order. The last move is below 0.02 rad a joint: 0.2 mm are left at 1 m; ten times that.
    for q in table.q:
        kept = stance_of(kinematics, q)
        np.testing.assert_allclose(kept.com, stance.com, atol=2e-3)
        np.testing.assert_allclose(kept.pelvis, stance.pelvis, atol=2e-3)
        for foot, wanted in zip(kept.feet, stance.feet, strict=True):
            np.testing.assert_allclose(foot.translation, wanted.translation, atol=2e-3)
        pin.computeJointJacobians(kinematics.model, kinematics.data, q)
        # The penalty gives way by a millimetre.
        assert min(gap.width_m for gap in trunk_gaps(kinematics, side)) > GAP_M - 0.002


def test_a_wheel_too_far_away_is_refused(kinematics: Kinematics, standing: np.ndarray) -> None:
    table, _ = plan(kinematics, standing, "right", wheel("right", 0.95, 0.28, 0.0, 3.0), points=12)
    assert not table.usable


def test_equal_inputs_give_equal_tables(kinematics: Kinematics, standing: np.ndarray) -> None:
    affordance = wheel("left", 0.555, 0.28, 0.0, 2.7)
    first, _ = plan(kinematics, standing, "left", affordance, points=12)
    plan(kinematics, standing, "right", wheel("right", 0.9, 0.28, 0.0, 2.7), points=12)
    again, _ = plan(kinematics, standing, "left", affordance, points=12)
    assert first.q.tobytes() == again.q.tobytes()


def test_push_torques_do_the_work_of_a_newton_along_the_path(kinematics: Kinematics, standing: np.ndarray) -> None:
    affordance = wheel("right", 0.555, 0.28, 0.0, 3.0)
    table, _ = plan(kinematics, standing, "right", affordance, points=12)
    circle, rng = circle_of(affordance), np.random.default_rng(2)
    for row in (0, 5):
        direction = circle.direction(2 * np.pi * row / 12)
        velocity = rng.normal(size=kinematics.model.nv)
        ends = []
        for h in (1e-6, -1e-6):
            moved = pin.integrate(kinematics.model, table.q[row], h * velocity)
            ends.append(kinematics.tool_pose(moved, "right")[1])
        # Central difference: second order in 1e-6, rounding 1e-10.
        assert table.push[row] @ velocity == pytest.approx(direction @ (ends[0] - ends[1]) / 2e-6, abs=1e-6)


def test_the_table_is_the_same_after_a_turn(kinematics: Kinematics, standing: np.ndarray) -> None:
    table, _ = plan(kinematics, standing, "right", wheel("right", 0.555, 0.28, 0.0, 3.0), points=12)
    for angle in (-2.0, 0.1, 3.3):
        np.testing.assert_allclose(table.at(angle), table.at(angle + 6 * np.pi), atol=1e-9)
    np.testing.assert_array_equal(table.at(0.0), table.q[0])


@pytest.mark.parametrize("side", SIDES)
def test_a_gaps_slope_is_its_derivative(kinematics: Kinematics, standing: np.ndarray, side: Side) -> None:
    chain = kinematics.positions(kinematics.arms[side])
    rng = np.random.default_rng(8)
    q = standing.copy()
    q[chain] += rng.normal(0.0, 0.1, 7)

    def gaps(posture: np.ndarray) -> np.ndarray:
        pin.computeJointJacobians(kinematics.model, kinematics.data, posture)
        return np.array([gap.width_m for gap in trunk_gaps(kinematics, side)])

    assert len(gaps(q)) == 2
    slopes = np.array([slope(kinematics, side, gap) for gap in trunk_gaps(kinematics, side)])
    for k, place in enumerate(chain):
        up, down = q.copy(), q.copy()
        up[place] += 1e-6
        down[place] -= 1e-6
        # Lengths of 1 m over a difference of 2e-6: rounding leaves 1e-10.
        np.testing.assert_allclose(slopes[:, k], (gaps(up) - gaps(down)) / 2e-6, atol=1e-9)


def test_a_small_move_needs_the_arm_alone_and_leaves_the_torso(kinematics: Kinematics, standing: np.ndarray) -> None:
    stance = stance_of(kinematics, standing)
    rotation, position = kinematics.tool_pose(standing, "left")
    target = Target(position + np.array([0.01, 0.0, 0.02]), rotation[:, 2])
    (name, arm), _ = two_stage(kinematics, "left", stance, standing)
    found = arm.solve(standing, target, 40)
    assert name == "arm"
    assert found.within(1e-3, 0.01)
    torso = kinematics.positions(kinematics.torso)
    np.testing.assert_array_equal(found.q[torso], standing[torso])


@settings(deadline=None)
@given(seed=st.integers(0, 50))
def test_joint_limits_hold_wherever_the_hand_is_sent(seed: int) -> None:
    kinematics = kinematics_of("valkyrie")
    rng = np.random.default_rng(seed)
    q = kinematics.assemble(np.eye(3), np.array([0.0, 0.0, 1.0]), kinematics.positions(()), np.zeros(0))
    solver = ChainIk(kinematics, "right", stance_of(kinematics, q), q, torso=True)
    aim = rng.normal(size=3)
    target = Target(rng.uniform(-1.0, 2.0, 3), aim / np.linalg.norm(aim))
    found = solver.solve(q, target, 15)
    assert found.limit_margin_rad > 0.0
    assert np.isfinite(found.q).all()
