"""What the studies of door and valve share: a robot, its thing, commands one after the other, tables."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from teleop_sim.robot.affordance import Usability
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Command, Fingers, Grasp, LetGo, PreGrasp, Side, Take
from teleop_sim.robot.drc_plans import Template
from teleop_sim.robot.episode import Episode, NoiseKey, perform
from teleop_sim.robot.hands import robot_of
from teleop_sim.world.plant import Plant, Scenery

SIDE: Side = "left"
HAND = "claw"
STANCE_M, STANCE_RAD = 0.02, math.radians(3.0)
YAW_RAD_M = math.radians(1.0) / 0.01
TOOL = Usability("bars", (0.0, 0.0, 0.0))
"""The hand as a tool that nothing guides: it keeps to the believed path and holds against what springs back."""


@dataclass(frozen=True)
class Trial:
    """What came of one: whether all was well, what ended it, how far the thing went [rad], simulated time [s]."""

    seed: int
    good: bool
    why: str
    amount_rad: float
    moved_s: float


class Runner:
    """Commands one after the other, from a state to the next."""

    def __init__(self, robot: str, scene: Scenery, seed: int) -> None:
        spec = robot_of(robot, HAND)
        self.body = Body(spec, Plant(spec.model, scene))
        self.state = self.body.standing()
        self.body.load(self.state)
        self.seed, self.count, self.moved_s = seed, 0, 0.0
        self.said: list[str] = []

    def do(self, command: Command) -> Episode:
        self.count += 1
        episode = perform(self.body, command, self.state, NoiseKey(self.seed, 0, self.count))
        self.moved_s += episode.duration_s
        self.state = episode.end
        self.body.load(self.state)
        self.said.append(f"{type(command).__name__} {episode.outcome}: {episode.cause}")
        return episode


class InParts(Runner):
    """As ``Runner``, but takes things by their parts: before them, in, closed."""

    def do(self, command: Command) -> Episode:
        if not isinstance(command, Take):
            return super().do(command)
        side, handle, shut = command.side, command.handle, command.shut
        told = super().do(PreGrasp(side, handle, shut))
        if told.outcome == "reached":
            told = super().do(Grasp(side, handle, shut))
        if told.outcome == "blocked":
            super().do(LetGo(side, shut))
        if told.outcome == "reached" and not shut:
            told = super().do(Fingers(side, True))
        return replace(told, outcome="taken") if told.outcome in ("reached", "closed") else told


def stand_error(rng: np.random.Generator) -> np.ndarray:
    """By how much the robot stands wrong: x, y [m], yaw [rad]."""
    return rng.normal(0.0, 1.0, 3) * [STANCE_M, STANCE_M, STANCE_RAD]


def believed(place: tuple[float, float, float], yaw_rad: float, error_m: float, rng: np.random.Generator) -> Template:
    """A template that is off by a normal error in each direction, and by a degree a centimetre in yaw."""
    off, turn = rng.normal(0.0, 1.0, 3) * error_m, rng.normal() * error_m * YAW_RAD_M
    x, y, z = (float(v) for v in np.array(place) + off)
    return Template((x, y, z), yaw_rad + float(turn))


HEAD = "| robot | error cm | done | median ° | s | else |\n|---|---|---|---|---|---|"


def line(robot: str, error_m: float, trials: list[Trial]) -> str:
    """One row of the table."""
    good = [t for t in trials if t.good]
    angle = math.degrees(float(np.median([t.amount_rad for t in good]))) if good else math.nan
    seconds = float(np.median([t.moved_s for t in good])) if good else math.nan
    causes = "; ".join(f"{n} {why}" for why, n in Counter(t.why for t in trials if not t.good).most_common())
    return f"| {robot} | {100 * error_m:.0f} | {len(good)}/{len(trials)} | {angle:.0f} | {seconds:.0f} | {causes} |"


def study(one: Callable[[str, float, int], Trial], robots: list[str], errors_m: list[float], seeds: range) -> None:
    """Print the table, a row at a time; one process."""
    print(HEAD, flush=True)
    for robot in robots:
        for error_m in errors_m:
            print(line(robot, error_m, [one(robot, error_m, seed) for seed in seeds]), flush=True)
