"""Options of ``teleop-sim replay``; all that is wrong with them and with the log at once."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from teleop_sim.core.errors import BadInput, LogDamaged, Problem, unknown_name
from teleop_sim.core.units import format_time, parse_time_s
from teleop_sim.log.load import Log, load
from teleop_sim.replay.frames import Cut
from teleop_sim.replay.names import CAMERA_NAMES
from teleop_sim.replay.track import Track

SIZE_PX, LEAST_PX, MOST_PX = (960, 540), (240, 180), 4096
FPS, MOST_FPS = 25, 120
SUFFIX = ".mp4"
_SIZE = re.compile(r"(\d{1,5})x(\d{1,5})\Z")


@dataclass(frozen=True)
class Asked:
    """What is shown: of which log, which part of it, and where. ``video`` None: in a window."""

    log: Log
    video: Path | None
    cut: Cut
    size_px: tuple[int, int]
    camera: str


def asked_for(log: Path, video: Path | None, given: Mapping[str, str | None], skip_waits: bool) -> Asked:
    """The options as values.

    Args:
        log: of the run. video: the file to write, if any.
        given: texts of ``--from``, ``--to``, ``--speed``, ``--fps``, ``--size`` and ``--camera``; None: not given.
        skip_waits: leave out where nothing moves.

    Raises:
        BadInput: every problem of log, file and options.

    """
    problems: list[Problem] = []
    opened = _opened(log, problems)
    from_s, to_s = _stretch(opened, given, problems)
    speed = _speed(given.get("--speed"), problems)
    fps = _fps(given.get("--fps"), problems)
    size_px = _size(given.get("--size"), problems)
    camera = given.get("--camera") or "behind"
    if camera not in CAMERA_NAMES:
        problems.append(unknown_name("--camera", camera, tuple(CAMERA_NAMES)))
    if video is not None:
        problems += _file_problems(video, log)
    else:
        only = [name for name in ("--fps", "--size") if given.get(name) is not None]
        only += ["--skip-waits"] if skip_waits else []
        problems += [Problem(name, "is of a video", "Give --video too, or leave it out.") for name in only]
    if problems or opened is None:
        raise BadInput(tuple(problems))
    return Asked(opened, video, Cut(from_s, to_s, speed, fps, skip_waits), size_px, camera)


def _opened(path: Path, problems: list[Problem]) -> Log | None:
    try:
        log = load(path)
        Track.of(log)
    except LogDamaged as error:
        where, why = error.args
        problems.append(Problem(where, why))
        return None
    return log


def _stretch(log: Log | None, given: Mapping[str, str | None], problems: list[Problem]) -> tuple[float, float]:
    """From and to [s]; without them the whole run."""
    end_s = math.inf if log is None else log.end_s
    times_s = {}
    for name, otherwise_s in (("--from", 0.0), ("--to", end_s)):
        text = given.get(name)
        try:
            times_s[name] = otherwise_s if text is None else parse_time_s(text, name)
        except BadInput as error:
            problems += error.problems
    from_s, to_s = times_s.get("--from", 0.0), min(times_s.get("--to", end_s), end_s)
    if from_s > end_s:
        what = f"{given['--from']} is after the log's end at {format_time(end_s)}"
        problems.append(Problem("--from", what, "Give an earlier time."))
    elif from_s > to_s:
        problems.append(Problem("--from", f"{given['--from']} is after --to {given['--to']}", "Give an earlier time."))
    return from_s, to_s


def _speed(text: str | None, problems: list[Problem]) -> float:
    try:
        speed = float(text or "1")
    except ValueError:
        speed = math.nan
    if not (0.0 < speed < math.inf):
        problems.append(Problem("--speed", f"{text!r} is no factor above zero", "Give one, such as 4 or 0.5."))
    return speed


def _fps(text: str | None, problems: list[Problem]) -> int:
    if text is None:
        return FPS
    if not (text.isdecimal() and 1 <= int(text) <= MOST_FPS):
        problems.append(Problem("--fps", f"{text!r} is not understood", f"Give a whole number, 1 to {MOST_FPS}."))
        return FPS
    return int(text)


def _size(text: str | None, problems: list[Problem]) -> tuple[int, int]:
    if text is None:
        return SIZE_PX
    found = _SIZE.match(text)
    width, height = (int(found[1]), int(found[2])) if found else (0, 0)
    fits = LEAST_PX[0] <= width <= MOST_PX and LEAST_PX[1] <= height <= MOST_PX
    if not fits or width % 2 or height % 2:
        limits = f"{LEAST_PX[0]}x{LEAST_PX[1]} to {MOST_PX}x{MOST_PX}"
        problems.append(
            Problem("--size", f"{text!r} is no size of a video", f"Give even numbers, {limits}, such as 960x540.")
        )
    return width, height


def _file_problems(video: Path, log: Path) -> list[Problem]:
    problems = []
    if video.suffix.lower() != SUFFIX:
        what = f"{video} ends in {video.suffix!r}" if video.suffix else f"{video} has no suffix"
        problems.append(Problem("--video", what, f"Videos are {SUFFIX} files: give such a name."))
    folder = video.parent
    if video.is_dir():
        problems.append(Problem("--video", f"{video} is a directory", "Give a file's name."))
    elif not folder.is_dir():
        problems.append(Problem("--video", f"there is no directory {folder}", "Make it first, or give another."))
    elif not os.access(folder, os.W_OK | os.X_OK):
        problems.append(Problem("--video", f"{folder} cannot be written to", "Give another directory."))
    elif video.exists() and log.exists() and video.samefile(log):
        problems.append(Problem("--video", f"{video} is the log itself", "Give another name."))
    return problems
