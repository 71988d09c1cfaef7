"""Look at a run as contact sheets: every row of pictures is a time, seen from behind the robot and from its side.

python benchmarks/film.py runs/src-dish_seed1.mcap --every 2 --out film

Needs EGL (Debian: libegl1, libgl1-mesa-dri). ``teleop-sim replay LOG --video`` makes a video of the same.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from teleop_sim.log.load import load
from teleop_sim.replay.cameras import behind, beside, followed, nearness, side_of_thing
from teleop_sim.replay.scene import Scene
from teleop_sim.replay.telling import Telling
from teleop_sim.world.drawing import Painter, View

ACROSS, ON_A_SHEET = 4, 24


def near_hands(scene: Scene, t_s: float) -> tuple[View, View]:
    """Near what is before the robot, or the thing: from the shoulder that is nearer to it and from its side."""
    x, y, z, heading = followed(scene, t_s)
    at = (x + 0.4 * math.cos(heading), y + 0.4 * math.sin(heading), z + 0.05)
    if scene.thing is not None and nearness(scene, x, y) > 0.0:
        at = scene.thing
    side = side_of_thing(scene)
    return (
        View(at, heading - side * math.radians(45.0), math.radians(-35.0), 1.5),
        View(at, heading - side * math.radians(100.0), math.radians(-10.0), 1.5),
    )


def strip(painter: Painter, views: Sequence[View], words: str) -> Image.Image:
    """One instant from all views, side by side."""
    made = Image.fromarray(np.hstack([painter.draw(view) for view in views]))
    ImageDraw.Draw(made).text((4, 2), words, fill=(255, 255, 0), stroke_width=1, stroke_fill=(0, 0, 0))
    return made


def sheet(strips: Sequence[Image.Image], across: int = ACROSS) -> Image.Image:
    """Strips in reading order."""
    width, height = strips[0].size
    page = Image.new("RGB", (width * min(across, len(strips)), height * -(-len(strips) // across)))
    for k, made in enumerate(strips):
        page.paste(made, (width * (k % across), height * (k // across)))
    return page


def due(times_s: Sequence[float], every_s: float, start_s: float = 0.0, stop_s: float = math.inf) -> Iterator[float]:
    """The first of the times in each stretch of ``every_s``."""
    due_s = start_s
    for t_s in times_s:
        if due_s - 1e-6 <= t_s <= stop_s:
            yield t_s
            due_s = t_s + every_s


def film(path: Path, out: Path, every_s: float, start_s: float, stop_s: float, close: bool, size: int) -> list[Path]:
    """Draw a log; return the sheets' paths."""
    log = load(path)
    scene, telling = Scene.of(log), Telling.of(log)
    shown: list[Image.Image] = []
    with Painter(scene.plant, size, size) as painter:
        for t_s in due(scene.track.t_s.tolist(), every_s, start_s, stop_s):
            scene.at(t_s)
            views = near_hands(scene, t_s) if close else (behind(scene, t_s), beside(scene, t_s))
            told = telling.at(t_s)
            shown.append(strip(painter, views, f"{t_s:.1f} s {told.state} {told.doing}"))
    out.mkdir(parents=True, exist_ok=True)
    written = []
    for k in range(0, len(shown), ON_A_SHEET):
        target = out / f"{path.stem}_{k // ON_A_SHEET:02d}.png"
        sheet(shown[k : k + ON_A_SHEET]).save(target)
        written.append(target)
    return written


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=Path)
    parser.add_argument("--every", type=float, default=2.0, help="seconds between pictures")
    parser.add_argument("--start", type=float, default=0.0)
    parser.add_argument("--stop", type=float, default=np.inf)
    parser.add_argument("--close", action="store_true", help="near the hands")
    parser.add_argument("--size", type=int, default=240, help="pixels a view")
    parser.add_argument("--out", type=Path, default=Path("film"))
    args = parser.parse_args()
    for target in film(args.log, args.out, args.every, args.start, args.stop, args.close, args.size):
        print(target)


if __name__ == "__main__":
    main()
