"""Seeing the console: how often and how exactly, against range, light, what stands in front, look-alikes, calibration.

``python benchmarks/perception.py [views a row]`` prints the tables of docs/perception.md, and what looking and planning
cost; with ``speed`` it prints that only. Times are thread CPU time, medians: compare only figures of one call.
"""

from __future__ import annotations

import math
import statistics
import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import mujoco
import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Scan, Vector
from teleop_sim.robot.episode import NoiseKey, perform
from teleop_sim.robot.footstep_planner import moves
from teleop_sim.robot.perception import coarse, fine, lidar
from teleop_sim.robot.perception.rays import SensorPose
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.route import steps_round
from teleop_sim.world import console, contact, dish, dish_draw
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.light import Light
from teleop_sim.world.plant import Plant
from teleop_sim.world.sense_errors import EXACT, CalibrationSpread, SenseErrors, draw_sense_errors

DUSK = Light((0.85, 0.3, math.sqrt(1 - 0.85**2 - 0.3**2)), (0.25, 0.2, 0.15), 0.1)
DARK = Light((0.85, 0.3, math.sqrt(1 - 0.85**2 - 0.3**2)), (0.06, 0.05, 0.04), 0.03)
GLARE = Light((-0.85, 0.0, math.sqrt(1 - 0.85**2)), (2.5, 2.4, 2.2), 0.6)


@dataclass(frozen=True)
class Case:
    """A row: level distance to the wheels [m], what is otherwise than in the usual scene."""

    name: str
    level_m: tuple[float, float]
    light: Light | None = None
    post: bool = False
    pair: bool = False
    calibration: float = 0.0
    region_m: float = 0.07


@dataclass
class Scene:
    """A drawn world of task 1 without a robot. Implements ``Rays``."""

    world: dish_draw.DishWorld
    model: mujoco.MjModel
    data: mujoco.MjData = field(init=False)

    def __post_init__(self) -> None:
        """Place everything."""
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)

    def cast(
        self, origin: np.ndarray, directions: np.ndarray, cutoff_m: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """See ``Rays``."""
        n = len(directions)
        geoms, distance, normal = np.empty(n, np.int32), np.empty(n), np.empty(3 * n)
        flat = np.ascontiguousarray(directions).ravel()
        mujoco.mj_multiRay(self.model, self.data, origin, flat, None, 1, -1, geoms, distance, normal, n, cutoff_m)
        return distance, geoms, normal.reshape(-1, 3)

    def colour(self, geoms: np.ndarray) -> np.ndarray:
        """See ``Rays``."""
        return np.asarray(self.model.geom_rgba[geoms, :3], float)

    def textured(self, geoms: np.ndarray) -> np.ndarray:
        """See ``Rays``."""
        return np.asarray(self.model.geom_matid[geoms] >= 0)

    def place(self, x: float, y: float, z: float) -> np.ndarray:
        """From the console's frame to the odometry frame."""
        return _place(self.world, x, y, z)


def _place(world: dish_draw.DishWorld, x: float, y: float, z: float) -> np.ndarray:
    c, s = math.cos(world.console[2]), math.sin(world.console[2])
    return np.array([world.console[0] + c * x - s * y, world.console[1] + s * x + c * y, dish.SOIL_Z_M + z])


def _solid(
    spec: mujoco.MjSpec, at: np.ndarray, radius_m: float, half_m: float, rgb: Vector, lean_rad: float = 0.0
) -> None:
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[radius_m, half_m, 0.0],
        pos=list(at),
        quat=[math.cos(lean_rad / 2), 0.0, -math.sin(lean_rad / 2), 0.0],
        rgba=[*rgb, 1.0],
    )


