"""A run as pictures in time: which times are shown, and each picture with its words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from teleop_sim.replay.cameras import CAMERAS
from teleop_sim.replay.scene import Scene
from teleop_sim.replay.strip import strip, strip_height_px
from teleop_sim.replay.telling import Telling
from teleop_sim.world.drawing import Painter, View

LINGER_S = 1.0
"""Where waits are skipped, what has moved is shown for so long [s of simulated time] after it came to rest."""
JUMP_SHOWN_S = 1.0
"""A jump is told for so long [s of video] after it."""


@dataclass(frozen=True)
class Cut:
    """What of a run is shown, and how fast.

    Attributes:
        from_s, to_s: simulated time [s].
        speed: simulated seconds a second of video.
        fps: pictures a second of video.
        skip_waits: leave out where nothing moves.

    """

    from_s: float
    to_s: float
    speed: float = 1.0
    fps: int = 25
    skip_waits: bool = False


@dataclass(frozen=True)
class Shot:
    """One picture: its simulated time, and what was left out shortly before it [s]."""

    t_s: float
    skipped_s: float = 0.0


def shots(cut: Cut, stirring: Sequence[tuple[float, float]]) -> list[Shot]:
    """The times that are shown, at least one.

    Args:
        cut: what is asked for.
        stirring: stretches in which something moved: what is kept where waits are skipped.

    """
    step_s = cut.speed / cut.fps
    made: list[Shot] = []
    last_s = cut.from_s
    for start_s, end_s in _kept(cut, stirring):
        skipped_s = start_s - last_s
        for k in range(max(1, 1 + int((end_s - start_s) / step_s + 1e-9))):
            made.append(Shot(start_s + k * step_s, skipped_s if k < JUMP_SHOWN_S * cut.fps else 0.0))
        last_s = end_s
    return made


def _kept(cut: Cut, stirring: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    if not cut.skip_waits:
        return [(cut.from_s, cut.to_s)]
    inside = [(max(a, cut.from_s), min(b, cut.to_s)) for a, b in stirring]
    return [(a, b) for a, b in inside if a < b] or [(cut.to_s, cut.to_s)]


class Film:
    """Pictures of a run, each with its words under it.

    Args:
        scene: of the run; is moved.
        telling: of the same run.
        painter: of that scene's plant, for the picture above the words.
        camera: a name in ``CAMERAS``.
        width_px, height_px: of the whole.

    """

    def __init__(self, scene: Scene, telling: Telling, painter: Painter, camera: str, width_px: int, height_px: int):
        self._scene, self._telling, self._painter = scene, telling, painter
        self._camera = CAMERAS[camera]
        self._size = width_px, height_px
        self._last: tuple[bytes, View, np.ndarray] | None = None

    def frames(self, taken: Sequence[Shot]) -> Iterator[np.ndarray]:
        """Each shot as (height, width, 3) uint8."""
        for shot in taken:
            words = strip(self._telling.at(shot.t_s), clock(shot), *self._size)
            yield np.vstack([self._picture(shot.t_s), words])

    def _picture(self, t_s: float) -> np.ndarray:
        posture = self._scene.at(t_s)
        view = self._camera(self._scene, t_s)
        where = posture.pelvis.tobytes() + posture.joints.tobytes()
        # A robot that waits looks as it did: most of a run is not drawn again.
        if self._last is None or self._last[:2] != (where, view):
            self._last = where, view, self._painter.draw(view)
        return self._last[2]


def picture_size_px(width_px: int, height_px: int) -> tuple[int, int]:
    """What is left of a video for its picture."""
    return width_px, height_px - strip_height_px(height_px)


def clock(shot: Shot) -> str:
    """Simulated time in minutes and seconds, and what was left out before it."""
    minutes, seconds = divmod(round(shot.t_s, 1), 60.0)
    jump = f"  ({shot.skipped_s:.0f} s later)" if shot.skipped_s >= 0.5 else ""
    return f"{minutes:.0f}:{seconds:04.1f}{jump}"
