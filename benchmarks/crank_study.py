"""Missions at the console: walk 2 m, stand, take a crank, three full turns with a new grip each turn, draw back.

python benchmarks/crank_study.py [--robots atlas,valkyrie] [--trials 30] [--jobs 2] [--sweep error,floor,handle,wheel]

Without ``--sweep``: exact perception. A trial counts as done if the wheel has been turned three times within 10
degrees, the robot still stands, drawing back moved the wheel by less than 2 degrees, and nothing ever touched anything
but soles the floor and the hand the handle. A grip that is lost or not felt is let go and tried again after a new look,
up to ``TRIES`` grips in all. Each look places the handle wrong by a normal error of ``error_m`` in each direction.
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from teleop_sim.core.streams import stream
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import CircularAffordance, Command, Follow, Grip, PlanarPose, Reach, Release, Side, Walk
from teleop_sim.robot.episode import Episode, NoiseKey, perform
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.skill import Tick
from teleop_sim.robot.templates import CRANK_STANDS, crank_stand
from teleop_sim.world import console
from teleop_sim.world import dish_layout as lay
from teleop_sim.world.dish_draw import DishSettings, DishWorld, draw_dish_world
from teleop_sim.world.dish_scenery import DishScenery
from teleop_sim.world.plant import TIMESTEP_S, Plant

TURNS = 3
TRIES = 6
WALK_M = 2.0
TOLERANCE_RAD = math.radians(4.0)
DONE_RAD = math.radians(10.0)
CREPT_RAD = math.radians(2.0)
WHEEL: dict[Side, str] = {"left": "yawWheel", "right": "pitchWheel"}
LOOK_EVERY_TICKS = 3


@dataclass(frozen=True)
class Setting:
    """One cell of a sweep."""

    robot: str
    error_m: float = 0.0
    floor: float = 0.8
    handle: float = 0.8
    wheel_nm: tuple[float, float] = (2.0, 3.0)
    timestep_s: float = TIMESTEP_S


@dataclass(frozen=True)
class Cranked:
    """One trial: how it ended and why, grips taken, wheel's miss and creep, what touched what."""

    seed: int
    cause: str
    grips: int
    missed_rad: float
    crept_rad: float
    stray: tuple[str, ...]
    duration_s: float
    balance_m: float

    @property
    def done(self) -> bool:
        calm = self.crept_rad <= CREPT_RAD and not self.stray
        return self.cause == "done" and self.missed_rad <= DONE_RAD and calm

    @property
    def told(self) -> str:
        """What went wrong, or nothing."""
        if self.done:
            return ""
        if self.cause != "done":
            return self.cause
        if self.missed_rad > DONE_RAD:
            return f"wheel {math.degrees(self.missed_rad):.0f} degrees off"
        return "touched: " + ", ".join(self.stray) if self.stray else "drawing back moved the wheel"


class CrankScenery(DishScenery):
    """The dish task's console on a wide level floor; the wheels' own angles are sent, as if it had encoders."""

    def add_to(self, spec: mujoco.MjSpec) -> None:
        super().add_to(spec)
        for geom in spec.worldbody.geoms:
            if geom.name.startswith(("walkway", "clutter")):
                geom.contype = geom.conaffinity = 0
                geom.rgba[3] = 0.0
        spec.geom("soil").pos = [0.0, 0.0, 0.0]

    def status(self, plant: Plant, _: tuple[float, ...]) -> dict[str, float]:
        return {name: plant.angle(name) for name in WHEEL.values()}


class Watched(Body):
    """A body that remembers what touched what else than soles and bars should, and the worst DCM error at rest."""

    def __init__(self, setting: Setting, world: DishWorld) -> None:
        spec = ROBOTS[setting.robot]()
        super().__init__(spec, Plant(spec.model, CrankScenery(world), timestep_s=setting.timestep_s))
        self.stray: set[str] = set()
        self.balance_m = 0.0
        self._count = 0

    def tick(self, reference: Tick) -> bool:
        upright = super().tick(reference)
        self._count += 1
        if self._count % LOOK_EVERY_TICKS == 0 and upright:
            for own, other in self.plant.contacts():
                held = ("Bar" in own or "Flange" in own) and ("Knob" in other or "Stem" in other)
                if "_sole" not in own and not held:
                    self.stray.add(f"{own} on {other}")
            if reference.row is None or (reference.row[4] == 2 and np.array_equal(reference.row[5:], self.stand[5:])):
                self.balance_m = max(self.balance_m, self.balance_error_m())
        return upright


