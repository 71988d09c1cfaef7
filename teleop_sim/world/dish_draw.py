"""One world of SRC task 1, drawn: every value explicit, each kind of value from its own random stream.

Source of figures: osrf/srcsim 0.8.0 (commit 2225f67), worlds/unique.world.erb, unless a line says assumed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from teleop_sim.core.errors import UnknownName
from teleop_sim.world import console as shape
from teleop_sim.world import dish_layout as lay
from teleop_sim.world.dish_layout import Layout, Obstacle, Planar
from teleop_sim.world.light import Light

Range = tuple[float, float]

DRUM_RADIUS_M, DRUM_HALF_M = 0.14, 0.44
"""Drums as wide as the console's wheels and as high as its back (assumed)."""

SQUARE_CLEAR_M = 2.5
"""Drums stay so far from the middle of the start square (assumed)."""


@dataclass(frozen=True, slots=True)
class DishSettings:
    """What is drawn, and between which limits (uniformly; equal limits fix a value).

    Attributes:
        layout_id: 1 to 5, or None to draw it.
        wheel_friction_nm: Coulomb friction, drawn for each wheel (unique.world.erb).
        wheel_start_spread_rad: the knob starts at most this far from its published place next to the robot (assumed).
        yaw_target_rad: of the dish (unique.world.erb).
        pitch_target_rad: of the dish (unique.world.erb).
        floor_friction: of walkway and soil, one a world (assumed; the paper: "varying friction coefficients").
        contact_friction: of wheels and console (assumed).
        console_jitter_m: the console stands at most this far off in x and in y (assumed; none is published).
        console_jitter_rad: and is turned at most this much (assumed).
        clutter: fewest and most boxes on the soil besides the published rocks and crates (assumed).
        drums: fewest and most pairs of drums, a red and a blue one, beside the walkway (assumed): from afar such a pair
            has the colours and the distance of the console's wheels.

    """

    layout_id: int | None = None
    wheel_friction_nm: Range = (2.0, 3.0)
    wheel_start_spread_rad: float = 0.5
    yaw_target_rad: Range = (-1.65, 2.20)
    pitch_target_rad: Range = (-0.2, 1.25)
    floor_friction: Range = (0.4, 1.0)
    contact_friction: Range = (0.6, 1.0)
    console_jitter_m: float = 0.03
    console_jitter_rad: float = math.radians(2.0)
    clutter: tuple[int, int] = (2, 6)
    drums: tuple[int, int] = (0, 0)


@dataclass(frozen=True, slots=True)
class DishWorld:
    """One drawn world; equal values make equal worlds.

    Attributes:
        layout_id: number of the walkway, see ``dish_layout.layout``.
        console: middle of the two wheels on the ground; the heading is that of a robot that faces the console.
        start: centre of the start square.
        finish: centre of the finish square.
        wheel_friction_nm: of the yaw wheel and the pitch wheel.
        wheel_start_rad: handle angles of the two knobs at joint angle 0, anticlockwise from the wheel frame's x.
        targets_rad: dish yaw and pitch to be reached.
        floor_friction: sliding friction of everything to stand on.
        contact_friction: sliding friction of wheels, knobs and console.
        light: for the cameras.
        clutter: rocks, crates, boxes and drums beside the walkway.

    """

    layout_id: int
    console: Planar
    start: Planar
    finish: Planar
    wheel_friction_nm: tuple[float, float]
    wheel_start_rad: tuple[float, float]
    targets_rad: tuple[float, float]
    floor_friction: float
    contact_friction: float
    light: Light
    clutter: tuple[Obstacle, ...]

    @property
    def dish(self) -> Planar:
        """The dish's mast, heading as the console's."""
        return lay.compose(self.console, (shape.PIVOT_AHEAD_M, 0.0, 0.0))


def draw_dish_world(rng_by_name: Callable[[str], np.random.Generator], settings: DishSettings) -> DishWorld:
    """Draw a world. Each kind of value has its own stream, so that fixing one leaves the others as they are.

    Raises:
        UnknownName: ``settings.layout_id`` is none of the published worlds.

    """
    layout = lay.layout(_draw_layout(rng_by_name("world.layout"), settings.layout_id))
    published = lay.console_on(layout.dish, shape.PIVOT_AHEAD_M)
    shift = rng_by_name("world.console").uniform(-1.0, 1.0, 3)
    console = (
        published[0] + settings.console_jitter_m * float(shift[0]),
        published[1] + settings.console_jitter_m * float(shift[1]),
        published[2] + settings.console_jitter_rad * float(shift[2]),
    )
    friction, target = rng_by_name("world.friction"), rng_by_name("world.target")
    spread = settings.wheel_start_spread_rad
    return DishWorld(
        layout_id=layout.layout_id,
        console=console,
        start=lay.START,
        finish=layout.finish,
        wheel_friction_nm=_pair(rng_by_name("world.wheel.friction"), settings.wheel_friction_nm),
        wheel_start_rad=_pair(rng_by_name("world.wheel.start"), (math.pi - spread, math.pi + spread)),
        targets_rad=(_uniform(target, settings.yaw_target_rad), _uniform(target, settings.pitch_target_rad)),
        floor_friction=_uniform(friction, settings.floor_friction),
        contact_friction=_uniform(friction, settings.contact_friction),
        light=_draw_light(rng_by_name("world.light")),
        clutter=layout.obstacles
        + _draw_clutter(rng_by_name("world.clutter"), layout, settings.clutter)
        + _draw_drums(rng_by_name("world.drums"), layout, settings.drums),
    )


