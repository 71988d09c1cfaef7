"""How fast robots walk: thread CPU time of whole episodes against a bare loop of MuJoCo over the same motion.

python benchmarks/physics_rate.py [--repeats 5]

The bare loop gets the same controls from the same state, so it meets the same contacts and ends in the same state, to
the last bit: what it does not do is the control law, the samples and all else. Runs alternate; medians are printed.
"""

from __future__ import annotations

import argparse
import statistics
import time
from dataclasses import dataclass

import mujoco
import numpy as np

from teleop_sim.robot import gait as g
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Walk
from teleop_sim.robot.episode import Episode, NoiseKey, perform
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.skill import Tick
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import TICK_S, Plant

KEY = NoiseKey(1, 0, 1)
BOUNDS = {0.002: 75.0, 0.004: 140.0}
OVERHEAD = 1.25
PLAN_S = 0.02


class Noted(Body):
    """A body that writes down its controls."""

    controls: list[np.ndarray]

    def tick(self, reference: Tick) -> bool:
        upright = super().tick(reference)
        self.controls.append(self.plant.data.ctrl.copy())
        return upright


@dataclass(frozen=True)
class Rate:
    """Times real time, walking and bare; median seconds to plan the walk."""

    walking: float
    bare: float
    plan_s: float

    @property
    def overhead(self) -> float:
        return self.bare / self.walking


def timed(body: Body, walk: Walk) -> tuple[Episode, float]:
    start_s = time.thread_time()
    episode = perform(body, walk, body.standing(), KEY)
    return episode, time.thread_time() - start_s


def replay(body: Body, controls: list[np.ndarray]) -> float:
    """CPU seconds of MuJoCo alone."""
    body.load(body.standing())
    model, data, n = body.plant.model, body.plant.data, body.plant.steps_per_tick
    start_s = time.thread_time()
    for control in controls:
        data.ctrl[:] = control
        mujoco.mj_step(model, data, n)
    return time.thread_time() - start_s


def plan_s(body: Body, walk: Walk) -> float:
    body.load(body.standing())
    gait = body.spec.gait
    start_s = time.thread_time()
    bodies = g.walk_bodies(g.body_between(body.feet()), walk.path, gait)
    steps = g.steps_along(bodies, g.LEFT, gait)
    g.make_plan(body.feet(), body.com()[:2], body.com_height_m, 0.0, steps, gait, TICK_S)
    return time.thread_time() - start_s


def rate(robot: str, timestep_s: float, repeats: int) -> Rate:
    spec, walk = ROBOTS[robot](), Walk(((2.0, 0.0, 0.5),))
    noted = Noted(spec, Plant(spec.model, BareFloor(), timestep_s=timestep_s))
    noted.controls = []
    episode = perform(noted, walk, noted.standing(), KEY)
    assert episode.outcome == "reached"
    body = Body(spec, Plant(spec.model, BareFloor(), timestep_s=timestep_s))
    walking, bare, plans = [], [], []
    for _ in range(repeats):
        bare.append(episode.physics_s / replay(body, noted.controls))
        assert np.array_equal(body.plant.pelvis(), episode.samples.pelvis[-1])
        walking.append(episode.physics_s / timed(body, walk)[1])
        plans.append(plan_s(body, walk))
    return Rate(*(statistics.median(values) for values in (walking, bare, plans)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    print("times real time by thread CPU time, walking 2 m and turning; medians")
    print(f"{'robot':10s} {'step ms':>8s} {'walking':>8s} {'bare':>8s} {'overhead':>9s} {'plan ms':>8s}")
    for robot in ROBOTS:
        for timestep_s, least in BOUNDS.items():
            r = rate(robot, timestep_s, repeats)
            met = r.walking >= least and r.overhead <= OVERHEAD and r.plan_s <= PLAN_S
            print(
                f"{robot:10s} {1e3 * timestep_s:8.0f} {r.walking:8.0f} {r.bare:8.0f} {r.overhead:9.2f}"
                f" {1e3 * r.plan_s:8.1f}{'' if met else '  missed'}",
                flush=True,
            )
    least = ", ".join(f"{bound:.0f} at {1e3 * step_s:.0f} ms" for step_s, bound in BOUNDS.items())
    print(f"bounds: {least}, overhead {OVERHEAD}, plan {PLAN_S * 1e3:.0f} ms")


if __name__ == "__main__":
    main()