def draw(case: Case, rng: np.random.Generator) -> tuple[Scene, SensorPose]:
    """A scene, and a head that looks at the console, up to 0.5 rad off its axis and 0.15 rad wrong."""
    world = dish_draw.draw_dish_world(lambda _: rng, dish_draw.DishSettings(wheel_start_spread_rad=math.pi))
    if case.light is not None:
        world = replace(world, light=case.light)
    level_m, bearing = rng.uniform(*case.level_m), rng.uniform(-0.5, 0.5)
    eye = _place(world, -level_m * math.cos(bearing), level_m * math.sin(bearing), rng.uniform(1.7, 1.8))
    way = _place(world, 0.0, 0.0, console.WHEEL_HEIGHT_M) - eye
    yaw = math.atan2(way[1], way[0]) + rng.uniform(-0.15, 0.15)
    pitch = math.atan2(-way[2], level_m) + rng.uniform(-0.15, 0.15)
    share, aside, side = rng.uniform(0.35, 0.65), rng.uniform(-0.2, 0.2), rng.choice([-1.0, 1.0])
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    dish.add_dish_world(spec, world)
    if case.post:
        across = np.array([-way[1], way[0]]) / math.hypot(way[0], way[1])
        x, y = eye[:2] + share * way[:2] + aside * across
        _solid(spec, np.array([x, y, 0.8]), 0.05, 0.9, (0.4, 0.4, 0.4))
    if case.pair:
        for i, rgb in enumerate((console.RED, console.BLUE)):
            at = _place(world, 0.4, side * 1.2 - console.WHEEL_SEPARATION_M * i, 0.86)
            _solid(spec, at, 0.16, 0.012, rgb, 0.6)
    turned = _about(2, yaw) @ _about(1, pitch)
    return Scene(world, spec.compile()), SensorPose(turned, eye)


