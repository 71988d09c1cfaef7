"""Pictures of the robot in each state of its machine, small enough for a page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO

import numpy as np
from PIL import Image

from teleop_sim.core.records import EpisodeEnded, Record, RunEnded, TransitionTaken
from teleop_sim.core.units import format_time
from teleop_sim.log.load import Log
from teleop_sim.replay.cameras import behind
from teleop_sim.replay.scene import Scene
from teleop_sim.world.drawing import Painter

MOST, FEW = 24, 3
"""More pictures than these nobody looks at; of a machine with fewer states that move, skills are shown (assumed)."""
QUALITY = 70
TOPICS = ("machine/transition", "field/episode", "run/ended")
_SLACK_S = 1e-6


@dataclass(frozen=True)
class Still:
    """What it looked like at one time: the state then, what stands under it, and the bytes of a JPEG file."""

    t_s: float
    state: str
    caption: str
    data: bytes


@dataclass(frozen=True)
class Stay:
    """Something that took from ``start_s`` to ``end_s``: a stay in a state or a skill in it, and how it ended."""

    start_s: float
    end_s: float
    state: str
    ended: str


def stills(log: Log, width_px: int = 320, height_px: int = 200) -> list[Still]:
    """The robot as it was when the motion was over, once for each stay in a state in which anything moved.

    Where fewer than ``FEW`` states moved anything, as where people do it all, there is one for each skill. Of more than
    ``MOST`` stays only each state's first counts, of these the longest. Where nothing moved there is one of the end.

    Raises:
        BadInput, LogDamaged: the plant cannot be rebuilt, see ``Scene.of``.
        CannotDraw: no OpenGL here.

    """
    scene = Scene.of(log)
    records = [record for topic in TOPICS for record in log.records(topic)]
    chosen = moments(records, scene.track.stirring(), log.end_s)
    made = []
    with Painter(scene.plant, width_px, height_px) as painter:
        for t_s, stay in chosen:
            scene.at(t_s)
            picture = painter.draw(behind(scene, t_s))
            made.append(Still(t_s, stay.state, caption(t_s, stay), jpeg(picture)))
    return made


def moments(
    records: Sequence[Record], stirring: Sequence[tuple[float, float]], end_s: float, most: int = MOST
) -> list[tuple[float, Stay]]:
    """When pictures are taken, and of what, in order of time.

    Args:
        records: transitions, episodes and the end, among others; each kind in order of time.
        stirring: stretches [s] in which something moved, in order of time.
        end_s: of the log.
        most: pictures.

    """
    found = _moved(stays(records, end_s), stirring)
    if len(found) < FEW:
        skills = [r for r in records if isinstance(r, EpisodeEnded)]
        found = _moved([Stay(r.start_s, r.t_s, r.state, f"{r.skill}: {r.outcome}") for r in skills], stirring) or found
    if len(found) > most:
        first = {stay.state: (t_s, stay) for t_s, stay in reversed(found)}
        found = sorted(first.values(), key=lambda m: (m[1].start_s - m[1].end_s, m[0]))[:most]
    return sorted(found, key=lambda m: m[0]) or [(end_s, stays(records, end_s)[-1])]


def stays(records: Sequence[Record], end_s: float) -> list[Stay]:
    """The machine's stays in states, self-loops joined; the last is cut by the log's end. At least one."""
    made: list[Stay] = []
    since_s, state = 0.0, ""
    for taken in (r for r in records if isinstance(r, TransitionTaken)):
        start_s, state = min(max(since_s, taken.entered_s), taken.t_s), taken.next_state
        if made and made[-1].state == taken.state and abs(made[-1].end_s - start_s) <= _SLACK_S:
            start_s = made.pop().start_s
        made.append(Stay(start_s, taken.t_s, taken.state, taken.event))
        since_s = taken.t_s
    ended = next((r.outcome for r in records if isinstance(r, RunEnded)), "interrupted")
    state = state or next((r.state for r in records if isinstance(r, EpisodeEnded)), "")
    return [*made, Stay(since_s, max(end_s, since_s), state, ended)]


def _moved(found: Sequence[Stay], stirring: Sequence[tuple[float, float]]) -> list[tuple[float, Stay]]:
    """Stays in which something moved, each with when that was over, at the latest when the stay was."""
    over = [
        (
            max(
                (min(b, s.end_s) for a, b in stirring if a < s.end_s - _SLACK_S and b > s.start_s + _SLACK_S),
                default=-1.0,
            ),
            s,
        )
        for s in found
    ]
    return [(t_s, stay) for t_s, stay in over if t_s >= 0.0]


def caption(t_s: float, stay: Stay) -> str:
    """Time, state (of a machine in a machine its own name) and how it ended."""
    return f"{format_time(t_s)} · {stay.state.rpartition('/')[2]} · {stay.ended}".replace(" ·  · ", " · ")


def jpeg(picture: np.ndarray) -> bytes:
    """A picture (height, width, 3) uint8 as a JPEG file."""
    file = BytesIO()
    Image.fromarray(picture).save(file, "JPEG", quality=QUALITY)
    return file.getvalue()
