"""Lines, circles and screws: their geometry, their tables, and what a hand does with them in the physics."""

from __future__ import annotations

import importlib.util
import math
import pickle
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.core.errors import BadInput
from teleop_sim.core.fingerprint import fingerprint
from teleop_sim.robot.affordance import (
    Affordance,
    Usability,
    cross,
    felt,
    metres_per_unit,
    moved,
    rotated,
    strokes,
    turned,
)
from teleop_sim.robot.affordance import course as course_of
from teleop_sim.robot.affordance_table import (
    REFUSE_POSITION_M,
    MotionTable,
    Way,
    motion_table,
    with_tool,
)
from teleop_sim.robot.axis_fit import SEAT_M, axis_fit
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Act
from teleop_sim.robot.episode import NoiseKey, perform
from teleop_sim.robot.kinematics import kinematics_of
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.skill import Tick
from teleop_sim.robot.skills.manipulate import Arm, arm_of, plan_stance, rest_posture
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.bench_scene import Bench
from teleop_sim.world.plant import Plant

NAMES = sorted(ROBOTS)
LINE = Affordance("linear", (-1.0, 0.0, 0.0))
WHEEL = Affordance("circular", (0.0, 0.6, 0.8), (0.5, 0.2, 0.9))
SCREW = Affordance("screw", (0.0, 0.6, 0.8), (0.5, 0.2, 0.9), pitch_m=0.012)
KINDS = [LINE, WHEEL, SCREW]
POINT = np.array([0.6, 0.25, 0.95])
small = st.floats(-1.0, 1.0)


# Geometry -------------------------------------------------------------------------------------------------------------


@given(st.tuples(small, small, small), st.floats(-10.0, 10.0))
def test_rotation_agrees_with_pinocchio(vector: tuple[float, float, float], angle: float) -> None:
    axis = np.array(WHEEL.axis)
    assert rotated(axis, angle, np.array(vector)) == pytest.approx(pin.exp3(angle * axis) @ np.array(vector), abs=1e-12)
    assert cross(axis, np.array(vector)) == pytest.approx(np.cross(axis, np.array(vector)), abs=1e-15)


def test_a_screw_goes_one_pitch_a_turn_and_a_wheel_none() -> None:
    for affordance in (WHEEL, SCREW):
        there = moved(affordance, 3 * 2 * math.pi, POINT)
        assert there - POINT == pytest.approx(3 * affordance.pitch_m * np.array(affordance.axis), abs=1e-12)


@given(st.sampled_from(KINDS), st.floats(-15.0, 15.0), st.floats(-2.5, 2.5))
def test_the_amount_is_read_off_the_place(affordance: Affordance, amount: float, lead: float) -> None:
    # Any guess within half a turn tells which of the turns it is.
    there = moved(affordance, amount, POINT)
    read, off = felt(affordance, POINT, there, amount + lead)
    assert read == pytest.approx(amount, abs=1e-9)
    assert np.linalg.norm(off) < 1e-9


@given(st.sampled_from(KINDS), st.floats(-6.0, 6.0))
def test_course_and_length_are_the_slope_of_the_path(affordance: Affordance, amount: float) -> None:
    # Central differences: their error is h^2/6 of the third derivative, under 1e-9 here.
    h = 1e-4
    slope = (moved(affordance, amount + h, POINT) - moved(affordance, amount - h, POINT)) / (2 * h)
    found = metres_per_unit(affordance, POINT) * course_of(affordance, amount, POINT)
    assert found == pytest.approx(slope, abs=1e-8)


def test_the_hand_turns_with_the_thing_unless_told_otherwise() -> None:
    pointing = np.array([1.0, 0.0, 0.0])
    assert turned(LINE, 0.3, pointing) is pointing
    assert turned(replace(WHEEL, keep_orientation=True), 0.3, pointing) is pointing
    assert turned(WHEEL, 0.3, pointing) == pytest.approx(rotated(np.array(WHEEL.axis), 0.3, pointing))


@given(st.floats(-30.0, 30.0), st.floats(0.01, 10.0))
def test_strokes_add_up_and_keep_within_reach(amount: float, reach: float) -> None:
    cut = strokes(WHEEL, amount, reach)
    assert sum(cut) == pytest.approx(amount, abs=1e-9)
    assert all(0.0 < stroke * math.copysign(1.0, amount) <= reach * (1 + 1e-6) for stroke in cut)
    # As few as can be.
    assert len(cut) <= abs(amount) / reach + 1


