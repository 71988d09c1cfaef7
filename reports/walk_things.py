"""What stood round the robot, seen from above, drawn anew from the log's scenario, seed and replicate.

The world is drawn from the same named streams as the run's own, so it is the same world; plates and the like come from
the log's own records. A task that is not known here has nothing but the place of its thing.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from teleop_sim.core.errors import TeleopError
from teleop_sim.core.records import Disturbed, Record, RunStarted
from teleop_sim.reports.run_view import Run

if TYPE_CHECKING:
    from teleop_sim.scenarios.tasks import Site
    from teleop_sim.world.dish_draw import DishWorld
    from teleop_sim.world.dish_layout import Obstacle

Point = tuple[float, float]
PLATE = "plate on the ground"


@dataclass(frozen=True)
class Thing:
    """Something on the map.

    Attributes:
        kind: decides how it is drawn, a key of ``run_walk.LOOKS``.
        outline: corners [m]; of two, a line; of one, a point.
        name: written beside it; empty: nothing.

    """

    kind: str
    outline: tuple[Point, ...]
    name: str = ""


def things(run: Run, joints: Mapping[str, float]) -> list[Thing]:
    """All that stood there, from the ground up.

    Args:
        run: whose log it is.
        joints: angles of the things' joints when the run ended [rad], as far as they are known.

    """
    site = _site(run)
    plates = [Thing("plate", corners(*plate)) for plate in _plates(run.records)]
    if site is None:
        return plates
    from teleop_sim.world.dish_scenery import DishScenery
    from teleop_sim.world.door import Door
    from teleop_sim.world.valve import Valve

    scenery = site.scenery
    if isinstance(scenery, DishScenery):
        return [*_walkway(scenery.world), *plates, *_dish(scenery.world)]
    if isinstance(scenery, Door):
        return [*plates, *_door((*scenery.place[:2], scenery.yaw_rad), joints.get("doorHinge", 0.0))]
    if isinstance(scenery, Valve):
        return [*plates, *_valve((*scenery.place[:2], scenery.yaw_rad))]
    return [*plates, *([Thing("thing", (site.thing.place[:2],), "thing")] if site.thing else [])]


def corners(x_m: float, y_m: float, yaw_rad: float, half_along_m: float, half_across_m: float) -> tuple[Point, ...]:
    """Corners of a rectangle by its middle, heading and half sides [m]."""
    ends = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return tuple(moved((x_m, y_m, yaw_rad), (a * half_along_m, b * half_across_m)) for a, b in ends)


def moved(pose: tuple[float, float, float], point: Point) -> Point:
    """A point given in the frame of a pose, in the frame that the pose is given in."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return pose[0] + c * point[0] - s * point[1], pose[1] + s * point[0] + c * point[1]


def _site(run: Run) -> Site | None:
    started = next((r for r in run.records if isinstance(r, RunStarted)), None)
    if started is None or not run.scenario:
        return None
    # Robots and their worlds are loaded only for this.
    from teleop_sim.core.streams import stream
    from teleop_sim.scenarios.files import read_scenario
    from teleop_sim.scenarios.objects import TASKS

    try:
        scenario = read_scenario(started.scenario_toml, str(run.log.path))
        return TASKS[scenario.task].site(scenario, partial(stream, started.seed, started.replicate))
    except (TeleopError, KeyError):
        return None


def _plates(records: Iterable[Record]) -> list[tuple[float, float, float, float, float]]:
    """Middle, heading and half sides of what lay on the ground besides."""
    found: dict[str, dict[str, float]] = {}
    for r in records:
        if isinstance(r, Disturbed) and r.what.startswith("plates[") and len(r.values) == 1:
            number, _, name = r.what.partition(".")
            found.setdefault(number, {})[name] = r.values[0]
    keys = ("x_m", "y_m", "yaw_rad", "half_length_m", "half_width_m")
    plates = ([plate.get(key, math.nan) for key in keys] for plate in found.values())
    return [(x, y, yaw, a, b) for x, y, yaw, a, b in plates if not math.isnan(x + y + yaw + a + b)]


def _walkway(world: DishWorld) -> list[Thing]:
    from teleop_sim.world.console import SQUARE_M
    from teleop_sim.world.dish_ground import corners as slab_corners
    from teleop_sim.world.dish_layout import layout

    ground = [Thing("ground", slab_corners(slab)) for slab in layout(world.layout_id).slabs]
    half_m = 0.5 * SQUARE_M
    squares = {"start": world.start, "finish": world.finish}
    return ground + [Thing("square", corners(*pose, half_m, half_m), name) for name, pose in squares.items()]


def _dish(world: DishWorld) -> list[Thing]:
    from teleop_sim.world.console import WHEEL_RADIUS_M, WHEEL_SEPARATION_M
    from teleop_sim.world.dish_layout import CHECKPOINT_SIDE_M, checkpoint_1

    side_m = 0.5 * CHECKPOINT_SIDE_M
    wheels = [moved(world.console, (0.0, sign * 0.5 * WHEEL_SEPARATION_M)) for sign in (1.0, -1.0)]
    return [
        Thing("checkpoint", corners(*checkpoint_1(world.dish), side_m, side_m)),
        *map(_obstacle, world.clutter),
        *(Thing("wheel", _circle(wheel, WHEEL_RADIUS_M)) for wheel in wheels),
        Thing("name", (world.console[:2],), "console"),
        Thing("thing", (world.dish[:2],), "dish"),
    ]


def _obstacle(obstacle: Obstacle) -> Thing:
    kind = obstacle.kind if obstacle.kind.startswith("drum") else "clutter"
    if kind != "clutter":
        return Thing(kind, _circle(obstacle.pose[:2], obstacle.half[0]))
    return Thing(kind, corners(*obstacle.pose, obstacle.half[0], obstacle.half[1]))


def _circle(centre: Sequence[float], radius_m: float) -> tuple[Point, ...]:
    turns = [math.tau * i / 24 for i in range(24)]
    return tuple((centre[0] + radius_m * math.cos(a), centre[1] + radius_m * math.sin(a)) for a in turns)


def _door(pose: tuple[float, float, float], open_rad: float) -> list[Thing]:
    """The panel shut and as it was in the end; it opens away from the robot, about hinges on the right."""
    from teleop_sim.world.door import HINGE, WIDTH_M

    hinge = moved(pose, (HINGE[0], HINGE[1]))
    shut, ajar = ((hinge, moved((*hinge, pose[2] - angle_rad), (0.0, WIDTH_M))) for angle_rad in (0.0, open_rad))
    return [Thing("shut", shut), Thing("door", ajar, "door")]


def _valve(pose: tuple[float, float, float]) -> list[Thing]:
    """The wheel from above, edge on, and the pipe behind it."""
    from teleop_sim.world.valve import RADIUS_M

    rim = tuple(moved(pose, (0.0, side * RADIUS_M)) for side in (-1.0, 1.0))
    return [Thing("wheel", rim, "valve"), Thing("pipe", (moved(pose, (0.0, 0.0)), moved(pose, (0.12, 0.0))))]
