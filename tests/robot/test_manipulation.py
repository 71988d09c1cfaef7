"""Manipulation skills on the task's console: by contact alone, and blind except for the hand."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from teleop_sim.core.streams import stream
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import CircularAffordance, Command, Follow, Grip, Nudge, Reach, Release, Side
from teleop_sim.robot.skill import Done, Skill, Tick
from teleop_sim.robot.skills.follow import FollowReport, follow
from teleop_sim.robot.skills.grip import FELT_N, GripReport, grip
from teleop_sim.robot.skills.manipulate import PEAK_RATE_RAD_S
from teleop_sim.robot.skills.nudge import nudge
from teleop_sim.robot.skills.reach import ReachReport, reach
from teleop_sim.robot.skills.release import release
from teleop_sim.robot.valkyrie import valkyrie
from teleop_sim.world import console
from teleop_sim.world import dish_layout as lay
from teleop_sim.world.dish_draw import DishSettings, DishWorld, draw_dish_world
from teleop_sim.world.dish_scenery import DishScenery
from teleop_sim.world.plant import Plant

TOLERANCE_RAD = math.radians(5.0)
AHEAD_M, ASIDE_M = 0.555, 0.28
WHEEL: dict[Side, str] = {"left": "yawWheel", "right": "pitchWheel"}
SIGNAL: dict[Side, str] = {"left": "dish_yaw", "right": "dish_pitch"}
RNG = np.random.default_rng


class Scene:
    """A robot put down before a console."""

    def __init__(self, seed: int, side: Side, friction_nm: float, ahead_m: float = AHEAD_M) -> None:
        settings = DishSettings(layout_id=1, wheel_friction_nm=(friction_nm, friction_nm), clutter=(0, 0))
        self.side: Side = side
        self.world: DishWorld = draw_dish_world(lambda name: stream(seed, 0, name), settings)
        spec = valkyrie()
        self.body = Body(spec, Plant(spec.model, DishScenery(self.world)))
        self._put_down(ahead_m)
        self.ticks: list[Tick] = []

    def _put_down(self, ahead_m: float) -> None:
        out = 1.0 if self.side == "left" else -1.0
        centre = console.wheel_centre(self.side == "left")
        stand = (centre[0] - ahead_m, centre[1] - out * ASIDE_M, 0.0)
        x, y, yaw = lay.compose(self.world.console, stand)
        body, plant = self.body, self.body.plant
        body.load(body.standing())
        here = plant.data.qpos[:2].copy()
        c, s = math.cos(yaw), math.sin(yaw)
        plant.data.qpos[:2] = [x + c * here[0] - s * here[1], y + s * here[0] + c * here[1]]
        plant.data.qpos[3:7] = [math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)]
        plant.load(plant.save())
        body.set_stand()

    def wheel_rad(self) -> float:
        return self.body.plant.angle(WHEEL[self.side])

    def signal(self) -> float:
        return self.body.status()[SIGNAL[self.side]]

    def affordance(self) -> CircularAffordance:
        """The wheel where it truly is."""
        x, y, yaw = self.world.console
        turn = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
        left = self.side == "left"
        zero, _, axis = (tuple(map(float, turn @ np.array(a))) for a in console.wheel_axes())
        centre = turn @ np.array(console.wheel_centre(left)) + [x, y, -console.WALKWAY_HEIGHT_M]
        # The joint counts clockwise, the handle anticlockwise.
        angle = self.world.wheel_start_rad[0 if left else 1] - self.wheel_rad()
        return CircularAffordance(
            tuple(map(float, centre)),  # type: ignore[arg-type]
            axis,  # type: ignore[arg-type]
            zero,  # type: ignore[arg-type]
            console.KNOB_ORBIT_M,
            console.KNOB_HEIGHT_M,
            math.remainder(angle, 2 * math.pi),
        )

    def do(self, skill: Skill, command: Command) -> Done:
        """Run a skill to its end; keep its ticks."""
        motion, self.ticks = skill(self.body, command, RNG(0)), []
        while True:
            try:
                tick = next(motion)
            except StopIteration as end:
                done: Done = end.value
                return done
            self.ticks.append(tick)
            assert self.body.tick(tick), "fell"

    def rest(self, seconds: float) -> None:
        for _ in range(round(seconds / self.body.tick_s)):
            self.body.tick(Tick(self.body.posture, jaws=self.body.jaws))


def follow_by(scene: Scene, change: float, **more: Any) -> Follow:
    """Turn until the signal has changed by that much; the joints count clockwise."""
    direction = -1 if change > 0 else 1
    target = scene.signal() + change
    return Follow(
        scene.side, scene.affordance(), direction, SIGNAL[scene.side], target, tolerance=TOLERANCE_RAD, **more
    )


@pytest.mark.parametrize(("seed", "side", "change"), [(1, "left", -0.25), (2, "right", 0.2)])
def test_reach_grip_follow_release_turns_the_dish(seed: int, side: Side, change: float) -> None:
    scene = Scene(seed, side, friction_nm=2.5)
    scene.rest(0.5)
    reached = scene.do(reach, Reach(side, scene.affordance()))
    assert reached.outcome == "reached"
    assert isinstance(reached.data, ReachReport)
    # 26 mm of free play round the knob in the open cage; a few millimetres of tracking error are far inside.
    assert reached.data.position_error_m < 0.005

    gripped = scene.do(grip, Grip(side, close=True))
    assert gripped.outcome == "felt"
    assert abs(scene.wheel_rad()) < math.radians(10.0)

    command, before = follow_by(scene, change), scene.wheel_rad()
    turned = scene.do(follow, command)
    assert turned.outcome == "reached"
    assert isinstance(turned.data, FollowReport)
    # The cage has 2 mm of play and the hand's FK none: 3 degrees are 6 mm on the circle.
    assert -turned.data.turned_rad == pytest.approx(scene.wheel_rad() - before, abs=math.radians(3.0))

    at_end = scene.wheel_rad()
    assert scene.do(release, Release(side, command.affordance)).outcome == "released"
    scene.rest(3.0)
    assert scene.wheel_rad() == pytest.approx(at_end, abs=math.radians(2.0))
    # The scorer's tolerance, after the dish's lag.
    assert abs(scene.signal() - command.target) < TOLERANCE_RAD
    walk = scene.body.named_posture("walk")
    np.testing.assert_allclose(scene.body.posture, walk, atol=1e-9)


def test_a_hand_beside_the_handle_feels_nothing_and_turns_nothing() -> None:
    scene = Scene(3, "right", friction_nm=2.0)
    true = scene.affordance()
    wrong = replace(true, centre=(true.centre[0], true.centre[1], true.centre[2] + 0.2))
    assert scene.do(reach, Reach("right", wrong)).outcome == "reached"
    gripped = scene.do(grip, Grip("right", close=True))
    assert gripped.outcome == "not_felt"
    assert isinstance(gripped.data, GripReport)
    assert gripped.data.forward_n == gripped.data.back_n == 0.0
    turned = scene.do(follow, replace(follow_by(scene, 0.3), affordance=wrong))
    assert turned.outcome == "grip_lost"
    assert scene.wheel_rad() == pytest.approx(0.0, abs=1e-3)


def test_a_wheel_that_is_stuck_is_felt_but_does_not_move() -> None:
    scene = Scene(4, "right", friction_nm=40.0)
    scene.do(reach, Reach("right", scene.affordance()))
    gripped = scene.do(grip, Grip("right", close=True))
    assert gripped.outcome == "felt"
    assert min(gripped.data.forward_n, gripped.data.back_n) > FELT_N
    turned = scene.do(follow, follow_by(scene, 0.3))
    assert turned.outcome == "no_motion"


def test_follow_stops_at_its_time_limit() -> None:
    scene = Scene(5, "left", friction_nm=2.0)
    scene.do(reach, Reach("left", scene.affordance()))
    scene.do(grip, Grip("left", close=True))
    turned = scene.do(follow, follow_by(scene, 0.5, time_limit_s=2.0))
    assert turned.outcome == "timed_out"


def test_a_signal_nobody_sends_ends_follow_at_once() -> None:
    scene = Scene(5, "left", friction_nm=2.0)
    scene.rest(0.1)
    done = scene.do(follow, replace(follow_by(scene, 0.5), signal="dish_roll"))
    assert done.outcome == "no_motion"
    assert "dish_roll" in done.cause
    assert not scene.ticks


def test_a_wheel_out_of_reach_is_refused_before_anything_moves() -> None:
    scene = Scene(6, "left", friction_nm=2.0, ahead_m=0.95)
    done = scene.do(reach, Reach("left", scene.affordance()))
    assert done.outcome == "no_plan"
    assert not scene.ticks


def test_references_are_continuous_and_their_rates_are_their_differences() -> None:
    scene = Scene(7, "left", friction_nm=2.0)
    start = scene.body.posture.copy()
    scene.do(reach, Reach("left", scene.affordance()))
    before = start
    for tick in scene.ticks:
        step = tick.posture - before
        rate = np.zeros_like(step) if tick.rate is None else tick.rate
        np.testing.assert_allclose(rate * scene.body.tick_s, step, atol=1e-12)
        assert np.abs(step).max() <= PEAK_RATE_RAD_S * scene.body.tick_s
        before = tick.posture
    scene.do(grip, Grip("left", close=True))
    jaws = np.array([0.0, *(tick.jaws[0] for tick in scene.ticks)])
    # A jump of the reference would slam the jaws; 0.6 s for the stroke is 0.05 a tick.
    assert np.abs(np.diff(jaws)).max() < 0.06
    assert {tick.jaws[1] for tick in scene.ticks} == {0.0}


@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.03), (-0.02, 0.0, 0.02), (0.0, 0.03, 0.0)])
def test_nudge_moves_the_hand_by_the_offset_in_the_pelvis_frame(offset: tuple[float, float, float]) -> None:
    scene = Scene(8, "right", friction_nm=2.0)
    scene.rest(0.5)
    pelvis, _ = scene.body.base()
    before = scene.body.plant.site("rightTcp").position
    done = scene.do(nudge, Nudge("right", offset))
    scene.rest(1.0)
    moved = pelvis.T @ (scene.body.plant.site("rightTcp").position - before)
    assert done.outcome == "reached"
    # Arm servos and the pelvis' sway leave a millimetre or two.
    np.testing.assert_allclose(moved, offset, atol=0.003)


def test_a_nudge_beyond_the_arm_is_refused() -> None:
    scene = Scene(8, "right", friction_nm=2.0)
    done = scene.do(nudge, Nudge("right", (1.5, 0.0, 0.0)))
    assert done.outcome == "no_plan"
    assert not scene.ticks


def test_opening_says_so() -> None:
    scene = Scene(8, "right", friction_nm=2.0)
    assert scene.do(grip, Grip("right", close=False)).outcome == "opened"
