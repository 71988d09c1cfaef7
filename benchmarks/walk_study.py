"""Randomised walks of every robot: how many arrive, and why the others do not.

python benchmarks/walk_study.py [--robots atlas,valkyrie] [--walks 60] [--first-seed 1] [--jobs 2]

A walk goes 2 to 4 m in a direction within 60 degrees and ends turned by up to 60 degrees more. All else comes from
``DisturbanceRanges``: floor friction 0.4 to 1, masses within 5 %, the trunk's centre of mass off by 1 cm (one sigma) in
each direction, a push of 20 N for 0.2 s every 2.5 to 4 s, and a bump across the way of 2 cm (THORMANG3: 1 cm).
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from teleop_sim.core.streams import stream
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import PlanarPose, Walk
from teleop_sim.robot.episode import NoiseKey, perform
from teleop_sim.robot.gait import body_between, wrap
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.disturbance_draw import Ground, draw_disturbances
from teleop_sim.world.disturbance_ranges import DisturbanceRanges, PlateRanges, PushRanges
from teleop_sim.world.disturbances import Disturbances
from teleop_sim.world.plant import Plant

PUSHES = PushRanges(force_n=(20.0, 20.0), duration_s=(0.2, 0.2))
HARD = DisturbanceRanges(floor_friction=(0.4, 1.0), pushes=PUSHES, bumps=PlateRanges(height_m=(0.02, 0.02)))
SMALL = {"thormang3": replace(HARD, bumps=PlateRanges(height_m=(0.01, 0.01)))}
MASS_ERROR, COM_ERROR_M = 0.05, 0.01
ARRIVED_M, ARRIVED_RAD = 0.05, math.radians(3.0)


@dataclass(frozen=True)
class Walked:
    """One trial."""

    seed: int
    outcome: str
    cause: str
    missed_m: float
    missed_rad: float
    duration_s: float
    down: bool

    @property
    def arrived(self) -> bool:
        return self.outcome == "reached" and self.missed_m <= ARRIVED_M and self.missed_rad <= ARRIVED_RAD


def goal_of(seed: int) -> PlanarPose:
    rng = np.random.default_rng((seed, 60))
    far_m, bearing, turn = rng.uniform(2.0, 4.0), rng.uniform(-np.pi / 3, np.pi / 3), rng.uniform(-np.pi / 3, np.pi / 3)
    return float(far_m * np.cos(bearing)), float(far_m * np.sin(bearing)), float(bearing + turn)


def ranges_of(robot: str) -> DisturbanceRanges:
    return SMALL.get(robot, HARD)


def disturbances_of(robot: str, seed: int, ranges: DisturbanceRanges) -> Disturbances:
    """One trial's, with masses and centre of mass in which small errors are likelier than great ones."""
    streams, goal, model = partial(stream, seed, 0), goal_of(seed), ROBOTS[robot]().model
    what = draw_disturbances(streams, ranges, Ground(((0.0, 0.0), goal[:2]), BareFloor().friction), model)
    rng = streams("disturbances.body")
    share, com = rng.uniform(-1.0, 1.0), rng.normal(0.0, COM_ERROR_M, 3)
    x, y, z = (float(v) for v in com)
    return replace(what, mass_factor=1.0 + share * MASS_ERROR, com_error_m=(x, y, z))


def walk_once(robot: str, seed: int, ranges: DisturbanceRanges | None = None) -> Walked:
    spec, goal = ROBOTS[robot](), goal_of(seed)
    what = disturbances_of(robot, seed, ranges or ranges_of(robot))
    body = Body(spec, Plant(spec.model, BareFloor(), disturbances=what))
    episode = perform(body, Walk((goal,)), body.standing(), NoiseKey(seed, 0, 1))
    x, y, yaw = body_between(body.feet())
    missed_m, missed_rad = math.hypot(x - goal[0], y - goal[1]), abs(wrap(yaw - goal[2]))
    return Walked(seed, episode.outcome, episode.cause, missed_m, missed_rad, episode.duration_s, body.has_fallen())


def study(robot: str, seeds: range, jobs: int, push_s: float) -> list[Walked]:
    ranges = replace(ranges_of(robot), pushes=replace(PUSHES, duration_s=(push_s, push_s)))
    with ProcessPoolExecutor(jobs) as pool:
        return list(pool.map(partial(walk_once, robot, ranges=ranges), seeds))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", default=",".join(ROBOTS))
    parser.add_argument("--walks", type=int, default=60)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--push-s", type=float, default=PUSHES.duration_s[0])
    told = parser.parse_args()
    print("| robot | arrived | fell | off | fell, but told as arrived | worst miss cm | worst heading deg | median s |")
    print("|---|---|---|---|---|---|---|---|")
    for robot in told.robots.split(","):
        walks = study(robot, range(told.first_seed, told.first_seed + told.walks), told.jobs, told.push_s)
        up = [w for w in walks if w.outcome == "reached"]
        arrived, fell = sum(w.arrived for w in walks), sum(w.outcome == "fell" for w in walks)
        lied = sum(w.outcome == "reached" and w.down for w in walks)
        miss, turn = max((w.missed_m for w in up), default=0.0), max((w.missed_rad for w in up), default=0.0)
        seconds = float(np.median([w.duration_s for w in up or walks]))
        print(
            f"| {robot} | {arrived}/{len(walks)} | {fell} | {len(up) - arrived} | {lied} | {100 * miss:.1f} |"
            f" {math.degrees(turn):.1f} | {seconds:.1f} |",
            flush=True,
        )
        for cause, count in Counter(f"seed {w.seed}: {w.cause}" for w in walks if not w.arrived).items():
            print(f"    {count} {cause}")


if __name__ == "__main__":
    main()
