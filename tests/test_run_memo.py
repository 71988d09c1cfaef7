"""Whole runs with a memo have the bytes of runs without one, whatever it remembers and however little it may keep."""

from functools import cache
from pathlib import Path

import pytest

from teleop_sim import load_scenario
from teleop_sim.channel import messages as msg
from teleop_sim.core.records import EpisodeEnded
from teleop_sim.log.load import load
from teleop_sim.log.writer import LogWriter
from teleop_sim.robot.memo import Memo
from teleop_sim.run import _Bench, _Watch, run_scenario

SEED = 12

CELLS = {
    "near, full": {"autonomy": "full"},
    "far, off": {"autonomy": "off", "link.up.delay_s": 3.7, "link.down.delay_s": 3.7, "link.up.rate_bps": 64.0},
    "dark at times, low": {"autonomy": "low", "link.up.blackouts": [[0.0, 40.0], [90.0, 95.0]]},
    "another operator, high": {"autonomy": "high", "operator.expertise": 1.5, "link.down.delay_s": 1.0},
}
LIMIT = {"time_limit_s": 160.0}
"""Time for walks, scans, detections, pictures and a hand's first reach."""


@pytest.fixture(scope="module")
def fresh(tmp_path_factory):
    """The bytes of a cell's log without a memo."""
    folder = tmp_path_factory.mktemp("fresh")

    @cache
    def made(cell: str) -> bytes:
        return log_of(CELLS[cell], folder, None)

    return made


def log_of(overrides: dict[str, object], folder: Path, memo: Memo | None) -> bytes:
    scenario = load_scenario("src-dish", LIMIT | overrides)
    return run_scenario(scenario, SEED, folder, memo=memo).log.read_bytes()


def test_a_memo_filled_by_other_links_levels_and_operators_changes_no_byte(fresh, tmp_path):
    memo = Memo()
    log_of({"autonomy": "full", "time_limit_s": 200.0}, tmp_path, memo)
    filled = memo.tally()
    for cell in CELLS:
        log = log_of(CELLS[cell], tmp_path, memo)
        if cell in ("near, full", "far, off"):
            assert log == fresh(cell)
    tally = memo.tally()
    # The operators did nothing but confirm: the robot got the same commands each time, only later.
    assert tally.episodes_made == filled.episodes_made
    assert tally.looks_made == filled.looks_made > 0
    assert tally.episodes_found >= len(CELLS) * 5
    assert (tally.bodies_made, tally.bodies_found) == (1, len(CELLS))
    assert tally.spared_s > len(CELLS) * 20.0
    assert tally.evicted == 0


def test_a_memory_that_forgets_all_the_time_changes_no_byte(fresh, tmp_path):
    # A cloud has 0.7 MB to 2 MB, a walk of ten seconds 0.2 MB.
    memo = Memo(2**20)
    for cell in ("far, off", "near, full"):
        assert log_of(CELLS[cell], tmp_path, memo) == fresh(cell)
        assert memo.tally().used_bytes <= 2**20
    assert memo.tally().evicted > 0
    assert memo.tally().episodes_made > memo.tally().entries


STOPS = {
    "while walking, twice": [(14.0, msg.StopAll()), (14.3, msg.Chat("|"))],
    "into error": [(14.0, msg.Chat("/WALK_FAILED")), (18.0, msg.Chat("/RESTART"))],
}


def stopped(name: str, up_delay_s: float, folder: Path, memo: Memo | None) -> bytes:
    """A short run in which somebody sends commands whatever happens; its log."""
    near = {"time_limit_s": 24.0, "pacing": "eager", "link.up.delay_s": up_delay_s}
    writer = LogWriter(folder / "stopped.mcap")
    watch = _Watch(load_scenario("src-dish", near), writer.write, None)
    bench = _Bench(watch.scenario, SEED, 0, watch, lambda: 0.0, memo)

    def person():
        for at_s, message in STOPS[name]:
            yield bench.env.timeout(at_s - bench.env.now)
            topic, payload = msg.encode_message(message)
            bench.up.send(topic, payload, "")

    bench.env.process(person())
    bench.run()
    writer.close()
    return (folder / "stopped.mcap").read_bytes()


def test_stops_at_other_times_change_no_byte(tmp_path):
    memo = Memo()
    for name in STOPS:
        stopped(name, 0.0, tmp_path, memo)
    for name in STOPS:
        made = stopped(name, 0.51, tmp_path, memo)
        before = memo.tally().episodes_made
        remembered = stopped(name, 0.51, tmp_path, memo)
        assert memo.tally().episodes_made == before
        assert made == remembered == stopped(name, 0.51, tmp_path, None), name
        ended = [r for r in load(tmp_path / "stopped.mcap").records() if isinstance(r, EpisodeEnded)]
        assert "walk" in {r.skill for r in ended}


@pytest.mark.slow
@pytest.mark.parametrize("cell", CELLS)
def test_whole_missions_have_the_same_bytes(cell, tmp_path):
    whole = {"time_limit_s": 1800.0}
    memo = Memo()
    log_of({"autonomy": "full"} | whole, tmp_path, memo)
    assert log_of(CELLS[cell] | whole, tmp_path, memo) == log_of(CELLS[cell] | whole, tmp_path, None)
    assert memo.tally().episodes_found > 0
