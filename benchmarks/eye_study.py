"""How good an operator's eye is: claims of known error, judged by pictures of drawn worlds (docs/operator.md).

``python benchmarks/eye_study.py [views] [first seed]`` prints a table: the share of claims that are rejected, by error
and criterion. The constants of ``operators/verification.py`` were chosen on seeds 1 to 60, 500 to 539 and 900 to 939.
"""

from __future__ import annotations

import math
import sys
from functools import partial

import mujoco
import numpy as np
from perception import Case, Scene, _about, draw

from teleop_sim.channel import messages as msg
from teleop_sim.core.streams import stream
from teleop_sim.field_claims import marks_message
from teleop_sim.operators.verification import body, find, things
from teleop_sim.robot.commands import Look
from teleop_sim.robot.perception import camera, coarse
from teleop_sim.robot.perception.rays import SensorPose
from teleop_sim.robot.programs.claims import claim_of_glimpse
from teleop_sim.robot.programs.steps import Claim, Mark
from teleop_sim.world import console, dish, dish_draw

HERE = Look(0.0)
CRITERIA = (5.0, 6.0)
EYE = np.array([0.14, -0.04, 1.7])
"""Valkyrie's camera where it starts, 0.3 rad down."""


def d_prime(scene: Scene, pose: SensorPose, claim: Claim, rng: np.random.Generator) -> float:
    """Of the worst thing; 0 if the picture shows nothing of it."""
    image = msg.encode_image(camera.take(scene, pose, scene.world.light, rng), 320, 170, 50)
    claimed = things(marks_message(claim, 0, image, pose, (320, 170)).places)
    looked = [find(image.pixels(), t) for t in claimed] + [body(image.pixels(), t) for t in claimed if len(t) > 1]
    return max((found.d_prime for found in looked if found is not None), default=0.0)


def handles(level_m: float, error_m: float, seed: int) -> float:
    """Both knobs, each wrong by ``error_m`` in some direction."""
    rng = np.random.default_rng(seed)
    scene, pose = draw(Case("", (level_m, level_m)), rng)
    marks = []
    for name, left, angle in zip(
        ("yaw_handle", "pitch_handle"), (True, False), scene.world.wheel_start_rad, strict=True
    ):
        way = rng.normal(size=3)
        x, y, z = scene.place(*console.knob_centre(left, angle)) + error_m * way / np.linalg.norm(way)
        marks.append(Mark(name, (float(x), float(y), float(z)), console.KNOB_RADIUS_M))
    return d_prime(scene, pose, Claim("", tuple(marks), HERE, HERE), rng)


def from_afar(seed: int) -> tuple[bool, float] | None:
    """What the colours show from the start in a world with drums: is it the drums, and d'."""
    rng = np.random.default_rng(seed)
    world = dish_draw.draw_dish_world(partial(stream, seed, 0), dish_draw.DishSettings(drums=(1, 1)))
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    dish.add_dish_world(spec, world)
    scene = Scene(world, spec.compile())
    for yaw in (0.0, 0.6, -0.6):
        pose = SensorPose(_about(2, yaw) @ _about(1, 0.3), EYE)
        found, _ = coarse.detect(scene, pose, world.light, rng)
        if found is None:
            continue
        middle = (np.array(found.yaw_wheel) + np.array(found.pitch_wheel))[:2] / 2
        off_m = math.dist(middle, scene.place(0.0, 0.0, 0.0)[:2])
        drums = [math.dist(middle, thing.pose[:2]) for thing in world.clutter if thing.kind.startswith("drum")]
        return min(drums, default=math.inf) < off_m, d_prime(scene, pose, claim_of_glimpse("", found, HERE, HERE), rng)
    return None


def row(name: str, seen: list[float]) -> None:
    """Print the mean of Phi(d' - criterion)."""
    shares = (np.mean([0.5 * math.erfc((c - d) / math.sqrt(2.0)) for d in seen]) for c in CRITERIA)
    print(f"| {name} ({len(seen)}) | " + " | ".join(f"{share:.0%}" for share in shares) + " |", flush=True)


def main() -> None:
    """Print the table."""
    views, first = (*(int(a) for a in sys.argv[1:]), *(40, 20_000)[len(sys.argv) - 1 :])
    for level_m in (0.65, 1.1):
        for error_m in (0.0, 0.01, 0.02, 0.03, 0.05, 0.1):
            seen = [handles(level_m, error_m, first + k) for k in range(views)]
            row(f"handles from {level_m} m, {100 * error_m:g} cm wrong", seen)
    seen_afar = [s for s in (from_afar(first + k) for k in range(2 * views)) if s is not None]
    row("from the start, the console", [d for drums, d in seen_afar if not drums])
    row("from the start, the drums", [d for drums, d in seen_afar if drums])


if __name__ == "__main__":
    main()