@pytest.mark.parametrize(
    "make",
    [
        lambda: Affordance("linear", (1.0, 1.0, 0.0)),
        lambda: Affordance("screw", (1.0, 0.0, 0.0)),
        lambda: Affordance("circular", (1.0, 0.0, 0.0), pitch_m=0.1),
        lambda: Affordance("linear", (1.0, 0.0, 0.0), extent=(0.1, 0.2)),
        lambda: Usability("bit", (0.0, 0.0, 0.1), (0.0, 0.0, 2.0)),
        lambda: strokes(LINE, 0.2, 0.0),
        lambda: strokes(replace(LINE, extent=(0.0, 0.1)), 0.2, 1.0),
    ],
)
def test_what_is_no_motion_is_refused(make) -> None:
    with pytest.raises(BadInput) as refused:
        make()
    assert pickle.loads(pickle.dumps(refused.value)).problems == refused.value.problems
    assert refused.value.problems[0].hint


def test_a_command_is_a_value() -> None:
    bit = Usability("bit", (0.0, 0.0, 0.2))
    assert fingerprint(Act("left", SCREW, 1.0, bit)) == fingerprint(Act("left", replace(SCREW), 1.0, replace(bit)))
    assert fingerprint(Act("left", SCREW, 1.0)) != fingerprint(Act("left", WHEEL, 1.0))


# Learning the axis ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("affordance", [WHEEL, SCREW])
def test_the_axis_is_learned_from_the_way(affordance: Affordance) -> None:
    """A believed axis 4 cm off; the hand goes truly round by three quarters of a turn."""
    off = 0.04 * cross(np.array(affordance.axis), np.array([1.0, 0.0, 0.0]))
    origin = np.array(affordance.origin) + off
    fit = axis_fit(replace(affordance, origin=tuple(origin.tolist())), POINT)
    amount = 0.0
    for true in np.linspace(0.0, 1.5 * math.pi, 200):
        place = moved(affordance, float(true), POINT)
        amount, _ = fit.felt(place, amount)
        fit = fit.seen(place, amount)
    left = np.array(fit.now.origin) - np.array(affordance.origin)
    # The prior pulls by (noise / prior)^2 / (places x mean slope^2): 2 % / 60 of 4 cm.
    assert np.linalg.norm(left) < 0.001
    # What is left is the angle lost before the handle's seat: 3 cm of way at a radius that is wrong by a fifth.
    wrong = SEAT_M * 0.04 / metres_per_unit(affordance, POINT) ** 2
    assert amount == pytest.approx(1.5 * math.pi, abs=wrong)


def test_a_line_teaches_nothing() -> None:
    fit = axis_fit(LINE, POINT)
    assert fit.seen(POINT + 0.3, 0.1) is fit


# Tables ---------------------------------------------------------------------------------------------------------------


def stand_still(name: str) -> Arm:
    spec = ROBOTS[name]()
    body = Body(spec, Plant(spec.model, BareFloor()))
    body.load(body.standing())
    for _ in range(25):
        body.tick(Tick(body.posture))
    body.set_stand()
    return arm_of(body, "left")


@pytest.fixture(scope="module", params=NAMES)
def planned(request) -> tuple[Arm, Way, MotionTable]:
    """A screw round a hub 6 cm to the right of where the hand is."""
    arm = stand_still(request.param)
    return arm, *plan(arm, 0.06)


def plan(arm: Arm, aside_m: float, amount: float = math.pi) -> tuple[Way, MotionTable]:
    now, stance = plan_stance(arm)
    rotation, position = arm.kinematics.tool_pose(now, "left")
    axis = -rotation[:, 2]
    hub = position - aside_m * rotation[:, 0]
    affordance = Affordance("screw", tuple(axis.tolist()), tuple(hub.tolist()), pitch_m=0.01)
    way = Way(affordance, amount, position, rotation[:, 2])
    return way, motion_table(arm.kinematics, "left", stance, rest_posture(arm, stance), now, way)


def test_a_table_takes_the_tool_along_the_screw(planned: tuple[Arm, Way, MotionTable]) -> None:
    arm, way, table = planned
    assert table.usable
    assert table.reach == pytest.approx(math.pi)
    for amount, q in zip(table.amounts, table.q, strict=True):
        if 0.0 <= amount <= way.amount:
            rotation, position = arm.kinematics.tool_pose(q, "left")
            assert np.linalg.norm(position - way.at(amount).position) <= table.position_error_m + 1e-9
            assert math.acos(min(1.0, rotation[:, 2] @ way.pointing)) <= table.axis_error_rad + 1e-6


