"""Pick, carry, place and insert by contact: trials over errors of what the robot believes, with named failures.

python benchmarks/pick_study.py [--task box|plug] [--robots valkyrie ...] [--errors 0 0.5 1 2] [--trials 20] [--mass 2]

A box trial: walk 0.5 m to the stand, pick, carry, 0.4 m back, a quarter turn, to the table, place. A plug trial: pick
the plug out of its rack, insert it into the socket. Drawn: place and yaw of box and table, friction of floor and of
what is gripped, mass. Errors are normal deviates of every coordinate of what is believed of handle, table and hole.
Truth is asked only after the end: where the thing is and what touches it. Runs one process.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from teleop_sim.core.streams import stream
from teleop_sim.robot.body import Body, RobotState
from teleop_sim.robot.commands import Carry, Command, Handle, Insert, Pick, Place, PlanarPose, Step, Vector, Walk
from teleop_sim.robot.episode import Episode, NoiseKey, perform
from teleop_sim.robot.grasps import bar_handle, hand_stand, stand_at
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.world.carry_scene import BOX, PLUG, BoxKind, CarryScene, PlugKind, Socket, handle_pose, touching
from teleop_sim.world.plant import Plant

SIDE = "right"
SMALL = BoxKind(mass_kg=0.5, half=(0.06, 0.08, 0.05), bar_half_m=0.075)
PLACES = {"valkyrie": ((0.5, -0.3), (0.5, -0.08), 0.9), "atlas": ((0.55, -0.32), (0.55, -0.1), 0.85)}
PLACES["thormang3"] = ((0.36, -0.3), (0.36, -0.12), 0.62)
"""Of rack and socket before the robot, and the rack's height [m]."""


@dataclass(frozen=True)
class Trial:
    """What came of one: the last step tried, its outcome and cause, whether all was well; simulated and CPU time."""

    step: str
    outcome: str
    cause: str
    good: bool
    moved_s: float
    cpu_s: float


class Runner:
    """Commands one after the other, from a state to the next."""

    def __init__(self, robot: str, scene: CarryScene, seed: int, plant: type[Plant] = Plant) -> None:
        spec = ROBOTS[robot]()
        self.body = Body(spec, plant(spec.model, scene))
        self.state: RobotState = self.body.standing()
        self.body.load(self.state)
        self.seed, self.count, self.moved_s, self.cpu_s = seed, 0, 0.0, 0.0

    def do(self, command: Command) -> Episode:
        self.count += 1
        start = time.thread_time()
        episode = perform(self.body, command, self.state, NoiseKey(self.seed, 0, self.count))
        self.cpu_s += time.thread_time() - start
        self.moved_s += episode.physics_s
        self.state = episode.end
        return episode

    def end(self, step: str, episode: Episode, good: bool) -> Trial:
        return Trial(step, episode.outcome, episode.cause, good, self.moved_s, self.cpu_s)


def vector(values: np.ndarray) -> Vector:
    x, y, z = (float(v) for v in values)
    return x, y, z


def box_scene(robot: str, seed: int, mass_kg: float | None) -> tuple[CarryScene, float]:
    """The scene of a box trial and the height of its handle on the table."""
    rng = stream(seed, 0, "world.box")
    figures = hand_stand(robot)
    kind = SMALL if robot == "thormang3" else BoxKind()
    kind = replace(kind, mass_kg=(kind.mass_kg if mass_kg is None else mass_kg) * rng.uniform(0.8, 1.2))
    middle_m = (figures.low_m + figures.high_m) / 2
    high_m = middle_m + rng.uniform(-0.05, 0.05)
    table_m = middle_m - kind.handle_m + rng.uniform(-0.03, 0.03)
    x, y, yaw = 0.5 + figures.ahead_m, -figures.aside_m, figures.inwards_rad
    dx, dy, dyaw = rng.uniform(-0.03, 0.03), rng.uniform(-0.03, 0.03), rng.uniform(-0.15, 0.15)
    stand = (x + dx, y + dy, yaw + dyaw)
    table = (0.1 + rng.uniform(-0.05, 0.05), 1.6 + rng.uniform(-0.05, 0.05), math.pi / 2)
    return CarryScene(
        stand=stand,
        stand_m=high_m - kind.handle_m,
        table=table,
        table_m=table_m,
        box=kind,
        friction=rng.uniform(0.6, 1.0),
        grip_friction=rng.uniform(0.5, 0.9),
    ), table_m + kind.handle_m


def box_trial(robot: str, seed: int, error_m: float, mass_kg: float | None = None, plant: type[Plant] = Plant) -> Trial:
    scene, put_m = box_scene(robot, seed, mass_kg)
    assert scene.box is not None
    run = Runner(robot, scene, seed, plant)
    rng = stream(seed, 0, "belief")
    handle = believed_handle(robot, run, scene, rng, error_m)
    bar_yaw = math.atan2(handle.bar[1], handle.bar[0]) if handle.bar else 0.0
    goal = stand_at(robot, SIDE, handle.centre, bar_yaw, scene.stand[2])
    steps: list[tuple[str, Command, tuple[str, ...]]] = [
        ("walk up", Walk((goal,)), ("reached",)),
        ("pick", Pick(SIDE, handle), ("held",)),
        ("carry", Carry(SIDE), ("carried",)),
        ("back", Step(forward_m=-0.4), ("reached",)),
    ]
    place, to = believed_place(robot, scene, put_m, handle, rng, error_m)
    steps += [("walk to table", Walk((to,)), ("reached",)), ("place", Place(SIDE, place), ("placed",))]
    for name, command, wanted in steps:
        episode = run.do(command)
        if episode.outcome not in wanted:
            return run.end(name, episode, False)
        held = any("Jaw" in part for part in touching(run.body.plant, BOX))
        if name in ("carry", "back", "walk to table") and not held:
            return run.end(name, replace(episode, outcome="dropped unnoticed"), False)
    pose = handle_pose(run.body.plant, BOX)
    on_table = touching(run.body.plant, BOX) == frozenset({"table"})
    good = on_table and pose.rotation[2, 2] > 0.98
    outcome = "placed" if good else "placed wrong"
    return run.end("place", replace(episode, outcome=outcome), good)


