"""Look at picking, carrying, placing and inserting, as contact sheets: from ahead on the left and from behind.

python benchmarks/film_pick.py [--robots valkyrie ...] [--task box|plug] [--seed 1] [--error 1] [--every 1] [--out film]

The trials are those of ``pick_study.py``. Needs EGL, see ``film.py``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

# First: it chooses EGL before mujoco is loaded.
from film import sheet, soften  # isort: skip
import mujoco
from pick_study import box_trial, plug_trial
from PIL import Image, ImageDraw

from teleop_sim.robot.robots import ROBOTS
from teleop_sim.world.plant import TICK_S, Plant

VIEWS_DEG = (130.0, 225.0)


class Filmed(Plant):
    """A plant that keeps what it was like after every control tick: samples of episodes know no free bodies."""

    def end_tick(self) -> None:
        super().end_tick()
        if not hasattr(self, "taken"):
            self.taken: list[np.ndarray] = []
            FILMED.append(self)
        self.taken.append(self.data.qpos.copy())


FILMED: list[Filmed] = []


def strip(renderer: mujoco.Renderer, plant: Plant, words: str) -> Image.Image:
    """One instant from all views."""
    option = mujoco.MjvOption()
    option.sitegroup[:] = 0
    pictures = []
    for azimuth in VIEWS_DEG:
        camera = mujoco.MjvCamera()
        camera.lookat[:] = plant.data.body(1).xpos * [1.0, 1.0, 0.0] + [0.2, 0.0, 0.9]
        camera.distance, camera.azimuth, camera.elevation = 2.4, azimuth, -15.0
        renderer.update_scene(plant.data, camera, option)
        pictures.append(Image.fromarray(renderer.render()))
    whole = Image.new("RGB", (sum(p.width for p in pictures), pictures[0].height))
    for k, picture in enumerate(pictures):
        whole.paste(picture, (k * picture.width, 0))
    ImageDraw.Draw(whole).text((4, 4), words, fill=(255, 255, 0))
    return whole


def filmed(robot: str, task: str, seed: int, error_m: float, every_s: float, size: int, out: Path) -> Path:
    FILMED.clear()
    trial = (box_trial if task == "box" else plug_trial)(robot, seed, error_m, plant=Filmed)
    plant = FILMED[0]
    soften(plant)
    renderer = mujoco.Renderer(plant.model, size, size)
    strips = []
    for k in range(0, len(plant.taken), round(every_s / TICK_S)):
        plant.data.qpos[:] = plant.taken[k]
        mujoco.mj_forward(plant.model, plant.data)
        strips.append(strip(renderer, plant, f"{robot} {k * TICK_S:.1f} s, in the end {trial.step}: {trial.outcome}"))
    renderer.close()
    target = out / f"pick_{task}_{robot}_{seed}.png"
    sheet(strips, 4).save(target)
    return target


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", nargs="*", default=list(ROBOTS))
    parser.add_argument("--task", choices=["box", "plug"], default="box")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--error", type=float, default=1.0, help="[cm]")
    parser.add_argument("--every", type=float, default=2.0)
    parser.add_argument("--size", type=int, default=200)
    parser.add_argument("--out", type=Path, default=Path("film"))
    told = parser.parse_args()
    told.out.mkdir(parents=True, exist_ok=True)
    for robot in told.robots:
        print(filmed(robot, told.task, told.seed, told.error / 100, told.every, told.size, told.out))


if __name__ == "__main__":
    main()