def test_push_is_virtual_work_and_aside_moves_the_tool(planned: tuple[Arm, Way, MotionTable]) -> None:
    arm, _, table = planned
    model, k = arm.kinematics.model, len(table.q) // 2
    q, base = table.q[k], arm.kinematics.tool_place(table.q[k], "left").copy()
    joint = int(arm.kinematics.positions(arm.kinematics.arms["left"])[1]) - 1
    step = np.zeros(model.nv)
    step[joint] = 1e-6
    change = arm.kinematics.tool_place(pin.integrate(model, q, step), "left") - base
    assert table.push[k, :, joint] == pytest.approx(change / 1e-6, abs=1e-5)
    for i in range(3):
        change = arm.kinematics.tool_place(pin.integrate(model, q, 0.01 * table.aside[k, i]), "left") - base
        # Damping leaves up to a tenth undone, and 1 cm is not small against an elbow's curve.
        assert change == pytest.approx(0.01 * np.eye(3)[i], abs=0.0025)


def test_out_of_reach_is_said_with_how_far_the_arm_goes() -> None:
    arm = stand_still("valkyrie")
    now, stance = plan_stance(arm)
    rotation, position = arm.kinematics.tool_pose(now, "left")
    way = Way(replace(LINE, axis=(1.0, 0.0, 0.0)), 1.5, position, rotation[:, 2])
    table = motion_table(arm.kinematics, "left", stance, rest_posture(arm, stance), now, way)
    assert not table.usable
    assert table.position_error_m > REFUSE_POSITION_M
    assert 0.1 < table.reach < 1.0
    # A stroke as long as what was told is in reach; only the start of it is asked for, so its rows are others.
    shorter = replace(way, amount=0.9 * table.reach)
    assert motion_table(arm.kinematics, "left", stance, rest_posture(arm, stance), now, shorter).usable


def test_a_usability_takes_the_place_of_the_hand() -> None:
    plain = kinematics_of("atlas")
    before = plain.model.nframes
    bit = Usability("bit", (0.01, -0.02, 0.2), (0.6, 0.0, 0.8))
    tool = with_tool(plain, "left", bit)
    q = pin.neutral(plain.model)
    rotation, position = plain.tool_pose(q, "left")
    turned_to, place = tool.tool_pose(q, "left")
    assert place == pytest.approx(position + rotation @ np.array(bit.position), abs=1e-12)
    assert turned_to[:, 2] == pytest.approx(rotation @ np.array(bit.pointing), abs=1e-12)
    assert plain.model.nframes == before
    assert tool.tools["right"] == plain.tools["right"]


