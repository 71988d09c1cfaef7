"""The command line with real runs: what lands on standard output, in the log, and in the exit code.

Short runs: a time limit of some simulated seconds ends them before the robot has walked far. Whole runs are measured by
``make bench`` and judged by ``make validate``.
"""

import json
import os
import pty
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import teleop_sim
from teleop_sim.scenarios.files import read_scenario

COMMAND = Path(sys.executable).with_name("teleop-sim")
KEYS = {
    "scenario", "seed", "outcome", "cause", "completion_time_s", "round_trips", "operator_acts", "wall_s", "physics_s",
    "log", "states",
}  # fmt: skip
Short = tuple[Path, "subprocess.CompletedProcess[str]"]
STATE_KEYS = {"state", "visits", "normal", "auto", "manual", "retries", "time_s"}


def call(*args: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([COMMAND, *map(str, args)], cwd=cwd, capture_output=True, text=True, check=False, timeout=300)


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Short:
    """A run that its time limit ends, with ``--json``; the directory it ran in."""
    home = tmp_path_factory.mktemp("short")
    file = home / "dark.toml"
    text = call("scenarios", "show", "src-dish", cwd=home).stdout
    file.write_text(text.replace("blackouts = []", "blackouts = [[5.0, 12.0]]"))
    return home, call("run", "dark.toml", "--time-limit", "20s", "--seed", "3", "--json", cwd=home)


def test_json_is_one_object_on_standard_output_and_nothing_else(short: Short) -> None:
    _, done = short
    made = json.loads(done.stdout)
    assert done.stdout.count("\n") == 1
    assert set(made) == KEYS
    assert made["states"]
    assert all(set(state) == STATE_KEYS for state in made["states"])


def test_a_run_out_of_time_is_censored_and_ends_with_1(short: Short) -> None:
    _, done = short
    made = json.loads(done.stdout)
    assert (done.returncode, made["outcome"], made["completion_time_s"]) == (1, "censored", None)
    assert made["cause"]
    assert (made["scenario"], made["seed"]) == ("dark", 3)


def test_the_log_is_where_the_result_says_and_repeats_its_scenario(short: Short) -> None:
    home, done = short
    made = json.loads(done.stdout)
    assert made["log"] == "runs/dark_seed3.mcap"
    log = teleop_sim.load(home / made["log"])
    assert not log.interrupted
    scenario = read_scenario(log.scenario_toml, "log")
    assert (scenario.seed, scenario.time_limit_s, scenario.name) == (3, 20.0, "dark")
    assert scenario.link.up.blackouts == ((5.0, 12.0),)


def test_a_blackout_of_the_scenario_is_in_the_log(short: Short) -> None:
    home, _ = short
    dark = teleop_sim.load(home / "runs/dark_seed3.mcap").blackouts
    assert sorted(set(zip(dark["start_s"], dark["end_s"], strict=True))) == [(5.0, 12.0)]


def test_progress_off_a_terminal_is_plain_lines_on_standard_error(short: Short) -> None:
    _, done = short
    lines = done.stderr.splitlines()
    assert lines[0].startswith("dark seed 3")
    assert len(lines) > 1
    assert "\x1b" not in done.stderr


def test_report_writes_what_it_says(short: Short) -> None:
    home, _ = short
    done = call("report", "runs/dark_seed3.mcap", "--out", "made", cwd=home)
    assert (done.returncode, done.stderr) == (0, "")
    wrote = [home / line.removeprefix("wrote ") for line in done.stdout.splitlines() if line.startswith("wrote ")]
    assert wrote
    assert all(path.is_file() and path.parent == home / "made" and path.stat().st_size for path in wrote)


def test_the_summary_shows_the_paper_s_table_and_the_next_command(tmp_path: Path) -> None:
    done = call("run", "src-dish", "--time-limit", "20s", "--quiet", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (1, "")
    for part in ("Table II", "Where the time went", "censored", "next: teleop-sim report runs/src-dish_seed1.mcap"):
        assert part in done.stdout


def test_an_older_log_of_the_name_is_replaced_and_nothing_else_is_left(tmp_path: Path) -> None:
    out = tmp_path / "runs"
    out.mkdir()
    (out / "src-dish_seed1.mcap").write_text("older")
    call("run", "src-dish", "--time-limit", "5s", "--quiet", cwd=tmp_path)
    assert [path.name for path in out.iterdir()] == ["src-dish_seed1.mcap"]
    assert not teleop_sim.load(out / "src-dish_seed1.mcap").interrupted


def test_an_interrupted_run_says_how_far_its_log_reads(tmp_path: Path) -> None:
    run = subprocess.Popen(
        [COMMAND, "run", "src-dish", "--autonomy", "off"],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert run.stderr is not None
    first = [run.stderr.readline() for _ in range(3)]
    run.send_signal(signal.SIGINT)
    out, err = run.communicate(timeout=120)
    assert all(first)
    assert (run.returncode, out) == (130, "")
    assert "Traceback" not in err
    assert "next: teleop-sim report runs/src-dish_seed1.mcap" in err
    log = teleop_sim.load(tmp_path / "runs/src-dish_seed1.mcap")
    assert log.interrupted
    report = call("report", "runs/src-dish_seed1.mcap", cwd=tmp_path)
    assert report.returncode == 0
    assert "interrupted" in report.stdout


def test_progress_on_a_terminal_is_live(tmp_path: Path) -> None:
    master, terminal = pty.openpty()
    run = subprocess.Popen(
        [COMMAND, "run", "src-dish", "--time-limit", "20s"],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=terminal, env={**os.environ, "TERM": "xterm"},
    )  # fmt: skip
    os.close(terminal)
    seen = b""
    while chunk := _read(master):
        seen += chunk
    run.communicate(timeout=120)
    os.close(master)
    assert b"of simulated time" in seen
    assert b"\x1b[" in seen


def _read(master: int) -> bytes:
    try:
        return os.read(master, 4096)
    except OSError:  # the other end is closed
        return b""
