"""The command ``report``: formats, places, and every wrong input at once."""

import math
from pathlib import Path

import pytest
from typer.testing import CliRunner

from teleop_sim.cli_commands import app
from teleop_sim.core.records import RunEnded, RunStarted, TransitionTaken
from teleop_sim.log.writer import LogWriter


def call(*args: object) -> tuple[int, str, str]:
    """Exit code, standard output and standard error."""
    done = CliRunner().invoke(app, ["report", *map(str, args)], prog_name="teleop-sim")
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    return done.exit_code, done.stdout, done.stderr


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "short_seed1.mcap"
    with LogWriter(path) as writer:
        writer(RunStarted(0.0, "short", "", 1, 0, 1800.0, ""))
        writer(TransitionTaken(20.0, "START", "go", "END", 0.0, "autonomous", "normal", 0, 0, 3, 0.0, ""))
        writer(RunEnded(30.0, "failed", "fell", math.nan, 0, 0))
    return path


def wrote(out: str) -> list[Path]:
    return [Path(line.removeprefix("wrote ")) for line in out.splitlines() if line.startswith("wrote ")]


def test_one_page_beside_the_log_unless_something_else_is_asked_for(log: Path) -> None:
    code, out, err = call(log)
    assert (code, err) == (0, "")
    assert wrote(out) == [log.with_suffix(".html")]
    assert "Per state" in out


@pytest.mark.parametrize("args", [("--format", "csv,svg"), ("--format", "svg", "--format", " csv")])
def test_several_formats_with_commas_or_one_by_one(log: Path, tmp_path: Path, args: tuple[str, ...]) -> None:
    code, out, _ = call(log, "--out", tmp_path / "new", *args)
    assert code == 0
    assert {path.suffix for path in wrote(out)} == {".csv", ".svg"}
    assert {path.parent for path in wrote(out)} == {tmp_path / "new"}


def test_all_formats(log: Path) -> None:
    _, out, _ = call(log, "--format", "all")
    assert {path.suffix for path in wrote(out)} == {".html", ".png", ".svg", ".csv", ".tex", ".md"}
    assert len(set(wrote(out))) == len(wrote(out))


def test_every_wrong_input_is_told_at_once(log: Path, tmp_path: Path) -> None:
    code, out, err = call(tmp_path / "no.mcap", "--format", "htlm,svg,pgn", "--out", log, "--open")
    assert (code, out) == (2, "")
    assert "--format: unknown name 'htlm'\n  Did you mean 'html'?" in err
    assert "--format: unknown name 'pgn'" in err
    assert f"--out: {log} is not a directory" in err
    assert f"{tmp_path / 'no.mcap'}: no such file" in err
    code, _, err = call(log, "--format", "csv", "--open")
    assert (code, err) == (2, "--open: there is no page to open\n  Add --format html.\n")


def test_a_directory_that_is_no_sweep_s(log: Path, tmp_path: Path) -> None:
    code, _, err = call(tmp_path)
    assert code == 2
    assert err.startswith(
        f"{tmp_path}: is a directory of 1 logs without sweep.json\n  Give one of its logs, such as {log}"
    )
    (tmp_path / "empty").mkdir()
    assert "Give a log or a sweep's directory." in call(tmp_path / "empty")[2]