def world_of(setting: Setting, seed: int) -> DishWorld:
    settings = DishSettings(
        floor_friction=(setting.floor,) * 2,
        contact_friction=(setting.handle,) * 2,
        wheel_friction_nm=setting.wheel_nm,
    )
    return draw_dish_world(lambda name: stream(seed, 0, name), settings)


def goal_of(world: DishWorld, robot: str, side: Side) -> PlanarPose:
    centre = console.wheel_centre(side == "left")
    return lay.compose(world.console, crank_stand(robot).pose(centre[:2], 0.0, side))


def start_of(goal: PlanarPose, seed: int) -> PlanarPose:
    """2 m behind the goal, up to 0.2 m aside and turned by up to 0.2 rad."""
    aside_m, turn_rad = np.random.default_rng((seed, 61)).uniform(-0.2, 0.2, 2)
    return lay.compose(goal, (-WALK_M, float(aside_m), float(turn_rad)))


def put_down(body: Body, pose: PlanarPose) -> None:
    data = body.plant.data
    body.load(body.standing())
    x, y, yaw = lay.compose(pose, (float(data.qpos[0]), float(data.qpos[1]), 0.0))
    data.qpos[:2] = [x, y]
    data.qpos[3:7] = [math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)]
    body.plant.load(body.plant.save())
    body.set_stand()


def handle_of(world: DishWorld, side: Side, wheel_rad: float, error: np.ndarray) -> CircularAffordance:
    """The handle as a look places it: off by ``error`` (3,) [m]."""
    x, y, yaw = world.console
    turn = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
    left = side == "left"
    zero, _, axis = (turn @ np.array(a) for a in console.wheel_axes())
    centre = turn @ np.array(console.wheel_centre(left)) + [x, y, -console.WALKWAY_HEIGHT_M] + error
    # The joint counts clockwise, the handle anticlockwise.
    angle = math.remainder(world.wheel_start_rad[0 if left else 1] - wheel_rad, 2 * math.pi)
    hub, up, spoke = ((float(v[0]), float(v[1]), float(v[2])) for v in (centre, axis, zero))
    return CircularAffordance(hub, up, spoke, console.KNOB_ORBIT_M, console.KNOB_HEIGHT_M, angle)


class Mission:
    """One trial under way."""

    def __init__(self, setting: Setting, seed: int) -> None:
        self.setting, self.seed = setting, seed
        self.side: Side = "left" if seed % 2 else "right"
        self.sign = 1 if seed % 4 < 2 else -1
        self.world = world_of(setting, seed)
        self.body = Watched(setting, self.world)
        self.goal = goal_of(self.world, setting.robot, self.side)
        put_down(self.body, start_of(self.goal, seed))
        self.state = self.body.save()
        self.rng = np.random.default_rng((seed, 62))
        self.grips, self.count, self.duration_s, self.crept_rad = 0, 0, 0.0, 0.0
        self.start_rad = self.wheel_rad()

    def wheel_rad(self) -> float:
        return self.body.plant.angle(WHEEL[self.side])

    def do(self, command: Command) -> Episode:
        self.count += 1
        episode = perform(self.body, command, self.state, NoiseKey(self.seed, 0, self.count))
        self.state, self.duration_s = episode.end, self.duration_s + episode.duration_s
        return episode

    def grasp_and_turn(self, target_rad: float) -> str:
        """Look, reach, grip, turn, let go. Return ``reached``, ``fell`` or what ended it."""
        self.grips += 1
        error = self.rng.normal(0.0, 1.0, 3) * self.setting.error_m
        handle, signal = handle_of(self.world, self.side, self.wheel_rad(), error), WHEEL[self.side]
        ended = self.do(Reach(self.side, handle)).outcome
        if ended == "no_plan":
            return ended
        if ended == "reached":
            ended = self.do(Grip(self.side, close=True)).outcome
        if ended == "felt":
            direction = -1 if target_rad > self.wheel_rad() else 1
            ended = self.do(Follow(self.side, handle, direction, signal, target_rad, TOLERANCE_RAD)).outcome
        if ended == "fell":
            return ended
        before = self.wheel_rad()
        fell = self.do(Release(self.side, handle)).outcome == "fell"
        self.crept_rad = max(self.crept_rad, abs(self.wheel_rad() - before))
        return "fell" if fell else ended

    def run(self) -> Cranked:
        ended = self.do(Walk((self.goal,))).outcome
        cause = "done" if ended == "reached" else f"walk: {ended}"
        turn, whys = 1, []
        while cause == "done" and turn <= TURNS:
            if self.grips == TRIES:
                cause = "gave up: " + ", ".join(sorted(set(whys)))
                break
            ended = self.grasp_and_turn(self.start_rad + self.sign * turn * 2 * math.pi)
            if ended == "reached":
                turn += 1
            elif ended == "fell":
                cause = "fell"
            else:
                whys.append(ended)
        missed = abs(self.wheel_rad() - self.start_rad - self.sign * TURNS * 2 * math.pi)
        stray = tuple(sorted(self.body.stray))
        return Cranked(
            self.seed, cause, self.grips, missed, self.crept_rad, stray, self.duration_s, self.body.balance_m
        )


