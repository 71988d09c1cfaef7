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


STEPS_S = 5.0
"""What a moment of chaos may cost: a step or two of 1.4 s more or fewer, rounded up to the programs' polls of 1 s.

A robot that stands 1 mm elsewhere sees the finish elsewhere, and its way there has another number of steps. Measured:
4 s at most in 20 runs.
"""


def pair(level: str, seed: int, out: Path) -> tuple[RunResult, RunResult, float]:
    """A run whose operator must consent, a minute there and back: frozen and stepped; seconds stepped in waits."""
    delays = {"link.up.delay_s": WAIT_S / 2, "link.down.delay_s": WAIT_S / 2}
    scenario = load_scenario("src-dish", {"autonomy": level, **delays})
    stepping = Stepped()
    frozen = run_scenario(scenario, seed, out / "frozen")
    return frozen, run_scenario(scenario, seed, out / "stepped", memo=stepping), stepping.waited_s


def check(frozen: RunResult, stepped: RunResult) -> None:
    assert (stepped.outcome, stepped.cause) == (frozen.outcome, frozen.cause)
    assert stepped.round_trips == frozen.round_trips
    if frozen.outcome == "completed":
        assert stepped.completion_time_s == pytest.approx(frozen.completion_time_s, abs=STEPS_S)


@pytest.mark.parametrize("seed", [12, 127])
def test_runs_end_alike_whether_waits_are_frozen_or_stepped(seed, tmp_path):
    frozen, stepped, waited_s = pair("high", seed, tmp_path)
    check(frozen, stepped)
    assert frozen.outcome == "completed"
    assert waited_s > 4 * WAIT_S


@pytest.mark.slow
def test_twenty_runs_end_alike_whether_waits_are_frozen_or_stepped(tmp_path):
    print("\n| seed | outcome | frozen s | stepped s | waited s |\n|---|---|---|---|---|")
    shares = []
    for seed in range(1, 21):
        frozen, stepped, waited_s = pair("low", seed, tmp_path)
        times = f"{frozen.completion_time_s:.2f} | {stepped.completion_time_s:.2f}"
        print(f"| {seed} | {frozen.outcome} | {times} | {waited_s:.0f} |")
        check(frozen, stepped)
        shares.append(stepped.completion_time_s / frozen.completion_time_s - 1)
    found = np.array([share for share in shares if np.isfinite(share)])
    error = found.std(ddof=1) / np.sqrt(len(found))
    print(f"stepped takes {100 * found.mean():+.3f} % longer, standard error {100 * error:.3f} %")
    # The bound, on the mean: single runs jump by whole steps.
    assert abs(found.mean()) < 1e-3 + 2 * error
