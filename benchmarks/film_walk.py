"""Look at a walk of each robot over a bump and under pushes, as contact sheets: from behind and from the right.

python benchmarks/film_walk.py [--seed 3] [--every 1.5] [--out film]

The walks are those of ``walk_study.py``. Needs EGL, see ``film.py``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from film import ON_A_SHEET, due, sheet, strip
from walk_study import disturbances_of, goal_of, ranges_of

from teleop_sim.replay.cameras import behind, beside
from teleop_sim.replay.scene import Scene
from teleop_sim.replay.track import Track
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Walk
from teleop_sim.robot.episode import NoiseKey, perform
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.drawing import Painter
from teleop_sim.world.plant import Plant


def walked(robot: str, seed: int, every_s: float, size: int, out: Path) -> Path:
    goal = goal_of(seed)
    what = disturbances_of(robot, seed, ranges_of(robot))
    spec = ROBOTS[robot]()
    plant = Plant(spec.model, BareFloor(), disturbances=what)
    body = Body(spec, plant)
    episode = perform(body, Walk((goal,)), body.standing(), NoiseKey(seed, 0, 1))
    seen = episode.samples
    scene, strips = Scene(plant, Track(plant.joint_names, seen.t_s, seen.pelvis, seen.joints)), []
    with Painter(plant, size, size) as painter:
        for t_s in due(seen.t_s.tolist(), every_s):
            scene.at(t_s)
            strips.append(
                strip(painter, (behind(scene, t_s), beside(scene, t_s)), f"{robot} {t_s:.1f} s {episode.outcome}")
            )
    target = out / f"walk_{robot}_{seed}.png"
    sheet(strips[:ON_A_SHEET]).save(target)
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
