"""``teleop-sim replay``: a log in MuJoCo's viewer, or as a video.

Heavy modules are imported inside, so that ``--help`` and shell completion answer at once.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from teleop_sim.cli_errors import errors_shown
from teleop_sim.cli_io import say, warn
from teleop_sim.core.units import format_time
from teleop_sim.replay.names import CAMERA_NAMES

if TYPE_CHECKING:
    from teleop_sim.cli_replay_options import Asked

_Text = str | None


def _complete_camera(incomplete: str) -> list[str]:
    return [name for name in CAMERA_NAMES if name.startswith(incomplete)]


_Log = Annotated[Path, typer.Argument(help="A log, such as runs/src-dish_seed1.mcap.", metavar="LOG")]
_Video = Annotated[Path | None, typer.Option(help="Write this .mp4 file instead of opening a window.", metavar="FILE")]
_From = Annotated[_Text, typer.Option("--from", help="Simulated time to begin at, such as 60s.", metavar="TIME")]
_To = Annotated[_Text, typer.Option("--to", help="Simulated time to end at, such as 2min.", metavar="TIME")]
_Speed = Annotated[str, typer.Option(help="Simulated seconds a second, such as 4 or 0.5.", metavar="FACTOR")]
_Fps = Annotated[_Text, typer.Option(help="Pictures a second of the video; left out: 25.", metavar="N")]
_Size = Annotated[_Text, typer.Option(help="Of the video in pixels; left out: 960x540.", metavar="WIDTHxHEIGHT")]
_Camera = Annotated[str, typer.Option(help="behind, side or station.", metavar="NAME", autocompletion=_complete_camera)]
_Skip = Annotated[bool, typer.Option("--skip-waits", help="Leave out of the video where nothing moves.")]
_Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")]


def replay(
    log: _Log,
    video: _Video = None,
    start: _From = None,
    end: _To = None,
    speed: _Speed = "1",
    fps: _Fps = None,
    size: _Size = None,
    camera: _Camera = "behind",
    skip_waits: _Skip = False,
    quiet: _Quiet = False,
) -> None:
    """Show the run in LOG again, in MuJoCo's viewer or, with --video, as a file.

    Keys in the viewer: space pauses; left and right arrow go 5 s back and ahead; plus and minus change the speed; Home
    and End go to the ends; the mouse moves the camera. Between two samples of the log, 0.2 s apart, what is shown lies
    on a straight line: for display only.
    """
    given = {"--from": start, "--to": end, "--speed": speed, "--fps": fps, "--size": size, "--camera": camera}
    with errors_shown():
        from teleop_sim.cli_replay_options import asked_for

        asked = asked_for(log, video, given, skip_waits)
        if not asked.log.whole and not quiet:
            warn(f"{log}: cut off; what is whole of it ends at {format_time(asked.log.end_s)}")
        if asked.video is None:
            _in_window(asked)
        else:
            _into_file(asked, asked.video, quiet)


def _in_window(asked: Asked) -> None:
    import time

    from teleop_sim.replay.play import play
    from teleop_sim.replay.player import KEYS
    from teleop_sim.world.window import need_display

    need_display()
    say(f"keys: {KEYS}")
    play(asked.log, asked.cut.from_s, asked.cut.to_s, asked.cut.speed, asked.camera, time.perf_counter, time.sleep)


def _into_file(asked: Asked, video: Path, quiet: bool) -> None:
    from teleop_sim.replay.video import write_video

    with _progress(video.name, quiet) as progress:
        count = write_video(asked.log, video, asked.cut, asked.size_px, asked.camera, progress)
    shown = format_time(count / asked.cut.fps)
    say(f"{video}: {count} pictures, {shown}, {video.stat().st_size / 1e6:.1f} MB")


@contextmanager
def _progress(title: str, quiet: bool) -> Iterator[Callable[[int, int], None] | None]:
    """A bar on a terminal; elsewhere nothing."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=None)
        yield lambda done, count: bar.update(task, completed=done, total=count)
