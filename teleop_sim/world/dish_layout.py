"""The walkways of the five final worlds of the Space Robotics Challenge, task 1, laid tile by tile.

Frame: x forward from where the robot starts, y left; the robot starts at the origin on the start square. It is the
world frame of the published worlds, only with z = 0 on the walkway's surface.

Source of tile sizes, exits, slots and of the obstacles' places: osrf/srcsim 0.8.0 (commit 2225f67),
worlds/unique.world.erb and worlds/final_1..5.world. Laying the tiles by these rules gives the published dish,
checkpoint and finish poses (a test compares them).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from teleop_sim.world.console import SQUARE_M

Planar = tuple[float, float, float]
"""x [m], y [m], heading [rad]."""
Turn = Literal["left", "straight", "right"]
ClutterKind = Literal["rock_1", "rock_2", "rock_3", "crate", "crate_long", "box", "drum_red", "drum_blue"]

TILE_M = 1.524
START: Planar = (0.09, 0.0, 0.0)
"""Centre of the start square."""
SLOT_TO_DISH_M = 2.0
CHECKPOINT_BEFORE_DISH_M = 2.4
CHECKPOINT_SIDE_M = 1.0

# Exit of a 45 degree tile, as shares of the tile's length (published to six digits).
_BEND_AHEAD_M, _BEND_ASIDE_M = 0.8535 * TILE_M, 0.353983 * TILE_M
# A 45 degree tile is a hexagon; it is exactly the union of two boxes of this length, one from either end.
_BEND_BOX_M = 0.5 * TILE_M * math.sqrt(2.0)
_QUARTER = 0.5 * math.pi


@dataclass(frozen=True, slots=True)
class Slab:
    """A level rectangle to walk on: centre and heading, half its length along and across the heading [m]."""

    pose: Planar
    half_along_m: float
    half_across_m: float

    def bends_into(self, other: Slab) -> bool:
        """Whether the other slab is the second box of the same bend: 45 degrees on and of the same length."""
        turn = abs(math.remainder(other.pose[2] - self.pose[2], 2.0 * math.pi))
        same = math.isclose(self.half_along_m, other.half_along_m) and math.isclose(
            self.half_along_m, 0.5 * _BEND_BOX_M
        )
        return same and math.isclose(turn, 0.25 * math.pi)


@dataclass(frozen=True, slots=True)
class Obstacle:
    """A thing on the soil: its kind, pose and half sizes [m] (a rock is an ellipsoid, the rest are boxes)."""

    kind: ClutterKind
    pose: Planar
    half: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Layout:
    """One laid walkway.

    Attributes:
        layout_id: 1 to 5, the number of the published final world.
        slabs: the walkway, start square first and finish square second; slabs overlap at bends.
        dish: the dish's mast; the heading points away from the robot that faces the console.
        finish: centre of the finish square.
        obstacles: published rocks and crates beside the walkway.

    """

    layout_id: int
    slabs: tuple[Slab, ...]
    dish: Planar
    finish: Planar
    obstacles: tuple[Obstacle, ...]


@dataclass(frozen=True, slots=True)
class _Plan:
    tiles: tuple[Turn, Turn]
    slot: Literal["left", "right", "bend"]
    exit: Turn
    obstacles: tuple[tuple[ClutterKind, float, float, float], ...]


def compose(a: Planar, b: Planar) -> Planar:
    """Pose ``b``, given in the frame of ``a``, in the frame that ``a`` is given in."""
    c, s = math.cos(a[2]), math.sin(a[2])
    return (a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], a[2] + b[2])


def inverse(a: Planar) -> Planar:
    """The pose that ``compose`` turns into the origin after ``a``."""
    c, s = math.cos(a[2]), math.sin(a[2])
    return (-c * a[0] - s * a[1], s * a[0] - c * a[1], -a[2])


def inside(box: Planar, side_m: float, x_m: float, y_m: float) -> bool:
    """Whether a point is in a square (edges included) of ``side_m`` around ``box``."""
    u, v, _ = compose(inverse(box), (x_m, y_m, 0.0))
    return abs(u) <= 0.5 * side_m and abs(v) <= 0.5 * side_m


def checkpoint_1(dish: Planar) -> Planar:
    """Centre of the 1 m square in front of the console."""
    return compose(dish, (-CHECKPOINT_BEFORE_DISH_M, 0.0, 0.0))


def console_on(dish: Planar, ahead_m: float) -> Planar:
    """Middle of the console's wheels, ``ahead_m`` before the mast; same heading."""
    return compose(dish, (-ahead_m, 0.0, 0.0))


def layout(layout_id: int) -> Layout:
    """Lay the walkway of one of the five final worlds.

    The walkway goes on after the finish with task 2; its first tile is there, the rest is left out.
    """
    plan = _PLANS[layout_id]
    entrance = compose(START, (0.5 * SQUARE_M, 0.0, 0.0))
    slabs = [_square(START)]
    path: list[Slab] = []
    first = entrance
    for turn in plan.tiles:
        path += _tile(entrance, turn)
        entrance = compose(entrance, _EXIT[turn])
    finish = compose(entrance, (0.5 * SQUARE_M, 0.0, 0.0))
    leave = compose(compose(finish, (0.0, 0.0, _HEADING[plan.exit])), (0.5 * SQUARE_M, 0.0, 0.0))
    slabs += [_square(finish), *path, *_tile(leave, "straight")]
    return Layout(
        layout_id=layout_id,
        slabs=tuple(slabs),
        dish=compose(compose(first, _SLOT[plan.slot]), (SLOT_TO_DISH_M, 0.0, 0.0)),
        finish=finish,
        obstacles=tuple(Obstacle(k, (x, y, yaw), HALF[k]) for k, x, y, yaw in plan.obstacles),
    )


