"""Look at picking, carrying, placing and inserting, as contact sheets: from ahead on the left and from behind.

python benchmarks/film_pick.py [--robots valkyrie ...] [--task box|plug] [--seed 1] [--error 1] [--every 1] [--out film]

The trials are those of ``pick_study.py``. Needs EGL, see ``film.py``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import mujoco
import numpy as np
from film import sheet, strip
from pick_study import box_trial, plug_trial

from teleop_sim.robot.robots import ROBOTS
from teleop_sim.world.drawing import Painter, View
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


def views(plant: Plant) -> list[View]:
    """From ahead on the left and from behind."""
    x, y, _ = plant.data.body(1).xpos.tolist()
    return [View((x + 0.2, y, 0.9), np.radians(azimuth), np.radians(-15.0), 2.8) for azimuth in VIEWS_DEG]


def filmed(robot: str, task: str, seed: int, error_m: float, every_s: float, size: int, out: Path) -> Path:
    FILMED.clear()
    trial = (box_trial if task == "box" else plug_trial)(robot, seed, error_m, plant=Filmed)
    plant = FILMED[0]
    strips = []
    with Painter(plant, size, size) as painter:
        for k in range(0, len(plant.taken), round(every_s / TICK_S)):
            plant.data.qpos[:] = plant.taken[k]
            mujoco.mj_forward(plant.model, plant.data)
            words = f"{robot} {k * TICK_S:.1f} s, in the end {trial.step}: {trial.outcome}"
            strips.append(strip(painter, views(plant), words))
    target = out / f"pick_{task}_{robot}_{seed}.png"
    sheet(strips).save(target)
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
