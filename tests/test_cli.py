"""The command line without a run: arguments, messages, exit codes, speed of ``--help``."""

import json
import math
import os
import re
import shlex
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from teleop_sim.cli_commands import app, errors_shown
from teleop_sim.cli_options import OPTIONS, scenario_from
from teleop_sim.cli_progress import PlainLines, live_text
from teleop_sim.cli_show import result_json, summary_lines
from teleop_sim.core.errors import BadInput
from teleop_sim.core.records import RunEnded, RunStarted, TransitionTaken
from teleop_sim.log.writer import LogWriter
from teleop_sim.reports.visits import StateRow
from teleop_sim.run import Progress, RunResult
from teleop_sim.scenarios.files import list_scenarios, load_scenario, read_scenario
from teleop_sim.scenarios.schema import Scenario

ROOT = Path(__file__).parents[1]
COMMAND = Path(sys.executable).with_name("teleop-sim")


def call(*args: str) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of the command line, in this process."""
    result = CliRunner().invoke(app, args, prog_name="teleop-sim")
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr


def chosen(out: Path, **given: str | None) -> Scenario:
    return scenario_from("src-dish", {f"--{name.replace('_', '-')}": text for name, text in given.items()}, out)


def short_log(path: Path, ended: bool = True) -> Path:
    """A log of two states."""
    with LogWriter(path) as log:
        log(RunStarted(0.0, "short", "", 1, 0, 1800.0, ""))
        log(TransitionTaken(20.0, "START", "go", "DETECT_PANEL_COARSE", 0.0, "autonomous", "normal", 0, 0, 3, 0.0, ""))
        if ended:
            log(RunEnded(30.0, "failed", "fell", math.nan, 0, 0))
    return path


def refusals(out: Path, **given: str | None) -> dict[str, str]:
    with pytest.raises(BadInput) as refused:
        chosen(out, **given)
    return {p.where: p.what for p in refused.value.problems}


def test_help_and_version_end_well() -> None:
    assert call("--help")[0] == 0
    assert call("run", "--help")[0] == 0
    code, out, _ = call("--version")
    assert (code, out) == (0, "teleop-sim 0.1.0\n")


def test_scenarios_list_names_and_questions() -> None:
    code, out, _ = call("scenarios", "list")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == list(list_scenarios())
    assert all(line.endswith("?") for line in out.splitlines())


def test_what_scenarios_show_prints_is_a_scenario_file(tmp_path: Path) -> None:
    code, out, _ = call("scenarios", "show", "src-dish")
    assert code == 0
    assert read_scenario(out, "shown", "mine").name == "mine"
    file = tmp_path / "mine.toml"
    file.write_text(out)
    assert call("scenarios", "check", str(file)) == (0, f"{file}: ok\n", "")


def test_scenarios_show_schema_is_json() -> None:
    code, out, _ = call("scenarios", "show", "--schema")
    assert code == 0
    assert json.loads(out)["title"] == "Scenario"


def test_scenarios_show_wants_a_name() -> None:
    code, out, err = call("scenarios", "show")
    assert (code, out) == (2, "")
    assert "src-dish" in err


def test_scenarios_check_goes_on_after_a_bad_file(tmp_path: Path) -> None:
    bad = tmp_path / "bad.toml"
    bad.write_text("schema = 1\nsead = 1\n")
    code, out, err = call("scenarios", "check", str(bad), "src-dish", str(tmp_path / "none.toml"))
    assert (code, out) == (2, "src-dish: ok\n")
    assert f"{bad}:2:1: sead: unknown key" in err
    assert "Did you mean 'seed'?" in err
    assert "none.toml: no such file" in err


@pytest.mark.parametrize(
    "args",
    [
        ("run",),
        ("run", "src-dish", "--uplnik", "3"),
        ("run", "src-dish", "extra"),
        ("rum", "src-dish"),
        ("scenarios", "lst"),
        ("scenarios", "check"),
        ("scenarios", "show", "src-dich"),
        ("run", "src-dich"),
        ("run", "src-dish", "--uplink", "0bps"),
        ("report", "no-such-log.mcap"),
    ],
)
def test_bad_usage_ends_with_2_and_says_nothing_on_standard_output(args: tuple[str, ...]) -> None:
    code, out, err = call(*args)
    assert (code, out) == (2, "")
    assert err


def test_all_bad_options_and_the_file_s_faults_come_together(tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(
        "schema = 1\nsead = 1\n[link.up]\nrate_bps = 1\ndelay_s = 1\n[link.down]\nrate_bps = 1\ndelay_s = 1\n"
    )
    code, out, err = call(
        "run", str(file), "--uplink", "380", "--latency=-1s", "--seed", "x", "--autonomy", "ful", "--time-limit", "0s"
    )  # fmt: skip
    assert (code, out) == (2, "")
    for said in ("--uplink: '380'", "--latency: -1s", "--seed: 'x'", "'ful'\n  Did you mean 'full'?", "--time-limit"):
        assert said in err
    assert f"{file}:2:1: sead: unknown key" in err


@pytest.mark.parametrize(
    ("option", "text"),
    [
        ("uplink", "0bps"),
        ("uplink", "-1kbps"),
        ("uplink", "380"),
        ("uplink", "10s"),
        ("uplink", "nan"),
        ("downlink", ""),
        ("latency", "10"),
        ("latency", "-1s"),
        ("latency", "10bps"),
        ("latency", "1e400s"),
        ("autonomy", "FULL"),
        ("autonomy", ""),
        ("pacing", "fast"),
        ("seed", "1.5"),
        ("seed", "-1"),
        ("seed", "9" * 5000),
        ("time_limit", "0s"),
        ("time_limit", "inf"),
    ],
)
def test_a_bad_option_is_named_once(tmp_path: Path, option: str, text: str) -> None:
    assert list(refusals(tmp_path, **{option: text})) == [f"--{option.replace('_', '-')}"]


def test_options_reach_the_scenario_with_their_units(tmp_path: Path) -> None:
    made = scenario_from(
        "src-dish",
        {
            "--uplink": "64bps",
            "--downlink": "50kbps",
            "--latency": "250ms",
            "--autonomy": "low",
            "--pacing": "eager",
            "--seed": "7",
            "--time-limit": "5min",
        },
        tmp_path,
    )
    assert (made.link.up.rate_bps, made.link.down.rate_bps) == (64.0, 50e3)
    assert (made.link.up.delay_s, made.link.down.delay_s) == (0.25, 0.25)
    assert (made.autonomy, made.pacing, made.seed, made.time_limit_s) == ("low", "eager", 7, 300.0)
    assert made.link.up.delay_source == "given: --latency"


def test_options_left_out_change_nothing(tmp_path: Path) -> None:
    assert chosen(tmp_path, uplink=None, seed=None) == chosen(tmp_path)


def test_every_option_of_the_table_is_one_of_run() -> None:
    _, out, _ = call("run", "--help")
    assert all(option.name in out for option in OPTIONS)


def test_an_output_directory_that_cannot_be_is_refused_before_anything_runs(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    assert refusals(file)["--out"].endswith("file is not a directory")
    assert refusals(file / "deeper")["--out"].endswith("file is not a directory")
    (tmp_path / "src-dish_seed1.mcap").mkdir()
    assert "--out" in refusals(tmp_path)


def test_an_output_directory_that_may_not_be_made_is_refused_and_nothing_runs(tmp_path: Path) -> None:
    closed = tmp_path / "closed"
    if os.geteuid() == 0:  # root may write into every directory, but not below a file
        closed.write_text("")
    else:
        closed.mkdir(mode=0o500)
    assert "--out" in refusals(closed / "out")
    code, out, err = call("run", "src-dish", "--out", str(closed / "out"), "--json")
    assert (code, out) == (2, "")
    assert err.startswith(f"--out: {closed} ")


def test_links_that_lead_nowhere_are_refused(tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "gone").symlink_to("nowhere")
    for name in ("loop", "gone"):
        assert refusals(tmp_path / name)["--out"] == f"{tmp_path / name} is a link that leads nowhere"
        log = short_log(tmp_path / "a.mcap")
        code, out, err = call("report", str(log), "--out", str(tmp_path / name / "deeper"))
        assert (code, out) == (2, "")
        assert "leads nowhere" in err


def test_long_texts_are_cut_short(tmp_path: Path) -> None:
    assert len(refusals(tmp_path, seed="9" * 5000)["--seed"]) < 80


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-", "2>full"])
def test_closed_streams_are_no_error(tmp_path: Path, closed: str) -> None:
    done = shell(f"scenarios list {closed}", tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("closed", ["2>&-", "2>full"])
def test_a_refusal_with_nowhere_to_go_still_has_its_exit_code(tmp_path: Path, closed: str) -> None:
    assert shell(f"run nosuch {closed}", tmp_path).returncode == 2


def test_a_full_disk_under_standard_output_is_named(tmp_path: Path) -> None:
    done = shell("scenarios list >full", tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("standard output: ")


def shell(line: str, cwd: Path) -> "subprocess.CompletedProcess[str]":
    """The command line where no file may grow, as on a full disk."""
    line = f"ulimit -f 0; {shlex.quote(str(COMMAND))} {line}"
    return subprocess.run(line, shell=True, cwd=cwd, capture_output=True, text=True, check=False)


def test_a_termination_signal_counts_as_an_interruption(tmp_path: Path) -> None:
    fifo = tmp_path / "endless"
    os.mkfifo(fifo)
    run = subprocess.Popen([COMMAND, "scenarios", "check", fifo], stderr=subprocess.PIPE, text=True)
    with fifo.open("w"):  # returns when the command reads, so it has come that far
        run.send_signal(signal.SIGTERM)
        _, err = run.communicate(timeout=60)
    assert (run.returncode, err) == (130, "interrupted\n")


def test_an_import_that_an_interruption_broke_counts_as_one(capsys: pytest.CaptureFixture[str]) -> None:
    for error, code in ((KeyboardInterrupt(), 130), (ValueError("bad"), 2)):
        with pytest.raises(typer.Exit) as ended, errors_shown():
            raise ImportError("initialization failed") from error
        assert ended.value.exit_code == code
    assert capsys.readouterr().err.startswith("interrupted\ninternal error: ImportError: initialization failed\n")


def test_report_writes_its_files_beside_the_log_or_elsewhere_and_says_so(tmp_path: Path) -> None:
    log = short_log(tmp_path / "short_seed1.mcap")
    for args, home in (((), tmp_path), (("--out", str(tmp_path / "new")), tmp_path / "new")):
        code, out, err = call("report", str(log), *args)
        assert (code, err) == (0, "")
        assert "Per state" in out
        wrote = [Path(line.removeprefix("wrote ")) for line in out.splitlines() if line.startswith("wrote ")]
        assert wrote
        assert all(path.parent == home and path.stat().st_size for path in wrote)


def test_report_of_an_interrupted_run_says_so(tmp_path: Path) -> None:
    code, out, _ = call("report", str(short_log(tmp_path / "a.mcap", ended=False)))
    assert code == 0
    assert "interrupted: the log reads up to 20.0 s" in out


def test_report_of_what_is_no_log_ends_with_2(tmp_path: Path) -> None:
    file = tmp_path / "a.mcap"
    file.write_bytes(b"no log at all")
    code, out, err = call("report", str(file))
    assert (code, out) == (2, "")
    assert err.startswith(f"{file}: ")


def test_report_into_a_place_that_is_no_directory_ends_with_2(tmp_path: Path) -> None:
    log = short_log(tmp_path / "a.mcap")
    code, out, err = call("report", str(log), "--out", str(log))
    assert (code, out) == (2, "")
    assert str(log) in err


FELL = RunResult(
    scenario="a",
    seed=1,
    outcome="failed",
    cause="fell: left sole slipped",
    completion_time_s=math.nan,
    round_trips=2,
    operator_acts=3,
    wall_s=5.0,
    physics_s=4.0,
    log=Path("runs/a b_seed1.mcap"),
    states=[StateRow(state="START", visits=1, normal=1, auto=0, manual=0, retries=0, time_s=math.inf)],
)


def test_json_has_null_for_what_is_not_a_number() -> None:
    made = json.loads(result_json(FELL))
    assert made["completion_time_s"] is None
    assert [(state["state"], state["time_s"]) for state in made["states"]] == [("START", None)]
    assert made["log"] == "runs/a b_seed1.mcap"


def test_json_has_these_keys_and_no_others() -> None:
    made = json.loads(result_json(FELL))
    assert list(made) == [
        "scenario", "seed", "outcome", "cause", "completion_time_s", "round_trips", "operator_acts", "wall_s",
        "physics_s", "log", "states",
    ]  # fmt: skip
    assert [list(state) for state in made["states"]] == [
        ["state", "visits", "normal", "auto", "manual", "retries", "time_s"]
    ]


def test_the_summary_names_cause_and_next_command() -> None:
    lines = summary_lines(FELL)
    assert "a seed 1: failed: fell: left sole slipped" in lines
    assert lines[-1] == "next: teleop-sim report 'runs/a b_seed1.mcap'"
    done = summary_lines(replace(FELL, outcome="completed", completion_time_s=285.4))
    assert "a seed 1: completed in 4 min 45 s (285.400 s of simulated time)" in done


NOW = Progress(12.5, 1800.0, "DETECT_PANEL_COARSE", "normal", up_use=0.0, down_use=0.25, note="scan")


def test_plain_progress_is_one_line_a_change() -> None:
    lines: list[str] = []
    show = PlainLines("a seed 1", lines.append)
    recovering = replace(NOW, t_s=14.0, mode="auto")
    for now in (NOW, replace(NOW, t_s=13.0), recovering, replace(recovering, t_s=15.0, down_use=1.0)):
        show(now)
    assert len(lines) == 3
    assert lines[1] == "     12.5 s  DETECT_PANEL_COARSE          normal   up  0.0 % down 25.0 %  scan"


def test_live_progress_shows_clock_state_mode_and_link() -> None:
    text = live_text("a seed 1", NOW)
    for part in ("12.5 s", "30 min", "DETECT_PANEL_COARSE (normal)", "25.0 %", "scan"):
        assert part in text
    assert live_text("a seed 1", replace(NOW, note="")) == text.rpartition("\n")[0]


def test_a_reader_that_goes_away_is_no_error() -> None:
    for args in (["scenarios", "list"], ["scenarios", "show", "--schema"]):
        run = subprocess.Popen([COMMAND, *args], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        assert run.stdout is not None
        run.stdout.close()
        _, err = run.communicate(timeout=60)
        assert (run.returncode, err) == (0, b"")


def test_help_imports_nothing_heavy() -> None:
    heavy = "numpy, pandas, matplotlib, scipy, mujoco, pydantic, simpy, numba, pinocchio, casadi"
    code = f"import sys; import teleop_sim.cli_commands; print([m for m in '{heavy}'.split(', ') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_the_module_runs_as_the_command_does() -> None:
    done = subprocess.run([sys.executable, "-m", "teleop_sim", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == "teleop-sim 0.1.0\n"


def test_shell_completion_knows_the_scenarios() -> None:
    asked = {
        **os.environ,
        "_TELEOP_SIM_COMPLETE": "complete_bash",
        "COMP_WORDS": "teleop-sim run src",
        "COMP_CWORD": "2",
    }
    done = subprocess.run([COMMAND], env=asked, capture_output=True, text=True, check=False)
    assert done.stdout.split() == [name for name in list_scenarios() if name.startswith("src")]
    assert "src-dish" in done.stdout.split()


@pytest.mark.parametrize("file", sorted((ROOT / "examples").glob("*.toml")), ids=lambda file: file.stem)
def test_example_scenarios_load(file: Path) -> None:
    assert load_scenario(file).name == file.stem


def test_the_example_that_reads_a_log_reads_one(tmp_path: Path) -> None:
    log = short_log(tmp_path / "a.mcap")
    done = subprocess.run(
        [sys.executable, ROOT / "examples/read_a_log.py", log], capture_output=True, text=True, check=True
    )
    assert "DETECT_PANEL_COARSE" in done.stdout or "START" in done.stdout
    alone = subprocess.run(
        [sys.executable, ROOT / "examples/read_a_log.py"], capture_output=True, text=True, check=False
    )
    assert alone.stderr.startswith("usage: ")


def test_python_in_the_readme_runs(tmp_path: Path) -> None:
    short_log(tmp_path / "runs/src-dish_seed1.mcap")
    analysis, _ = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    done = subprocess.run([sys.executable, "-c", analysis], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "START" in done.stdout


def test_the_blackout_of_the_readme_can_be_added_as_it_says(tmp_path: Path) -> None:
    readme, shown = (ROOT / "README.md").read_text(), call("scenarios", "show", "src-dish")[1]
    before, after = "blackouts = []", "blackouts = [[60.0, 120.0]]"
    assert before in readme
    assert after in readme
    assert shown.count(before) == 2
    up = read_scenario(shown.replace(before, after, 1), "my.toml", "my").link.up
    assert up.blackouts == ((60.0, 120.0),)
