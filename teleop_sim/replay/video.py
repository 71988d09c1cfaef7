"""A run as a video file: H.264 in MP4, which every browser plays."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import av
import numpy as np

from teleop_sim.log.load import Log
from teleop_sim.replay.frames import LINGER_S, Cut, Film, picture_size_px, shots
from teleop_sim.replay.scene import Scene
from teleop_sim.replay.telling import Telling
from teleop_sim.world.drawing import Painter

CODEC_OPTIONS = {"crf": "23", "preset": "veryfast", "x264-params": "mbtree=0"}
"""x264's constant rate factor, its own default; a speed that keeps up with the drawing; and no macroblock tree: that
reads memory which nobody has written, and the same pictures give other bytes (measured with PyAV 18.1)."""
THREADS = 2
"""Of x264, on every machine: its bytes depend on their number."""


def write_video(
    log: Log,
    out: Path,
    cut: Cut,
    size_px: tuple[int, int] = (960, 540),
    camera: str = "behind",
    progress: Callable[[int, int], None] | None = None,
) -> int:
    """Draw a run into ``out``; return the number of pictures.

    The file is written aside and takes its name when it is complete: an interrupted one leaves nothing, and what was
    there before stays. The same log gives the same pictures.

    Args:
        log: of the run. out: an ``.mp4`` file. cut: what is shown. camera: a name in ``cameras.CAMERAS``.
        size_px: width and height, both even.
        progress: called before each picture with how many are done and how many there are.

    Raises:
        BadInput, LogDamaged: the plant cannot be rebuilt, see ``Scene.of``.
        CannotDraw: no OpenGL here.
        OSError: the file cannot be written.

    """
    scene, telling = Scene.of(log), Telling.of(log)
    taken = shots(cut, scene.track.stirring(LINGER_S))
    with Painter(scene.plant, *picture_size_px(*size_px)) as painter:
        film = Film(scene, telling, painter, camera, *size_px)
        _encode(_counted(film.frames(taken), len(taken), progress), out, cut.fps, size_px)
    return len(taken)


def _counted(
    pictures: Iterable[np.ndarray], count: int, progress: Callable[[int, int], None] | None
) -> Iterator[np.ndarray]:
    for done, picture in enumerate(pictures):
        if progress is not None:
            progress(done, count)
        yield picture


def _encode(pictures: Iterable[np.ndarray], out: Path, fps: int, size_px: tuple[int, int]) -> None:
    part = out.with_name(f".{out.name}.{os.getpid()}.part")
    try:
        with av.open(str(part), "w", format="mp4", options={"movflags": "faststart"}) as file:
            stream = file.add_stream("libx264", rate=fps, options=CODEC_OPTIONS)
            stream.width, stream.height = size_px
            stream.pix_fmt = "yuv420p"
            stream.thread_count = THREADS
            for picture in pictures:
                file.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
            file.mux(stream.encode())
        part.replace(out)
    finally:
        part.unlink(missing_ok=True)