def crank(setting: Setting, seed: int) -> Cranked:
    return Mission(setting, seed).run()


def row(setting: Setting, seeds: range, pool: ProcessPoolExecutor | None) -> list[Cranked]:
    cells = [setting] * len(seeds)
    return list(map(crank, cells, seeds)) if pool is None else list(pool.map(crank, cells, seeds))


def settings_of(robot: str, sweep: str) -> list[Setting]:
    exact = Setting(robot)
    if sweep == "error":
        return [replace(exact, error_m=cm / 100) for cm in (0.0, 1.0, 2.0, 4.0)]
    if sweep == "floor":
        return [replace(exact, floor=mu) for mu in (0.1, 0.15, 0.2, 0.4, 1.0)]
    if sweep == "handle":
        return [replace(exact, handle=mu) for mu in (0.1, 0.3, 1.0)]
    if sweep == "wheel":
        return [replace(exact, wheel_nm=(nm, nm)) for nm in (1.0, 1.5, 2.0, 2.5, 3.0)]
    return [exact]


HEAD = (
    "| robot | error cm | floor | handle | wheel N m | done | grips | miss deg | crept deg | DCM off mm | s | else |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|---|"
)


def line(setting: Setting, trials: list[Cranked]) -> str:
    done = [t for t in trials if t.done]
    miss = math.degrees(max((t.missed_rad for t in done), default=math.nan))
    crept = math.degrees(max(t.crept_rad for t in trials))
    grips = sum(t.grips for t in trials) / len(trials)
    seconds = float(np.median([t.duration_s for t in done or trials]))
    off_mm = 1e3 * max((t.balance_m for t in done), default=math.nan)
    causes = Counter(t.told for t in trials if not t.done)
    told = "; ".join(f"{n} {why}" for why, n in causes.most_common(6))
    wheel = "{:g} to {:g}".format(*setting.wheel_nm)
    cell = f"| {setting.robot} | {100 * setting.error_m:.0f} | {setting.floor} | {setting.handle} | {wheel} |"
    return (
        f"{cell} {len(done)}/{len(trials)} |"
        f" {grips:.1f} | {miss:.1f} | {crept:.1f} | {off_mm:.0f} | {seconds:.0f} | {told} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", default=",".join(CRANK_STANDS))
    parser.add_argument("--trials", type=int, default=30)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--sweep", default="exact")
    told = parser.parse_args()
    seeds = range(told.first_seed, told.first_seed + told.trials)
    print(HEAD)
    with ProcessPoolExecutor(told.jobs) as pool:
        for sweep in told.sweep.split(","):
            for robot in told.robots.split(","):
                for setting in settings_of(robot, sweep):
                    print(line(setting, row(setting, seeds, pool if told.jobs > 1 else None)), flush=True)


if __name__ == "__main__":
    main()