def _about(axis: int, angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    if axis == 2:
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def _calibration(case: Case, rng: np.random.Generator) -> SenseErrors:
    usual, x = CalibrationSpread(), case.calibration
    ranges = CalibrationSpread(
        *(x * v for v in (usual.turn_rad, usual.shift_m, usual.spindle_rad, usual.focal, usual.baseline))
    )
    return draw_sense_errors(lambda _: rng, ranges) if x else EXACT


def see_coarse(case: Case, seed: int) -> tuple[str, float]:
    """Right, wrong or the reason of nothing; level error of the middle [m]."""
    rng = np.random.default_rng(seed)
    scene, pose = draw(case, rng)
    found, why = coarse.detect(scene, pose, scene.world.light, rng, errors=_calibration(case, rng))
    if found is None:
        return why, math.nan
    middle = (np.array(found.yaw_wheel) + np.array(found.pitch_wheel)) / 2
    error_m = float(np.linalg.norm((middle - scene.place(0.0, 0.0, 0.0))[:2]))
    return ("right" if error_m < 0.45 else "wrong"), error_m


def see_fine(case: Case, seed: int) -> tuple[str, float]:
    """Right, wrong or the reason of nothing; error of the worse knob [m]."""
    rng = np.random.default_rng(seed)
    scene, pose = draw(case, rng)
    ahead, aside = rng.normal(0.0, case.region_m, 2)
    x, y, z = scene.place(float(ahead), float(aside), console.WHEEL_HEIGHT_M)
    eye = (float(pose.position[0]), float(pose.position[1]), float(pose.position[2]))
    points = lidar.half_turn(scene, pose, rng, (x, y, z), _calibration(case, rng))
    fix, why = fine.detect(points, (x, y, z), eye, rng)
    if fix is None:
        return why, math.nan
    errors = []
    for handle, left, angle in zip(
        (fix.yaw_handle, fix.pitch_handle), (True, False), scene.world.wheel_start_rad, strict=True
    ):
        axis, zero = np.array(handle.axis), np.array(handle.zero)
        around = math.cos(handle.angle_rad) * zero + math.sin(handle.angle_rad) * np.cross(axis, zero)
        knob = np.array(handle.centre) + handle.height_m * axis + handle.radius_m * around
        errors.append(float(np.linalg.norm(knob - scene.place(*console.knob_centre(left, angle)))))
    return ("right" if max(errors) < 0.04 else "wrong"), max(errors)


COARSE = (
    Case("1.5 to 2 m", (1.5, 2.0)),
    Case("2 to 3 m", (2.0, 3.0)),
    Case("3 to 4 m", (3.0, 4.0)),
    Case("2 to 3 m, dusk", (2.0, 3.0), light=DUSK),
    Case("2 to 3 m, nearly dark", (2.0, 3.0), light=DARK),
    Case("2 to 3 m, glare from behind the robot", (2.0, 3.0), light=GLARE),
    Case("2 to 3 m, a post in front", (2.0, 3.0), post=True),
    Case("2 to 3 m, a second pair", (2.0, 3.0), pair=True),
    Case("2 to 3 m, calibration left over", (2.0, 3.0), calibration=1.0),
    Case("2 to 3 m, ten times that", (2.0, 3.0), calibration=10.0),
)
FINE = (
    Case("0.7 m", (0.7, 0.7)),
    Case("1.1 m", (1.1, 1.1)),
    Case("2 m", (2.0, 2.0)),
    Case("3 m", (3.0, 3.0)),
    Case("1.1 m, nearly dark", (1.1, 1.1), light=DARK),
    Case("1.1 m, a post in front", (1.1, 1.1), post=True),
    Case("1.1 m, region 30 cm off", (1.1, 1.1), region_m=0.21),
    Case("1.1 m, calibration left over", (1.1, 1.1), calibration=1.0),
    Case("1.1 m, ten times that", (1.1, 1.1), calibration=10.0),
)


def study(
    name: str, cases: tuple[Case, ...], see: Callable[[Case, int], tuple[str, float]], count: int, unit: float
) -> None:
    """Print one table."""
    print(f"\n| {name} | right | wrong | nothing, and why | error [cm] 50 / 90 / 100 % |\n|---|---|---|---|---|")
    for case in cases:
        seen = [see(case, 20_000 + k) for k in range(count)]
        kinds = Counter(kind for kind, _ in seen)
        errors = [e for kind, e in seen if kind == "right"]
        spread = " / ".join(f"{v * unit:.2g}" for v in np.quantile(errors, (0.5, 0.9, 1.0))) if errors else ""
        why = ", ".join(f"{kind} {n}" for kind, n in sorted(kinds.items()) if kind not in ("right", "wrong"))
        print(f"| {case.name} | {kinds['right']}/{count} | {kinds['wrong']} | {why} | {spread} |", flush=True)


def cpu_ms(function: Callable[[], object], times: int = 15) -> float:
    """Median thread CPU time, after one call to warm up."""
    function()
    spent = []
    for _ in range(times):
        start_s = time.thread_time()
        function()
        spent.append(time.thread_time() - start_s)
    return 1e3 * statistics.median(spent)


@dataclass(frozen=True)
class WithPost(BareFloor):
    """A post in the way."""

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add floor and post."""
        super().add_to(spec)
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            pos=[2.0, 0.05, 0.9],
            size=[0.06, 0.9, 0.0],
            friction=contact.rough(0.8),
            **contact.WORLD,
        )


def speeds() -> None:
    """Print what looking and planning cost."""
    rows: dict[str, float] = {}
    rng = np.random.default_rng(1)
    scene, pose = draw(Case("", (2.0, 2.0)), rng)
    x, y, z = (float(v) for v in scene.place(0.0, 0.0, console.WHEEL_HEIGHT_M))
    eye = (float(pose.position[0]), float(pose.position[1]), float(pose.position[2]))
    points = lidar.half_turn(scene, pose, rng, (x, y, z))
    rows["detect, coarse: image and blobs"] = cpu_ms(lambda: coarse.detect(scene, pose, scene.world.light, rng))
    rows["detect, fine"] = cpu_ms(lambda: fine.detect(points, (x, y, z), eye, rng))
    rows["scan with a region"] = cpu_ms(lambda: lidar.half_turn(scene, pose, rng, (x, y, z)))
    rows["scan, all rays"] = cpu_ms(lambda: lidar.half_turn(scene, pose, rng))
    for name in sorted(ROBOTS):
        spec = ROBOTS[name]()
        body = Body(spec, Plant(spec.model, WithPost()))
        cloud = perform(body, Scan(), body.standing(), NoiseKey(1, 0, 1)).data
        body.load(body.standing())
        rows[f"walk of 4 m round a post, {name}"] = cpu_ms(
            partial(steps_round, body, (0.0, 0.0, 0.0), ((4.0, 0.0, 0.3),), (cloud,))
        )
        moves.cache_clear()
        start_s = time.thread_time()
        moves(spec.gait)
        rows[f"its step set, once a process, {name}"] = 1e3 * (time.thread_time() - start_s)
    print_rows(rows)


def print_rows(rows: Mapping[str, float]) -> None:
    """Print times as a table."""
    print("\n| what | ms of CPU |\n|---|---|")
    for name, value in rows.items():
        print(f"| {name} | {value:.0f} |")


def main() -> None:
    """Print tables, then times."""
    if sys.argv[1:] != ["speed"]:
        count = int(sys.argv[1]) if len(sys.argv) > 1 else 100
        study("Coarse, from", COARSE, see_coarse, count, 100.0)
        study("Fine, from", FINE, see_fine, count, 100.0)
    speeds()


if __name__ == "__main__":
    main()