def believed_handle(robot: str, run: Runner, scene: CarryScene, rng: np.random.Generator, error_m: float) -> Handle:
    assert scene.box is not None
    centre = handle_pose(run.body.plant, BOX).position + error_m * rng.standard_normal(3)
    box = scene.box
    down = (0.0, 0.0, box.half[2] - box.handle_m)
    # The weight is believed to be the nominal one.
    nominal_kg = SMALL.mass_kg if robot == "thormang3" else BoxKind().mass_kg
    return bar_handle(robot, vector(centre), scene.stand[2] + math.pi / 2, scene.stand[2], nominal_kg, down)


def believed_place(
    robot: str, scene: CarryScene, put_m: float, handle: Handle, rng: np.random.Generator, error_m: float
) -> tuple[Handle, PlanarPose]:
    """The handle's pose on the table, and where to stand for it: the table's near edge is 0.3 m before its middle."""
    error = error_m * rng.standard_normal(3)
    x, y, _ = scene.table
    centre = np.array([x, y - 0.12, put_m]) + error
    to = stand_at(robot, SIDE, vector(centre), math.pi / 2 + math.pi / 2 + hand_stand(robot).inwards_rad, math.pi / 2)
    yaw = to[2] + hand_stand(robot).inwards_rad
    placed = bar_handle(robot, vector(centre), yaw + math.pi / 2, yaw, handle.mass_kg, handle.to_centre)
    return placed, to


def plug_trial(robot: str, seed: int, error_m: float, plant: type[Plant] = Plant) -> Trial:
    rng = stream(seed, 0, "world.plug")
    (rx, ry), (sx, sy), high_m = PLACES[robot]
    shift, yaw = rng.uniform(-0.02, 0.02, 4), rng.uniform(-0.3, 0.3, 2)
    kind = PlugKind(mass_kg=0.25 if robot == "thormang3" else 0.5)
    scene = CarryScene(
        stand=(5.0, 5.0, 0.0),
        stand_m=0.5,
        table=(7.0, 7.0, 0.0),
        table_m=0.5,
        box=None,
        plug=kind,
        rack=(rx + shift[0], ry + shift[1], yaw[0]),
        rack_m=high_m,
        socket=Socket((sx + shift[2], sy + shift[3], yaw[1]), high_m + rng.uniform(-0.03, 0.01)),
        friction=rng.uniform(0.6, 1.0),
        grip_friction=rng.uniform(0.3, 0.7),
    )
    assert scene.socket is not None
    run = Runner(robot, scene, seed, plant)
    belief = stream(seed, 0, "belief")
    seen = handle_pose(run.body.plant, PLUG).position + error_m * belief.standard_normal(3)
    episode = run.do(Pick(SIDE, Handle(vector(seen), (0.0, 0.0, -1.0), None, kind.mass_kg), 0.16))
    if episode.outcome != "held":
        return run.end("pick", episode, False)
    mouth = np.array([*scene.socket.at[:2], scene.socket.top_m])
    tip_m = kind.grip_m / 2 + kind.peg_m
    believed = vector(mouth + error_m * belief.standard_normal(3))
    episode = run.do(Insert(SIDE, believed, (0.0, 0.0, -1.0), tip_m, 0.05, search_m=max(0.01, 2.5 * error_m)))
    tip = run.body.plant.site("plug_tip").position - mouth
    inside = bool(tip[2] < -0.035 and np.abs(tip[:2]).max() < 0.02)
    good = inside and episode.outcome == "inserted"
    outcome = episode.outcome if inside == (episode.outcome == "inserted") else f"{episode.outcome}, but not so"
    return run.end("insert", replace(episode, outcome=outcome), good)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--task", choices=["box", "plug"], default="box")
    parser.add_argument("--robots", nargs="*", default=list(ROBOTS))
    parser.add_argument("--errors", nargs="*", type=float, default=[0.0, 0.5, 1.0, 2.0], help="standard deviation [cm]")
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--first", type=int, default=1, help="seed of the first trial")
    parser.add_argument("--mass", type=float, help="of the box [kg], instead of 2 (THORMANG3 0.5)")
    parser.add_argument("--say", action="store_true", help="every trial")
    told = parser.parse_args()
    for robot in told.robots:
        for error_cm in told.errors:
            ends: Counter[str] = Counter()
            good, moved_s, cpu_s = 0, [], 0.0
            for seed in range(told.first, told.first + told.trials):
                trial = (
                    box_trial(robot, seed, error_cm / 100, told.mass)
                    if told.task == "box"
                    else plug_trial(robot, seed, error_cm / 100)
                )
                if told.say:
                    print(f"    {seed}: {trial.step}: {trial.outcome}: {trial.cause}", flush=True)
                good += trial.good
                moved_s.append(trial.moved_s)
                cpu_s += trial.cpu_s
                if not trial.good:
                    ends[f"{trial.step}: {trial.outcome}"] += 1
            failures = ", ".join(f"{n} {what}" for what, n in ends.most_common())
            print(
                f"{robot:10s} {told.task} {error_cm:3.1f} cm: {good}/{told.trials}, median {np.median(moved_s):.0f} s, "
                f"{sum(moved_s) / cpu_s:.0f}x real time; {failures}",
                flush=True,
            )


if __name__ == "__main__":
    main()
