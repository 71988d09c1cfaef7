"""What freezing a waiting robot costs: the same runs with every wait stepped, physics and all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from teleop_sim import load_scenario
from teleop_sim.robot.body import Body, RobotState
from teleop_sim.robot.commands import Step
from teleop_sim.robot.episode import NoiseKey, perform
from teleop_sim.robot.memo import Fresh
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.stepped import Stepped
from teleop_sim.run import RunResult, run_scenario
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import Plant

NAMES = sorted(ROBOTS)
KEY = NoiseKey(1, 0, 1)
WAIT_S = 60.0


def rested(name: str) -> tuple[Body, RobotState]:
    spec = ROBOTS[name]()
    body = Body(spec, Plant(spec.model, BareFloor()))
    return body, perform(body, Step(forward_m=0.1), body.standing(), KEY).end


@pytest.mark.parametrize("name", NAMES)
def test_a_minute_of_standing_moves_a_robot_by_less_than_it_can_place_its_feet(name):
    body, state = rested(name)
    body.load(state)
    before, feet = body.plant.data.qpos.copy(), np.array(body.feet())
    body.load(Stepped().stood(body, state, WAIT_S))
    moved = np.abs(body.plant.data.qpos - before)
    # Measured: 1.4 mm and 1.8 mrad at most, nearly all in the first two seconds; soles move by 0.01 mm.
    assert moved[:3].max() < 3e-3
    assert moved[7:].max() < 5e-3
    assert np.abs(np.array(body.feet()) - feet).max() < 1e-4


def test_a_wait_is_a_function_of_where_it_began_and_how_long_it_was():
    body, state = rested("valkyrie")
    at_once = Stepped().stood(body, state, 3.0)
    piecemeal = Stepped()
    for seconds in (0.5, 1.2, 1.2, 3.0):
        last = piecemeal.stood(body, state, seconds)
    assert last == at_once
    assert piecemeal.waited_s == pytest.approx(3.0)
    # Going back is allowed, and part of a control tick is no tick.
    assert piecemeal.stood(body, state, 0.5) == Stepped().stood(body, state, 0.519)
    assert piecemeal.stood(body, state, 0.019) is state
    assert Fresh().stood(body, state, 3.0) is state


class OneMinute(Fresh):
    """Steps one of a run's waits through for a minute, and freezes the others. ``which``: among those so long."""

    def __init__(self, which: int) -> None:
        self._which = which
        self._long: list[RobotState] = []
        self.stepped = Stepped()

    def stood(self, body: Body, state: RobotState, seconds: float, /) -> RobotState:
        if seconds < WAIT_S:
            return state
        if not self._long or self._long[-1] is not state:
            self._long.append(state)
        return self.stepped.stood(body, state, WAIT_S) if len(self._long) == self._which + 1 else state


def run(level: str, seed: int, out: Path, memo: Fresh) -> RunResult:
    """A run whose operator must consent, a minute there and back."""
    delays = {"link.up.delay_s": WAIT_S / 2, "link.down.delay_s": WAIT_S / 2}
    return run_scenario(load_scenario("src-dish", {"autonomy": level, **delays}), seed, out, memo=memo)


def check(frozen: RunResult, stepped: RunResult) -> float:
    """Share by which stepping took longer; all else is alike."""
    assert (stepped.outcome, stepped.cause) == (frozen.outcome, frozen.cause)
    assert stepped.round_trips == frozen.round_trips
    return stepped.completion_time_s / frozen.completion_time_s - 1.0


SHARE = 1e-3
"""What freezing a minute's wait may change of a run's completion time: the bound that was set."""

STEP_S = 2.5
"""With all waits of a run stepped, 9 to 20 minutes, a step of 1.4 s may come or go; polls round it to 2 s."""


@pytest.mark.parametrize("seed", [12, 127])
def test_runs_end_alike_whether_waits_are_frozen_or_stepped(seed, tmp_path):
    stepping = Stepped()
    frozen = run("high", seed, tmp_path / "frozen", Fresh())
    assert frozen.outcome == "completed"
    assert abs(check(frozen, run("high", seed, tmp_path / "minute", OneMinute(1)))) < SHARE
    assert abs(check(frozen, run("high", seed, tmp_path / "stepped", stepping))) * frozen.completion_time_s < STEP_S
    assert stepping.waited_s > 4 * WAIT_S


@pytest.mark.slow
def test_twenty_runs_end_alike_whether_waits_are_frozen_or_stepped(tmp_path):
    print("\n| seed | outcome | frozen s | a minute stepped s | all stepped s | waited s |\n|---|---|---|---|---|---|")
    shares = []
    for seed in range(1, 21):
        every, once = Stepped(), OneMinute(seed % 6)
        frozen = run("low", seed, tmp_path, Fresh())
        minute, all_through = run("low", seed, tmp_path, once), run("low", seed, tmp_path, every)
        shares.append((check(frozen, minute), check(frozen, all_through), frozen.completion_time_s))
        times = " | ".join(f"{result.completion_time_s:.2f}" for result in (frozen, minute, all_through))
        print(f"| {seed} | {frozen.outcome} | {times} | {every.waited_s:.0f} |", flush=True)
        assert once.stepped.waited_s == pytest.approx(WAIT_S)
    finished = [(*pair, lasted_s) for *pair, lasted_s in shares if np.isfinite(pair).all()]
    found, lasted = np.array(finished)[:, :2], np.array(finished)[:, 2]
    print(f"changed by {np.abs(found).max(axis=0)} at most, {found.mean(axis=0)} on the mean")
    assert np.abs(found[:, 0]).max() < SHARE
    assert abs(found[:, 1].mean()) < SHARE
    assert np.abs(found[:, 1] * lasted).max() < STEP_S
