"""How fast robots turn a crank: thread CPU time of reach, grip, follow and release against a bare loop of MuJoCo.

python benchmarks/crank_rate.py [--repeats 5] [--robots valkyrie,atlas]

As ``physics_rate.py``: the bare loop gets the same controls from the same state, so it meets the same contacts. A table
is timed as the first command at a wheel meets it; the episodes have it in memory, as all later ones do.
"""

from __future__ import annotations

import argparse
import statistics
import time
from dataclasses import dataclass
from typing import TypeVar

import mujoco
import numpy as np
from crank_study import CrankScenery, Setting, goal_of, handle_of, put_down, world_of

from teleop_sim.robot.body import Body, RobotState
from teleop_sim.robot.commands import Command, Follow, Grip, Reach, Release, Side
from teleop_sim.robot.episode import Episode, NoiseKey, perform
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.skill import Tick
from teleop_sim.robot.skills.manipulate import arm_of, table_of
from teleop_sim.robot.tables import forget
from teleop_sim.robot.templates import CRANK_STANDS
from teleop_sim.world.plant import Plant

KEY = NoiseKey(1, 0, 1)
BOUNDS = {0.002: 30.0, 0.004: 60.0}
OVERHEAD = 1.5
TABLE_S = 0.2
SIDE: Side = "right"
B = TypeVar("B", bound=Body)


class Noted(Body):
    """A body that writes down its controls."""

    controls: list[np.ndarray]

    def tick(self, reference: Tick) -> bool:
        upright = super().tick(reference)
        self.controls.append(self.plant.data.ctrl.copy())
        return upright


@dataclass(frozen=True)
class Shot:
    """One command from its state, as it went, with the controls of its ticks."""

    command: Command
    state: RobotState
    episode: Episode
    controls: list[np.ndarray]


def shots(body: Noted) -> list[Shot]:
    world = world_of(Setting(body.spec.model.description.name), 2)
    handle = handle_of(world, SIDE, 0.0, np.zeros(3))
    follow = Follow(SIDE, handle, -1, "pitchWheel", 2 * np.pi, 0.07)
    state, found = body.save(), []
    for command in (Reach(SIDE, handle), Grip(SIDE, close=True), follow, Release(SIDE, handle)):
        body.controls = []
        episode = perform(body, command, state, KEY)
        assert episode.outcome in ("reached", "felt", "released"), episode.cause
        found.append(Shot(command, state, episode, body.controls))
        state = episode.end
    return found


def placed(kind: type[B], robot: str, timestep_s: float) -> B:
    spec, world = ROBOTS[robot](), world_of(Setting(robot), 2)
    body = kind(spec, Plant(spec.model, CrankScenery(world), timestep_s=timestep_s))
    put_down(body, goal_of(world, robot, SIDE))
    return body


def replay(body: Body, shot: Shot) -> float:
    """CPU seconds of MuJoCo alone."""
    body.load(shot.state)
    model, data, n = body.plant.model, body.plant.data, body.plant.steps_per_tick
    start_s = time.thread_time()
    for control in shot.controls:
        data.ctrl[:] = control
        mujoco.mj_step(model, data, n)
    return time.thread_time() - start_s


def whole(body: Body, shot: Shot) -> float:
    start_s = time.thread_time()
    perform(body, shot.command, shot.state, KEY)
    return time.thread_time() - start_s


def table_s(body: Body) -> float:
    handle = handle_of(world_of(Setting(body.spec.model.description.name), 2), SIDE, 0.0, np.zeros(3))
    forget()
    start_s = time.thread_time()
    table_of(arm_of(body, SIDE), handle)
    return time.thread_time() - start_s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--robots", default=",".join(CRANK_STANDS))
    told = parser.parse_args()
    print("times real time by thread CPU time: reach, grip, one turn, release; medians")
    print(f"{'robot':10s} {'step ms':>8s} {'turning':>8s} {'all':>8s} {'bare':>8s} {'overhead':>9s} {'table ms':>9s}")
    for robot in told.robots.split(","):
        for timestep_s, least in BOUNDS.items():
            taken = shots(placed(Noted, robot, timestep_s))
            body = placed(Body, robot, timestep_s)
            start = body.save()
            moved_s = sum(shot.episode.physics_s for shot in taken)
            bare, full, turning, tables = [], [], [], []
            for _ in range(told.repeats):
                bare.append(sum(replay(body, shot) for shot in taken))
                each = [whole(body, shot) for shot in taken]
                full.append(sum(each))
                turning.append(taken[2].episode.physics_s / each[2])
                body.load(start)
                tables.append(table_s(body))
            full_s, bare_s, plan_s = (statistics.median(values) for values in (full, bare, tables))
            rate, overhead = moved_s / full_s, full_s / bare_s
            met = rate >= least and overhead <= OVERHEAD and plan_s <= TABLE_S
            print(
                f"{robot:10s} {1e3 * timestep_s:8.0f} {statistics.median(turning):8.0f} {rate:8.0f}"
                f" {moved_s / bare_s:8.0f} {overhead:9.2f} {1e3 * plan_s:9.0f}{'' if met else '  missed'}",
                flush=True,
            )
    least = ", ".join(f"{bound:.0f} at {1e3 * step_s:.0f} ms" for step_s, bound in BOUNDS.items())
    print(f"bounds: {least}, overhead {OVERHEAD}, table {TABLE_S * 1e3:.0f} ms")


if __name__ == "__main__":
    main()