def middle_of_walkway(layout_id: int) -> tuple[tuple[float, float], ...]:
    """Corners (x, y) [m] of a line along the walkway's middle, from the start's to the finish's."""
    laid = layout(layout_id)
    return tuple((x, y) for x, y, _ in (START, *(slab.pose for slab in laid.slabs[2:-1]), laid.finish))


def _square(centre: Planar) -> Slab:
    return Slab(centre, 0.5 * SQUARE_M, 0.5 * SQUARE_M)


def _tile(entrance: Planar, turn: Turn) -> list[Slab]:
    if turn == "straight":
        return [Slab(compose(entrance, (0.5 * TILE_M, 0.0, 0.0)), 0.5 * TILE_M, 0.5 * TILE_M)]
    out = compose(entrance, _EXIT[turn])
    half = 0.5 * _BEND_BOX_M
    return [Slab(compose(end, (u, 0.0, 0.0)), half, 0.5 * TILE_M) for end, u in ((entrance, half), (out, -half))]


_EXIT: dict[Turn, Planar] = {
    "straight": (TILE_M, 0.0, 0.0),
    "right": (_BEND_AHEAD_M, -_BEND_ASIDE_M, -0.25 * math.pi),
    "left": (_BEND_AHEAD_M, _BEND_ASIDE_M, 0.25 * math.pi),
}
_HEADING: dict[Turn, float] = {"straight": 0.0, "right": -_QUARTER, "left": _QUARTER}
# Places for things beside the first tile; "bend" is the outer side of a right-hand bend.
_SLOT: dict[str, Planar] = {
    "left": (0.5 * TILE_M, 0.5 * TILE_M, _QUARTER),
    "right": (0.5 * TILE_M, -0.5 * TILE_M, -_QUARTER),
    "bend": (0.89 * TILE_M, 0.40 * TILE_M, 0.25 * math.pi),
}
HALF: dict[ClutterKind, tuple[float, float, float]] = {
    "rock_1": (0.283, 0.240, 0.325),
    "rock_2": (0.404, 0.406, 0.880),
    "rock_3": (0.668, 0.835, 1.102),
    "crate": (0.36, 0.36, 0.36),
    "crate_long": (0.54, 0.36, 0.36),
}
"""Half sizes [m]: measured from the models' meshes at their scale 0.03; a rock is half an ellipsoid on the ground."""

_PLANS = {
    1: _Plan(
        ("right", "straight"),
        "left",
        "left",
        (
            ("rock_3", 0.09, -2.624, 3.1416),
            ("rock_3", 0.09, 2.624, 0.0),
            ("crate", 3.2532, 0.8924, -0.7854),
            ("crate_long", 2.3490, -2.1828, 3.1416),
            ("crate", 4.2752, -0.2566, -0.7854),
            ("rock_3", 6.9254, -4.5502, -2.3562),
            ("crate", 3.7095, -4.0552, 2.3562),
        ),
    ),
    2: _Plan(
        ("straight", "straight"),
        "right",
        "right",
        (
            ("rock_1", 0.09, -1.924, 3.1416),
            ("crate_long", 0.09, 2.324, 0.7854),
            ("rock_2", 2.376, 1.262, 0.0),
            ("rock_2", 3.9, -1.262, 3.1416),
            ("crate", 3.9, 1.162, 0.0),
            ("rock_2", 8.21, 0.0, -1.5708),
            ("crate_long", 6.186, 2.324, 0.7854),
        ),
    ),
    3: _Plan(
        ("right", "left"),
        "bend",
        "right",
        (
            ("rock_3", 0.09, -2.624, 3.1416),
            ("rock_1", 0.09, 1.924, 0.0),
            ("rock_3", 2.376, 1.862, 0.0),
            ("rock_1", 2.5768, -1.9702, 2.3562),
            ("rock_1", 3.4540, -2.2398, 3.1416),
            ("rock_3", 8.3640, -1.0778, -1.5708),
            ("crate_long", 5.7400, 1.2462, 0.7854),
        ),
    ),
    4: _Plan(
        ("straight", "left"),
        "left",
        "right",
        (
            ("crate_long", 0.09, 2.324, 0.7854),
            ("crate_long", 0.09, -2.324, -2.3562),
            ("crate_long", 2.376, -1.562, -2.3562),
            ("crate_long", 5.0044, -1.1038, -1.5708),
            ("rock_3", 3.9107, -1.9507, 3.1416),
            ("rock_1", 6.8768, 2.9776, -0.7854),
            ("rock_3", 3.6609, 3.4725, 0.7854),
        ),
    ),
    5: _Plan(
        ("right", "straight"),
        "bend",
        "straight",
        (
            ("crate", 0.09, 1.924, 0.0),
            ("rock_2", 0.09, -2.024, 3.1416),
            ("crate_long", 2.376, 1.562, 0.7854),
            ("rock_1", 4.2752, -0.2566, -0.7854),
            ("rock_2", 2.5612, -1.9707, 2.3562),
            ("crate", 3.7095, -4.0552, 2.3562),
            ("rock_2", 6.5012, -1.2635, -0.7854),
        ),
    ),
}
LAYOUT_IDS = tuple(_PLANS)
