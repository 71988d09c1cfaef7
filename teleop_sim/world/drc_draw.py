"""The worlds of door and valve, drawn: every value explicit, each kind of value from its own random stream.

The robot's start is the world's origin; the thing stands where the robot can work on it when it has walked ``ahead_m``
straight on, but for an error of place and turn.

Published (DARPA Robotics Challenge Finals): what the docstrings of ``door.py`` and ``valve.py`` say. Assumed: all
ranges (docs/assumptions.md).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from teleop_sim.world import door, valve
from teleop_sim.world.description import Vector
from teleop_sim.world.door import Door
from teleop_sim.world.valve import Valve

Range = tuple[float, float]
Streams = Callable[[str], np.random.Generator]

GHOST_BEFORE_M, GHOST_SPREAD_M = 0.22, 0.08
"""Spurious obstacles hang so far before the thing, and scatter so much in each direction (assumed: where arms work)."""


@dataclass(frozen=True)
class ThingSettings:
    """What is drawn of any thing; see ``teleop_sim.scenarios.drc_schema`` for units and meanings."""

    ahead_m: Range = (0.0, 0.0)
    place_jitter_m: float = 0.02
    place_jitter_rad: float = 0.05
    surface_friction: Range = (0.4, 1.0)
    ghosts: tuple[int, int] | None = None


@dataclass(frozen=True)
class DoorSettings(ThingSettings):
    """Of the door."""

    mass_kg: Range = (20.0, 25.0)
    hinge_nm: Range = (1.0, 3.0)
    spring_nm: Range = (1.0, 3.0)
    closer_rad: Range = (0.0, 0.0)


@dataclass(frozen=True)
class ValveSettings(ThingSettings):
    """Of the valve."""

    friction_nm: Range = (2.0, 4.0)


@dataclass(frozen=True)
class Placed:
    """Where the thing was drawn to be.

    Attributes:
        ahead_m: how far the robot starts before the place it works from.
        nominal: where the thing would be without an error [m]: what a map of the course says.
        place: of the thing's frame [m], the robot's start frame. yaw_rad: of the thing.
        grip: sliding friction of its surface.
        ghosts: spurious obstacles in the world model [m].
    """

    ahead_m: float
    nominal: Vector
    place: Vector
    yaw_rad: float
    grip: float
    ghosts: tuple[Vector, ...]


def draw_door(streams: Streams, settings: DoorSettings, stand: tuple[float, float]) -> tuple[Door, Placed]:
    """A door; ``stand``: lever ahead and left of a robot that works on it [m]."""
    at = _placed(streams, settings, (*stand, door.LEVER_HEIGHT_M))
    mass, hinge, spring, lean = streams("door.build").random(4)
    made = Door(
        place=at.place,
        yaw_rad=at.yaw_rad,
        mass_kg=_between(mass, settings.mass_kg),
        hinge_nm=_between(hinge, settings.hinge_nm),
        spring_nm=_between(spring, settings.spring_nm),
        closer_rad=_between(lean, settings.closer_rad),
        grip=at.grip,
    )
    return made, at


def draw_valve(streams: Streams, settings: ValveSettings, stand: tuple[float, float]) -> tuple[Valve, Placed]:
    """A valve; ``stand``: its wheel's centre ahead and left of a robot that works on it [m]."""
    at = _placed(streams, settings, (*stand, valve.HEIGHT_M))
    friction, start = streams("valve.build").random(2)
    made = Valve(
        place=at.place,
        yaw_rad=at.yaw_rad,
        friction_nm=_between(friction, settings.friction_nm),
        start_rad=float(start) * math.tau / valve.SPOKES,
        grip=at.grip,
    )
    return made, at


def _placed(streams: Streams, settings: ThingSettings, nominal: Vector) -> Placed:
    """Where it is, as the robot's start sees it; all draws are made whatever the setting."""
    rng = streams("thing.place")
    ahead_m = _between(rng.random(), settings.ahead_m)
    dx, dy, dyaw = rng.uniform(-1.0, 1.0, 3)
    x = nominal[0] + ahead_m + settings.place_jitter_m * float(dx)
    y = nominal[1] + settings.place_jitter_m * float(dy)
    yaw, grip = settings.place_jitter_rad * float(dyaw), _between(rng.random(), settings.surface_friction)
    place = (x, y, nominal[2])
    expected = (nominal[0] + ahead_m, *nominal[1:])
    return Placed(ahead_m, expected, place, yaw, grip, _ghosts(streams, settings, place))


def _ghosts(streams: Streams, settings: ThingSettings, place: Vector) -> tuple[Vector, ...]:
    rng = streams("thing.ghosts")
    fewest, most = settings.ghosts or (0, 0)
    count = int(rng.integers(fewest, most + 1))
    middle = np.array(place) - [GHOST_BEFORE_M, 0.0, 0.0]
    return tuple(
        (float(x), float(y), float(z)) for x, y, z in middle + GHOST_SPREAD_M * rng.standard_normal((count, 3))
    )


def _between(share: float, limits: Range) -> float:
    low, high = limits
    return low + (high - low) * float(share)