# In the physics -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    """The benchmark, which no import finds."""
    path = Path(__file__).parents[2] / "benchmarks" / "affordance_study.py"
    spec = importlib.util.spec_from_file_location("affordance_study_under_test", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    # A dataclass looks up its module by name.
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


@pytest.mark.parametrize(("robot", "thing"), [*((name, "slide") for name in NAMES), ("thormang3", "wheel")])
def test_a_thing_is_moved_as_far_as_asked(study: ModuleType, robot: str, thing: str) -> None:
    trial = study.tried(study.Setting(robot, thing), 1)
    assert trial.done, trial
    # What is felt is the hand; the handle has 2 mm of play in it.
    metres = 1.0 if thing == "slide" else 0.123
    assert abs(trial.felt - trial.true) * metres < 0.004
    # The wrist feels the friction and little else: jerks of a soft arm at the start, and half of it sideways.
    assert trial.resist_n * 0.95 < trial.peak_n < trial.resist_n * 1.5 + 8.0


def test_a_screw_goes_two_turns_with_a_wrong_template(study: ModuleType) -> None:
    trial = study.tried(study.Setting("valkyrie", "screw", error_m=0.02), 1)
    assert trial.done, trial
    assert trial.aside_m > 0.005


def test_a_wheel_is_turned_in_strokes_with_a_new_grip_each(study: ModuleType) -> None:
    trial = study.Trial(study.Setting("valkyrie", "wheel"), 1).in_strokes(math.pi / 4)
    assert trial.done, trial
    # Each grip may lose the handle's 2 mm of play, of 123 mm, and each stroke ends within 2 mm.
    assert abs(trial.true - trial.asked) < 2 * 2 * 0.002 / 0.123 + 0.02


@pytest.mark.parametrize(("robot", "limit_n"), [("valkyrie", 15.0), ("valkyrie", 60.0), ("thormang3", 30.0)])
def test_what_is_stuck_ends_at_the_force_limit(study: ModuleType, robot: str, limit_n: float) -> None:
    setting = study.Setting(robot, "slide", resist_n=(1000.0, 1000.0), force_limit_n=limit_n)
    trial = study.tried(setting, 3)
    assert trial.told == "force_limit"
    assert abs(trial.true) < 0.001
    # The push grows by 40 N/s and the arm's stiffness adds as much: 1.6 N in a tick.
    assert limit_n < trial.peak_n < limit_n + 2.0


def test_a_light_robot_that_pushes_too_hard_is_not_told_as_done(study: ModuleType) -> None:
    # 80 N are more than its arm gives and more than it can lean against.
    trial = study.tried(study.Setting("thormang3", "slide", resist_n=(1000.0, 1000.0)), 3)
    assert trial.told in ("no_motion", "fell")
    assert abs(trial.true) < 0.002


def test_an_empty_hand_notices(study: ModuleType) -> None:
    trial = study.Trial(study.Setting("valkyrie", "slide"), 1)
    rotation, _ = trial.arm().hand()
    away = Affordance("linear", tuple((-rotation[:, 2]).tolist()))
    episode = trial.do(Act("left", away, 0.1))
    assert episode.outcome == "grip_lost"
    assert abs(episode.data.amount) < 0.06


def test_beyond_the_extent_nothing_moves(study: ModuleType) -> None:
    trial = study.Trial(study.Setting("valkyrie", "slide"), 1)
    episode = trial.do(Act("left", replace(LINE, extent=(0.0, 0.1)), 0.2))
    assert (episode.outcome, episode.physics_s) == ("no_plan", 0.0)


def test_a_held_tools_tip_keeps_to_its_path(study: ModuleType) -> None:
    lift, line, circle = study.traced("valkyrie", 1)
    assert [row.told for row in (lift, line, circle)] == ["reached"] * 3
    # The rod finds its seat in the hand while it is lifted; after that it is fixed. 1.4 and 1.1 mm were measured.
    assert line.worst_mm < 3.0
    assert circle.worst_mm < 3.0
    assert line.end_mm < 4.0


def test_the_same_act_twice_is_the_same_to_the_last_bit(study: ModuleType) -> None:
    trial = study.Trial(study.Setting("atlas", "slide"), 2)
    assert not trial.take()
    trial.body.set_stand()
    state = trial.body.save()
    command = Act("left", study.motion_of(trial.bench), 0.05)
    first, second = (perform(trial.body, command, state, NoiseKey(1, 0, 1)) for _ in range(2))
    assert first.outcome == "reached"
    assert first.end == second.end
    # A cut is the first part.
    cut = perform(trial.body, command, state, NoiseKey(1, 0, 1), until_s=1.0)
    assert np.array_equal(cut.samples.joints, first.samples.joints[: len(cut.samples.joints)])


# The bench ------------------------------------------------------------------------------------------------------------


def bench_plant(bench: Bench) -> Plant:
    return Plant(ROBOTS["valkyrie"]().model, bench)


@settings(deadline=None, max_examples=8)
@given(st.floats(0.005, 0.05))
def test_the_screw_lifts_by_its_pitch(pitch_m: float) -> None:
    plant = bench_plant(Bench(thing="screw", place=(3.0, 0.0, 1.0), resist=0.1, pitch_m=pitch_m))
    plant.data.qfrc_applied[plant.model.joint("screw").dofadr[0]] = 0.5
    for _ in range(50):
        plant.begin_tick()
        plant.end_tick()
    assert plant.angle("screw") > 1.0
    # The constraint's time constant is 4 ms: a tenth of a millimetre at 10 cm/s.
    assert plant.angle("screwLift") == pytest.approx(pitch_m * plant.angle("screw") / (2 * math.pi), abs=5e-4)


@pytest.mark.parametrize(("share", "moves"), [(0.9, False), (1.1, True)])
def test_a_slide_gives_way_at_its_friction(share: float, moves: bool) -> None:
    plant = bench_plant(Bench(place=(3.0, 0.0, 1.0), resist=10.0))
    plant.data.qfrc_applied[plant.model.joint("slide").dofadr[0]] = share * 10.0
    for _ in range(50):
        plant.begin_tick()
        plant.end_tick()
    # One newton too much moves 2 kg by 0.25 m in 1 s; creep is under 1 mm/s.
    assert (plant.angle("slide") > 0.1) == moves
    assert moves or abs(plant.angle("slide")) < 0.001
