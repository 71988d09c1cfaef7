"""Ways of a hand past a post: the quick ones against optimisation, by success and thread CPU time.

python benchmarks/way_study.py [--robots atlas,valkyrie] [--posts 12]

From the walking posture to over a handle, angles drawn, with a ball of 3 to 8 cm near the middle of the straight
way: in joint space it hits, so something cleverer is asked for. Ends stay free. What is found is checked with coal.
"""

from __future__ import annotations

import argparse
import functools
import time
from dataclasses import dataclass

import coal
import numpy as np
import pinocchio as pin
from crank_rate import SIDE, placed
from crank_study import Setting, handle_of, world_of

from teleop_sim.robot.body import Body
from teleop_sim.robot.chain_ik import two_stage
from teleop_sim.robot.circle_table import circle_of
from teleop_sim.robot.collision import Collisions
from teleop_sim.robot.crank_scene import Thing, crank_things
from teleop_sim.robot.skills.clear_way import searched
from teleop_sim.robot.skills.manipulate import Arm, arm_of, plan_stance, rest_posture, table_of
from teleop_sim.robot.templates import CRANK_STANDS
from teleop_sim.robot.ways import drawn_back, free_way


@dataclass(frozen=True)
class Tried:
    """One post: what found a way, and the seconds it took."""

    quick: bool
    quick_s: float
    optimised: bool
    optimised_s: float


def once(arm: Arm, rng: np.random.Generator) -> Tried | None:
    """One drawn post; nothing if it stands in an end or beside the way."""
    wheel_rad = float(rng.uniform(-np.pi, np.pi))
    handle = handle_of(world_of(Setting(arm.robot), 2), SIDE, wheel_rad, np.zeros(3))
    table, (start, stance) = table_of(arm, handle), plan_stance(arm)
    rest = rest_posture(arm, stance)
    solver = dict(two_stage(arm.kinematics, SIDE, stance, rest))[table.stage]
    place = circle_of(handle).place(handle.angle_rad, lift_m=0.1)
    ends = (solver.settle(start), solver.solve(table.at(handle.angle_rad), place, 40).q)
    halfway = pin.interpolate(arm.kinematics.model, *ends, float(rng.uniform(0.35, 0.65)))
    at = arm.kinematics.tool_pose(halfway, SIDE)[1] + rng.normal(0.0, 0.02, 3)
    post = Thing("post", pin.SE3(np.eye(3), at), coal.Sphere(float(rng.uniform(0.03, 0.08))))
    things = (*crank_things(handle, SIDE), post)
    collisions = Collisions(arm.robot, things)
    if min(collisions.nearest(q).gap_m for q in ends) < 0.01 or collisions.along(ends, 0.0) is None:
        return None
    start_s = time.thread_time()
    quick = free_way(collisions, *ends, rest, functools.partial(drawn_back, solver, ends[1])).touches is None
    between_s = time.thread_time()
    found = searched(arm, solver, collisions, ends, rest, things)
    return Tried(quick, between_s - start_s, found is not None, time.thread_time() - between_s)


def study(robot: str, posts: int) -> list[Tried]:
    arm, rng = arm_of(placed(Body, robot, 0.004), SIDE), np.random.default_rng(7)
    tried: list[Tried] = []
    while len(tried) < posts:
        one = once(arm, rng)
        tried += [] if one is None else [one]
    return tried


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", default=",".join(CRANK_STANDS))
    parser.add_argument("--posts", type=int, default=12)
    told = parser.parse_args()
    print("| robot | posts | quick finds | ms | optimised finds | ms | of those quick misses | both |")
    print("|---|---|---|---|---|---|---|---|")
    for robot in told.robots.split(","):
        tried = study(robot, told.posts)
        missed = [t for t in tried if not t.quick]
        rescued, either = sum(t.optimised for t in missed), sum(t.quick or t.optimised for t in tried)
        quick_ms, slow_ms = (1e3 * float(np.median([getattr(t, n) for t in tried])) for n in ("quick_s", "optimised_s"))
        print(
            f"| {robot} | {len(tried)} | {sum(t.quick for t in tried)} | {quick_ms:.0f} |"
            f" {sum(t.optimised for t in tried)} | {slow_ms:.0f} | {rescued}/{len(missed)} | {either} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
