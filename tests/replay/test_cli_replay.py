"""``teleop-sim replay`` as typed: files, messages, exit codes."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from teleop_sim.cli_commands import app
from teleop_sim.cli_replay_options import asked_for
from teleop_sim.core.errors import BadInput


def call(*args: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, ["replay", *map(str, args)], prog_name="teleop-sim")
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr


def refused(log: Path, video: Path | None, skip_waits: bool = False, **given: str) -> dict[str, str]:
    with pytest.raises(BadInput) as error:
        asked_for(log, video, {f"--{name}": text for name, text in given.items()}, skip_waits)
    return {p.where: str(p) for p in error.value.problems}


def test_a_video_is_written_and_told_of(dish, tmp_path):
    out = tmp_path / "walk.mp4"
    code, said, warned = call(
        dish.log.path,
        "--video",
        out,
        "--from",
        "20s",
        "--to",
        "0.35min",
        "--fps",
        5,
        "--size",
        "240x180",
        "--camera",
        "side",
    )
    assert (code, warned) == (0, "")
    assert said.startswith(f"{out}: 6 pictures, 1.2 s, ")
    assert [p.name for p in tmp_path.iterdir()] == ["walk.mp4"]


def test_all_that_is_wrong_is_told_at_once(tmp_path):
    code, said, warned = call(
        tmp_path / "no.mcap", "--video", tmp_path / "no" / "a.avi", "--from", "3min", "--to", "60s",
        "--speed", "0", "--fps", "many", "--size", "961x540", "--camera", "sid",
    )  # fmt: skip
    assert (code, said) == (2, "")
    for part in (
        "no.mcap: no such file",
        "--from: 3min is after --to 60s",
        "--speed: '0'",
        "--fps: 'many'",
        "--size: '961x540'",
        "Did you mean 'side'?",
        "ends in '.avi'",
        f"there is no directory {tmp_path / 'no'}",
    ):
        assert part in warned


@pytest.mark.parametrize(
    ("given", "where"),
    [
        ({"from": "10"}, "--from"),
        ({"to": "later"}, "--to"),
        ({"from": "99min"}, "--from"),
        ({"from": "-1s"}, "--from"),
        ({"speed": "-2"}, "--speed"),
        ({"speed": "nan"}, "--speed"),
        ({"speed": "inf"}, "--speed"),
        ({"fps": "0"}, "--fps"),
        ({"fps": "1.5"}, "--fps"),
        ({"fps": "²"}, "--fps"),
        ({"fps": "1000"}, "--fps"),
        ({"size": "540"}, "--size"),
        ({"size": "0x0"}, "--size"),
        ({"size": "100000x100000"}, "--size"),
        ({"size": "960x541"}, "--size"),
        ({"camera": ""}, ""),
    ],
)
def test_options_that_cannot_be(dish, tmp_path, given, where):
    if not where:
        assert asked_for(dish.log.path, tmp_path / "a.mp4", {"--camera": ""}, False).camera == "behind"
    else:
        assert list(refused(dish.log.path, tmp_path / "a.mp4", **given)) == [where]


def test_files_that_cannot_be_written(dish, tmp_path):
    log = dish.log.path
    (tmp_path / "folder.mp4").mkdir()
    assert "is a directory" in refused(log, tmp_path / "folder.mp4")["--video"]
    assert "has no suffix" in refused(log, tmp_path / "a")["--video"]
    assert "Make it first" in refused(log, tmp_path / "b" / "a.mp4")["--video"]
    link = tmp_path / "log.mp4"
    link.symlink_to(log)
    assert "the log itself" in refused(log, link)["--video"]


def test_what_only_a_video_has_is_refused_for_a_window(dish):
    assert list(refused(dish.log.path, None, True, fps="5", size="320x240")) == ["--fps", "--size", "--skip-waits"]


def test_logs_that_hold_no_motion(tmp_path, dish):
    empty = tmp_path / "empty.mcap"
    empty.write_bytes(b"")
    text = tmp_path / "text.mcap"
    text.write_text("no log")
    for path in (empty, text, tmp_path):
        assert list(refused(path, None)) == [str(path)]
    short = tmp_path / "short.mcap"
    short.write_bytes(dish.log.path.read_bytes()[:200])
    assert list(refused(short, None)) == [str(short)]


def test_a_cut_log_is_shown_up_to_the_cut(dish, tmp_path):
    # The first chunk is whole at two thirds of the file.
    whole = dish.log.path.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: len(whole) - 40])
    code, said, warned = call(cut, "--video", tmp_path / "a.mp4", "--fps", 1, "--speed", 30, "--size", "240x180")
    assert code == 0
    assert warned.startswith(f"{cut}: cut off; ")
    assert "pictures" in said


def test_without_a_display_a_video_is_proposed(dish, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    code, said, warned = call(dish.log.path)
    assert (code, said) == (2, "")
    assert warned.startswith("cannot draw: there is no display")
    assert "--video" in warned


def test_a_display_that_is_not_there_is_no_display(dish, monkeypatch):
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("DISPLAY", ":4711")
    code, _, warned = call(dish.log.path)
    assert (code, "--video" in warned) == (2, True)
