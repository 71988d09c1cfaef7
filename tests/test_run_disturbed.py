"""Disturbances in whole runs: nothing asked changes nothing, what was drawn is in the log, a seed draws the same again.

Runs are cut after some simulated seconds: the robot has then begun to walk.
"""

import hashlib
from functools import cache, partial
from pathlib import Path

import pytest

from teleop_sim import load_scenario
from teleop_sim.core.records import Disturbed, PlantSample, Record, RunStarted
from teleop_sim.core.streams import stream
from teleop_sim.log.load import load
from teleop_sim.robot.hands import robot_of
from teleop_sim.robot.memo import Memo
from teleop_sim.run import run_scenario
from teleop_sim.scenarios.objects import TASKS, drawn_disturbances
from teleop_sim.world.disturbances import figures

NOTHING = {
    "disturbances.mass_factor": 1.0,
    "disturbances.com_error_m": 0.0,
    "disturbances.joint_friction": 0.0,
    "disturbances.strength.*": 1.0,
    "disturbances.delay_s": 0.0,
    "disturbances.bumps.height_m": 0.0,
    "disturbances.patches.count": 0,
    "disturbances.pushes.force_n": 0.0,
    "disturbances.payload.link": "left_hand",
    "disturbances.payload.mass_kg": 0.0,
    "disturbances.senses.camera_turn_rad": 0.0,
    "disturbances.senses.focal": 1.0,
    "disturbances.senses.range_noise": 1.0,
}
SHORT = {"time_limit_s": 35.0, "pacing": "eager"}


@pytest.fixture(scope="module")
def go(tmp_path_factory: pytest.TempPathFactory):
    """The log of a short run of a scenario with changes, once for each set of them."""
    folder = tmp_path_factory.mktemp("runs")

    @cache
    def once(name: str, changes: tuple[tuple[str, object], ...], seed: int) -> Path:
        scenario = load_scenario(name, dict(changes) | SHORT)
        return run_scenario(scenario, seed, folder / f"{len(list(folder.iterdir()))}").log

    def call(name: str = "src-dish", seed: int = 12, **changes: object) -> Path:
        return once(name, tuple(sorted(changes.items())), seed)

    return call


def happened(log: Path) -> list[str]:
    """All records but the scenario, in words: a time that is not a number equals itself there."""
    return [repr(r) for r in load(log).records() if not isinstance(r, RunStarted)]


def moved(log: Path) -> list[Record]:
    return [r for r in load(log).records() if isinstance(r, PlantSample)]


def test_disturbances_of_no_size_leave_every_record_as_it_was(go) -> None:
    calm, nothing = go(), go(**NOTHING)
    # The scenario that the log repeats does say what was asked.
    assert happened(nothing) == happened(calm)
    for log in (calm, nothing):
        assert load(log).disturbances.empty
        assert b"field/disturbance" not in log.read_bytes()


def test_the_log_tells_what_was_drawn_and_the_robot_feels_it(go) -> None:
    log = go("src-dish-rough")
    scenario, streams = load_scenario("src-dish-rough"), partial(stream, 12, 0)
    site = TASKS["src-dish"].site(scenario, streams)
    what = drawn_disturbances(scenario, streams, site, robot_of("valkyrie").model)
    told = [r for r in load(log).records() if isinstance(r, Disturbed)]
    assert [(r.what, r.values, r.text) for r in told] == list(figures(what))
    assert {r.t_s for r in told} == {0.0}
    table = load(log).disturbances.set_index("what")["values"]
    assert tuple(table["mass_factor"]) == (what.mass_factor,)
    assert len(what.plates) == 2


@pytest.mark.parametrize(
    "change",
    [
        {"disturbances.mass_factor": 1.02},
        {"disturbances.pushes.force_n": 20.0},
        {"disturbances.payload.link": "right_hand"},
        {"disturbances.senses.lidar_turn_rad": (0.0, 0.0, 0.02)},
    ],
    ids=lambda change: next(iter(change)),
)
def test_each_one_reaches_the_plant_of_the_run(go, change: dict[str, object]) -> None:
    assert moved(go(**change)) != moved(go())


def test_the_same_seed_gives_the_same_bytes_with_a_memo_or_without(go, tmp_path: Path) -> None:
    def digest(log: Path) -> str:
        return hashlib.sha256(log.read_bytes()).hexdigest()

    scenario, memo = load_scenario("src-dish-rough", SHORT), Memo(10**8)
    fresh = digest(go("src-dish-rough"))
    for again in ("first", "second"):
        assert digest(run_scenario(scenario, 12, tmp_path / again, memo=memo).log) == fresh
    assert digest(go("src-dish-rough", 13)) != fresh


def test_a_memo_does_not_take_one_disturbance_for_another(go, tmp_path: Path) -> None:
    memo = Memo(10**8)
    for number, change in enumerate(({}, {"disturbances.mass_factor": 1.02}, {})):
        log = run_scenario(load_scenario("src-dish", change | SHORT), 12, tmp_path / str(number), memo=memo).log
        assert moved(log) == moved(go(**change))
