"""Whole runs: the promises that make a result worth believing. Costs about ten runs."""

import hashlib
import math
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from teleop_sim import load_scenario
from teleop_sim.core.records import (
    EpisodeEnded,
    OperatorActed,
    PacketEnded,
    PlantSample,
    Released,
    RunEnded,
    TransitionTaken,
)
from teleop_sim.log.load import load
from teleop_sim.run import RunResult, run_scenario

SEEDS = (12, 127)
"""Worlds that take two turns of a handle, not six: cheap runs."""

LATENCY = ("link.up.delay_s", "link.down.delay_s")


@pytest.fixture(scope="module")
def go(tmp_path_factory):
    """Run src-dish with overrides, once for each distinct set."""
    folder = tmp_path_factory.mktemp("runs")

    @cache
    def once(seed: int, overrides: tuple[tuple[str, object], ...], again: int = 0) -> RunResult:
        scenario = load_scenario("src-dish", dict(overrides))
        return run_scenario(scenario, seed, folder / f"{abs(hash((seed, overrides, again)))}")

    def call(seed: int = SEEDS[0], again: int = 0, **overrides: object) -> RunResult:
        return once(seed, tuple((k.replace("__", "."), v) for k, v in sorted(overrides.items())), again)

    return call


def delays(seconds: float) -> dict[str, object]:
    return {key.replace(".", "__"): seconds for key in LATENCY}


def records(result: RunResult, kind: type):
    return [r for r in load(result.log).records() if isinstance(r, kind)]


def test_a_run_at_full_autonomy_completes_and_needs_nobody(go):
    result = go()
    assert result.outcome == "completed", result.cause
    assert result.round_trips == result.operator_acts == 0
    assert result.completion_time_s == records(result, RunEnded)[0].completion_time_s
    assert sum(row["time_s"] for row in result.states) == pytest.approx(result.completion_time_s)


@pytest.mark.parametrize("seed", SEEDS)
def test_where_no_operator_is_needed_latency_costs_nothing(go, seed):
    near, far = go(seed, **delays(0.0)), go(seed, **delays(10.0))
    assert near.outcome == far.outcome == "completed"
    assert near.round_trips == far.round_trips == 0
    assert near.completion_time_s == pytest.approx(far.completion_time_s, abs=1e-6)


@pytest.mark.parametrize("seed", SEEDS)
def test_at_level_off_each_round_trip_costs_its_latency_once(go, seed):
    """T = T0 + N * RTT (Ferrell's law of open-loop moves), N counted in the log."""
    runs = {d: go(seed, autonomy="off", **delays(d)) for d in (0.0, 3.7, 10.0)}
    assert {r.outcome for r in runs.values()} == {"completed"}
    trips = {r.round_trips for r in runs.values()}
    assert len(trips) == 1
    n = trips.pop()
    assert n >= 14
    answered = [r for r in records(runs[10.0], Released) if r.effect == "answered"]
    assert len(answered) == n
    for delay_s in (3.7, 10.0):
        grown_s = runs[delay_s].completion_time_s - runs[0.0].completion_time_s
        assert grown_s == pytest.approx(n * 2 * delay_s, abs=1e-6)


def test_what_the_robot_does_does_not_depend_on_the_link(go):
    """Physics is a function of commands: the same episodes at both latencies, only later."""
    near, far = (go(autonomy="off", **delays(d)) for d in (0.0, 10.0))

    def without_times(result: RunResult) -> list[tuple[object, ...]]:
        # A difference of times on the clock: rounding differs with where it is taken.
        return [
            (r.state, r.skill, r.command, r.outcome, r.cause, round(r.physics_s, 9))
            for r in records(result, EpisodeEnded)
        ]

    assert without_times(near) == without_times(far)


def digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_the_same_seed_gives_the_same_file_twice_and_in_another_process(go, tmp_path):
    first, second = go(autonomy="low"), go(again=1, autonomy="low")
    assert first.log != second.log
    assert digest(first.log) == digest(second.log)
    command = [sys.executable, "-m", "teleop_sim", "run", "src-dish", "--seed", str(SEEDS[0]), "--autonomy", "low"]
    there = subprocess.run([*command, "--out", tmp_path, "--quiet"], capture_output=True, text=True, check=False)
    assert there.returncode == 0, there.stderr
    assert digest(tmp_path / first.log.name) == digest(first.log)


def test_another_seed_gives_another_world_and_another_file(go):
    assert digest(go().log) != digest(go(SEEDS[1]).log)


DARK = {"time_limit_s": 400.0, "link__up__blackouts": ((1.0, math.inf),)}
"""Dark before anybody has anything to say; a link without any light is refused."""


@pytest.mark.parametrize("level", ["off", "high"])
def test_an_uplink_that_never_delivers_lets_nothing_through_and_ends_at_the_limit(go, level):
    result = go(autonomy=level, **DARK)
    assert result.outcome == "censored"
    assert "time limit of 400 s" in result.cause
    assert math.isnan(result.completion_time_s)
    sent = [p for p in records(result, PacketEnded) if p.direction == "up"]
    acts = [a for a in records(result, OperatorActed) if a.kind == "send"]
    # The operator did try, again and again.
    assert len(sent) == len(acts) == result.operator_acts >= 2
    assert {p.outcome for p in sent} == {"in_flight"}
    assert records(result, Released) == []
    assert {t.how for t in records(result, TransitionTaken)} <= {"autonomous"}
    assert result.round_trips == 0


@pytest.mark.parametrize("level", ["off", "high"])
def test_a_dark_uplink_leaves_the_field_site_as_if_nobody_were_there(go, level):
    """What the field site did equals what it does when every act comes long after the end."""
    dark = go(autonomy=level, **DARK)
    late = go(autonomy=level, time_limit_s=400.0, **delays(1000.0))
    assert late.outcome == "censored"

    def done(result: RunResult) -> list[object]:
        return [x for x in load(result.log).records() if isinstance(x, EpisodeEnded | TransitionTaken | PlantSample)]

    assert done(dark) == done(late)


def test_a_slippery_floor_ends_in_a_fall_that_the_log_explains(go):
    result = go(world__floor_friction=(0.05, 0.05))
    assert result.outcome == "failed"
    assert "slid" in result.cause
    fallen = [e for e in records(result, EpisodeEnded) if e.outcome == "fell"]
    assert fallen[-1].cause == result.cause


def test_eager_pacing_is_faster_and_does_the_same_job(go):
    assert go(pacing="eager").completion_time_s < go().completion_time_s
