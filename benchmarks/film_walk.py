"""Look at a walk of each robot over a bump and under pushes, as contact sheets: from behind and from the right.

python benchmarks/film_walk.py [--seed 3] [--every 1.5] [--out film]

The walks are those of ``walk_study.py``. Needs EGL, see ``film.py``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

# First: it chooses EGL before mujoco is loaded.
from film import sheet, shoot, soften  # isort: skip
import mujoco
from walk_study import disturbances_of, goal_of, ranges_of

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Walk
from teleop_sim.robot.episode import NoiseKey, perform
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import Plant


def walked(robot: str, seed: int, every_s: float, size: int, out: Path) -> Path:
    goal = goal_of(seed)
    what = disturbances_of(robot, seed, ranges_of(robot))
    spec = ROBOTS[robot]()
    plant = Plant(spec.model, BareFloor(), disturbances=what)
    body = Body(spec, plant)
    episode = perform(body, Walk((goal,)), body.standing(), NoiseKey(seed, 0, 1))
    soften(plant)
    renderer = mujoco.Renderer(plant.model, size, size)
    seen, strips, due_s = episode.samples, [], 0.0
    columns = ["t_s", *(f"pelvis{i}" for i in range(7)), *plant.joint_names]
    for t_s, pelvis, joints in zip(seen.t_s, seen.pelvis, seen.joints, strict=True):
        if t_s >= due_s - 1e-6:
            sample = np.concatenate([[t_s], pelvis, joints])
            strips.append(shoot(renderer, plant, sample, columns, f"{robot} {t_s:.1f} s {episode.outcome}", False))
            due_s = t_s + every_s
    renderer.close()
    target = out / f"walk_{robot}_{seed}.png"
    sheet(strips[:24], 4).save(target)
    return target


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--every", type=float, default=1.5)
    parser.add_argument("--size", type=int, default=240)
    parser.add_argument("--out", type=Path, default=Path("film"))
    told = parser.parse_args()
    told.out.mkdir(parents=True, exist_ok=True)
    for robot in ROBOTS:
        print(walked(robot, told.seed, told.every, told.size, told.out))


if __name__ == "__main__":
    main()