def _draw_layout(rng: np.random.Generator, fixed: int | None) -> int:
    drawn = lay.LAYOUT_IDS[int(rng.integers(len(lay.LAYOUT_IDS)))]
    if fixed is not None and fixed not in lay.LAYOUT_IDS:
        raise UnknownName("world.layout_id", str(fixed), tuple(map(str, lay.LAYOUT_IDS)))
    return drawn if fixed is None else fixed


def _uniform(rng: np.random.Generator, limits: Range) -> float:
    return limits[0] + (limits[1] - limits[0]) * float(rng.random())


def _pair(rng: np.random.Generator, limits: Range) -> tuple[float, float]:
    return _uniform(rng, limits), _uniform(rng, limits)


def _draw_light(rng: np.random.Generator) -> Light:
    """Sun 20 to 80 degrees high; from dusk (0.35) to glare (1.4); white to warm. All limits are assumed."""
    height, azimuth = _uniform(rng, (0.35, 1.4)), _uniform(rng, (-math.pi, math.pi))
    level, warm, sky = _uniform(rng, (0.35, 1.4)), _uniform(rng, (0.0, 0.35)), _uniform(rng, (0.12, 0.4))
    to_sun = (math.cos(height) * math.cos(azimuth), math.cos(height) * math.sin(azimuth), math.sin(height))
    sun = (0.9 * level, 0.9 * level * (1.0 - 0.4 * warm), 0.9 * level * (1.0 - warm))
    return Light(to_sun, sun, level * sky)


def _draw_clutter(rng: np.random.Generator, layout: Layout, fewest_most: tuple[int, int]) -> tuple[Obstacle, ...]:
    """Boxes on the soil within 6 m of the finish's and start's middle, clear of walkway and console (all assumed)."""
    count = int(rng.integers(fewest_most[0], fewest_most[1] + 1))
    middle_x, middle_y = 0.5 * layout.finish[0], 0.5 * layout.finish[1]
    found: list[Obstacle] = []
    # Enough tries for any count that fits; a crowded world just gets fewer boxes.
    for _ in range(50 * count):
        x, y = middle_x + _uniform(rng, (-6.0, 6.0)), middle_y + _uniform(rng, (-6.0, 6.0))
        yaw = _uniform(rng, (-math.pi, math.pi))
        half = (_uniform(rng, (0.1, 0.4)), _uniform(rng, (0.1, 0.4)), _uniform(rng, (0.1, 0.4)))
        if len(found) < count and _is_free(layout, x, y):
            found.append(Obstacle("box", (x, y, yaw), half))
    return tuple(found)


def _draw_drums(rng: np.random.Generator, layout: Layout, fewest_most: tuple[int, int]) -> tuple[Obstacle, ...]:
    """Pairs of drums 1.5 to 3 m from the console, red on the left as seen from the start (all assumed)."""
    count = int(rng.integers(fewest_most[0], fewest_most[1] + 1))
    at = lay.console_on(layout.dish, shape.PIVOT_AHEAD_M)
    found: list[Obstacle] = []
    for _ in range(200 * count):
        away_m, angle = _uniform(rng, (1.5, 3.0)), _uniform(rng, (-math.pi, math.pi))
        x, y = at[0] + away_m * math.cos(angle), at[1] + away_m * math.sin(angle)
        if len(found) < 2 * count and _is_free(layout, x, y) and math.hypot(x, y) > SQUARE_CLEAR_M:
            way = math.atan2(y, x)
            c, s = math.cos(way), math.sin(way)
            half, apart_m = (DRUM_RADIUS_M, DRUM_RADIUS_M, DRUM_HALF_M), shape.WHEEL_SEPARATION_M / 2.0
            found.append(Obstacle("drum_red", (x - apart_m * s, y + apart_m * c, way), half))
            found.append(Obstacle("drum_blue", (x + apart_m * s, y - apart_m * c, way), half))
    return tuple(found)


def _is_free(layout: Layout, x_m: float, y_m: float) -> bool:
    """Whether a box's circle of 0.6 m stays off the walkway, and 1.5 m off the console and the mast."""
    console = lay.console_on(layout.dish, shape.PIVOT_AHEAD_M)
    if any(math.hypot(x_m - p[0], y_m - p[1]) < 1.5 for p in (console, layout.dish)):
        return False
    for slab in layout.slabs:
        u, v, _ = lay.compose(lay.inverse(slab.pose), (x_m, y_m, 0.0))
        if math.hypot(max(abs(u) - slab.half_along_m, 0.0), max(abs(v) - slab.half_across_m, 0.0)) < 0.6:
            return False
    return True
