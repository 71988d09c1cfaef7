"""``teleop-sim sweep``, ``decide`` and ``sensitivity``: words, exit codes, files."""

import json
import re
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from teleop_sim.cli_commands import app
from teleop_sim.cli_sweep_show import live_words
from teleop_sim.sweep.index import load_sweep
from teleop_sim.sweep.planning import plan_sweep
from teleop_sim.sweep.sensitivity import sensitivity
from teleop_sim.sweep.study import SweepProgress, run_sweep
from teleop_sim.sweep.workers import Here

SHORT = ["--set", "time_limit_s=20.0"]


def call(*args: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, args, prog_name="teleop-sim")
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture(scope="module")
def swept(tmp_path_factory) -> Path:
    """Three replicates of four cells, each 20 s long."""
    path = tmp_path_factory.mktemp("cli") / "sweep"
    plan = plan_sweep("src-dish", {"--latency": "0s,5s", "--autonomy": "off,full"}, ["time_limit_s=20.0"], runs=3)
    run_sweep(plan, path, Here())
    return path


def test_a_dry_run_says_how_many_and_runs_nothing(tmp_path: Path):
    given = ["--uplink", "64bps:4kbps:4:log", "--latency", "0s,10s", "--runs", "50", "--out", str(tmp_path / "s")]
    code, said, _ = call("sweep", "src-dish", *given, "--dry-run")
    assert code == 0
    assert "8 cells x 50 replicates = 400 runs" in said
    assert "64 bit/s, 254 bit/s, 1.008 kbit/s, 4 kbit/s" in said
    assert re.search(r"about 50 of them compute physics", said)
    assert not (tmp_path / "s").exists()


def test_another_world_in_each_cell_is_another_physics(tmp_path: Path):
    given = ["--set", "world.layout=1,2,3", "--autonomy", "off,full", "--runs", "10", "--out", str(tmp_path / "s")]
    _, said, _ = call("sweep", "src-dish", *given, "--dry-run")
    assert "about 30 of them compute physics" in said


def test_a_sweep_prints_json_for_machines(tmp_path: Path):
    given = ["--runs", "2", "--out", str(tmp_path / "s"), "--workers", "1", "--json"]
    code, said, told = call("sweep", "src-dish", *SHORT, *given)
    assert (code, told) == (0, "")
    found = json.loads(said)
    assert (found["runs"], found["cells"], found["not_completed"], found["lost"]) == (2, 1, 2, [])
    assert len(load_sweep(tmp_path / "s")) == 2


def test_a_directory_that_holds_a_sweep_is_not_overwritten(swept: Path):
    code, _, told = call("sweep", "src-dish", *SHORT, "--out", str(swept))
    assert code == 2
    assert f"teleop-sim sweep --resume {swept}" in told


def test_resuming_goes_alone(swept: Path):
    code, _, told = call("sweep", "src-dish", "--resume", str(swept), "--uplink", "64bps")
    assert code == 2
    assert "SCENARIO, --uplink came with it" in told


def test_a_finished_sweep_resumes_to_the_same_table(swept: Path):
    before = (swept / "index.parquet").read_bytes()
    code, said, _ = call("sweep", "--resume", str(swept), "--workers", "1")
    assert code == 0
    assert "12 runs (none new)" in said
    pd.testing.assert_frame_equal(load_sweep(swept), pd.read_parquet(swept / "index.parquet"))
    assert (swept / "index.parquet").read_bytes() == before


def test_all_that_is_wrong_comes_at_once():
    code, _, told = call("sweep", "--runs", "0", "--workers", "x", "--seed", "-1", "--deadline", "soon", "--force")
    assert code == 2
    for option in ("--runs", "--workers", "--seed", "--deadline", "--force", "no scenario was given"):
        assert option in told


def test_a_scheduler_that_does_not_answer_is_named(tmp_path: Path):
    code, _, told = call("sweep", "src-dish", *SHORT, "--out", str(tmp_path / "s"), "--scheduler", "nonsense://x")
    assert code == 2
    assert "--scheduler: nonsense://x does not answer" in told


def test_the_decision_map_is_printed_and_drawn(swept: Path, tmp_path: Path):
    code, said, _ = call("decide", str(swept), "--measure", "score", "--plot", str(tmp_path / "map.svg"))
    assert code == 0
    assert "too few runs" in said
    first = (tmp_path / "map.svg").read_bytes()
    call("decide", str(swept), "--measure", "score", "--plot", str(tmp_path / "map.svg"))
    assert (tmp_path / "map.svg").read_bytes() == first
    code, said, _ = call("decide", str(swept), "--measure", "score", "--csv")
    assert said.splitlines()[0].startswith("latency_s,best,value,second")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["--choose", "crew"], "crew"),
        (["--measure", "speed"], "speed"),
        (["--plot", "map.gif"], "no .svg or .png"),
        (["--deadline", "0s"], "nothing is done in no time"),
    ],
)
def test_bad_questions_are_refused(swept: Path, given: list[str], words: str):
    code, _, told = call("decide", str(swept), *given)
    assert code == 2
    assert words in told


def test_a_directory_without_a_sweep_is_named(tmp_path: Path):
    for command in (["decide", str(tmp_path)], ["sensitivity", str(tmp_path)], ["sweep", "--resume", str(tmp_path)]):
        code, _, told = call(*command)
        assert code == 2
        assert "sweep.json" in told


def test_effects_of_factors_come_from_the_design(tmp_path: Path):
    axes = {"--latency": "0s:5s", "--uplink": "64bps:4kbps:log"}
    with pytest.raises(ValueError, match="no range"):
        plan_sweep("src-dish", axes, design="morris:2")
    plan = plan_sweep("src-dish", {"--latency": "0s:5s"}, ["time_limit_s=5.0:20.0"], runs=1, design="morris:2")
    run_sweep(plan, tmp_path, Here())
    found = sensitivity(tmp_path, "score").set_index("factor")
    # Nobody scores within 20 s: no effect of anything.
    assert (found["mu_star"] == 0.0).all()
    assert list(found.index) == ["latency_s", "time_limit_s"]


def test_progress_tells_rate_time_left_failures_and_memo():
    words = live_words("x", SweepProgress(runs=100, done=30, resumed=10, bad=2, found=9, made=1), 4.0)
    assert "30 of 100 runs, 5.0/s, 14 s left, 2 not completed, memo 90%" in words
