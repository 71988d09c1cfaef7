"""Draw each robot doing each skill: one sheet a robot, a picture a skill, in docs/pictures.

python benchmarks/skill_pictures.py [--robots valkyrie,atlas,thormang3] [--seed 3] [--size 300] [--out docs/pictures]

Nothing is posed: the commands are those of the studies (``crank_study.py``, ``affordance_study.py``,
``pick_study.py``), carried out by the physics, and every picture shows a state of it, with the outcome of its command.
Needs EGL.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import affordance_study
import crank_study
import mujoco
import numpy as np
import pick_study
from film import sheet
from PIL import Image, ImageDraw

from teleop_sim.robot.body import Body, RobotState
from teleop_sim.robot.commands import Command, Detect, Look, Nudge, Posture, Scan, Step, Walk
from teleop_sim.robot.episode import Episode, NoiseKey, perform
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.skill import Tick
from teleop_sim.world.drawing import Painter, View
from teleop_sim.world.plant import Plant

NEAR = ("reach", "grip", "follow", "release", "act", "pick", "insert", "nudge", "place")
"""Skills of the hands: looked at from near."""

WHEN = {"walk": 0.55, "step": 0.5, "grip": 1.0, "insert": 0.75, "pick": 0.9, "reach": 0.97, "release": 0.6}
"""Share of an episode at which its picture is taken; two thirds where nothing is said."""

EVERY_TICKS = 10
LIGHT = ("thormang3",)
"""Robots to whose wrists the challenge's wheels are heavy (docs/physics.md): theirs turn at 0.5 N m."""


@dataclass
class Shot:
    """An episode as it went: positions of everything, now and then."""

    name: str
    words: str
    body: Body
    positions: list[np.ndarray] = field(default_factory=list)


class Camera:
    """Stands in for ``perform`` and keeps what happens."""

    def __init__(self) -> None:
        self.shots: dict[str, Shot] = {}
        self.prefix = ""
        self.boxes = False

    def perform(self, body: Body, command: Command, state: RobotState, key: NoiseKey, *rest: Any) -> Episode:
        """Carry out a command; the first good one of each kind is kept, or else the first."""
        loaded = bool(self.boxes and isinstance(command, Walk))
        name = f"{type(command).__name__.lower()}{' with a box' if loaded else self.prefix}"
        shot = Shot(name, "", body)
        plain, count = body.tick, 0

        def watched(reference: Tick) -> bool:
            nonlocal count
            upright = plain(reference)
            if count % EVERY_TICKS == 0:
                shot.positions.append(np.array(body.plant.data.qpos))
            count += 1
            return upright

        body.tick = watched  # type: ignore[method-assign]
        try:
            episode = perform(body, command, state, key, *rest)
        finally:
            body.tick = plain  # type: ignore[method-assign]
        body.load(episode.end)
        shot.positions.append(np.array(body.plant.data.qpos))
        shot.words = f"{episode.outcome}, {episode.duration_s:.1f} s"
        # Of walks with boxes the last: the first leads to the box.
        if name not in self.shots or loaded:
            self.shots[name] = shot
        return episode


def crank(robot: str, seed: int) -> None:
    """Walk up, look, scan and detect, take the crank, turn it, let go, nudge, step aside, rest."""
    setting = crank_study.Setting(robot)
    if robot in LIGHT:
        setting = replace(setting, wheel_nm=(0.5, 0.5))
    mission = crank_study.Mission(setting, seed)
    for command in (Look(math.radians(15.0)), Scan(None), Detect("console", "coarse")):
        mission.do(command)
    mission.run()
    mission.do(Nudge(mission.side, (0.0, 0.0, 0.08), "world"))
    mission.do(Posture("walk"))
    mission.do(Step(forward_m=-0.25))


def bench(camera: Camera, robot: str, seed: int) -> None:
    """Along a line, round a circle, up a screw."""
    for thing, kind in (("slide", " linear"), ("wheel", " circular"), ("screw", " screw")):
        camera.prefix = kind
        setting = affordance_study.Setting(robot, thing)
        if robot in LIGHT:
            setting = replace(setting, resist_n=(3.0, 3.0))
        affordance_study.Trial(setting, seed).run()
    camera.prefix = ""


def boxes(robot: str, seed: int) -> None:
    """Pick, carry, place; pick and insert."""
    pick_study.box_trial(robot, seed, 0.0)
    pick_study.plug_trial(robot, seed, 0.0)


def view(plant: Plant, near: bool) -> View:
    """From ahead and aside of the robot, at the height of what it does."""
    pelvis = plant.data.body(1)
    forward, (x, y, tall_m) = pelvis.xmat.reshape(3, 3)[:, 0], pelvis.xpos.tolist()
    yaw, ahead_m = math.atan2(forward[1], forward[0]), 0.35 if near else 0.0
    return View(
        (x + ahead_m * math.cos(yaw), y + ahead_m * math.sin(yaw), 1.12 * tall_m),
        yaw + math.radians(128.0 if near else 140.0),
        math.radians(-22.0 if near else -12.0),
        (2.0 if near else 3.3) * max(tall_m, 0.65),
    )


def picture(shot: Shot, size: int) -> Image.Image:
    """The shot at its time."""
    plant, skill = shot.body.plant, shot.name.split(" ")[0]
    at = min(int(WHEN.get(skill, 0.67) * len(shot.positions)), len(shot.positions) - 1)
    plant.data.qpos[:] = shot.positions[at]
    mujoco.mj_forward(plant.model, plant.data)
    with Painter(plant, size, size) as painter:
        drawn = Image.fromarray(painter.draw(view(plant, skill in NEAR)))
    pen = ImageDraw.Draw(drawn)
    for line, text in enumerate((shot.name, shot.words)):
        pen.text((6, 4 + 14 * line), text, fill=(255, 255, 0), stroke_width=1, stroke_fill=(0, 0, 0))
    return drawn


def drawn(robot: str, seed: int, size: int, out: Path) -> Path:
    """The sheet of a robot."""
    camera = Camera()
    for module in (crank_study, affordance_study, pick_study):
        module.perform = camera.perform
    crank(robot, seed)
    bench(camera, robot, seed)
    camera.boxes = True
    boxes(robot, seed)
    pictures = [picture(shot, size) for shot in camera.shots.values()]
    target = out / f"skills_{robot}.jpg"
    sheet(pictures, 5).save(target, quality=85)
    print(target, *(f"{shot.name}: {shot.words}" for shot in camera.shots.values()), sep="\n  ")
    return target


def main() -> None:
    """Draw all sheets."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", default=",".join(ROBOTS))
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--size", type=int, default=300)
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"))
    told = parser.parse_args()
    told.out.mkdir(parents=True, exist_ok=True)
    for robot in told.robots.split(","):
        drawn(robot, told.seed, told.size, told.out)


if __name__ == "__main__":
    main()
