"""Draw disturbances from ranges: what a scenario states is a range, what a run meets is a draw.

Everything is drawn whatever the ranges are, each from its own stream: a range changed moves no other draw.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from teleop_sim.world.description import Vector
from teleop_sim.world.disturbances import Disturbances, Plate, Push


@dataclass(frozen=True, slots=True)
class DisturbanceRanges:
    """How much may be otherwise than believed. The defaults are mild (assumed): a robot weighed to 1 %, a dry floor.

    Attributes:
        floor_friction: lowest and highest; None leaves the scenery's own.
        mass_error: the masses' factor is within 1 +- this.
        com_error_m: standard deviation of the trunk's centre of mass in each direction.
        push_n: force of a push from any side; 0 is none.
        push_every_s: shortest and longest time of motion between two.
        push_s: how long one lasts.
        bump_m: height of a bump across the way; 0 is none.
        joint_friction: share of a joint's effort limit.
        delay_s: of what the controller feels.
    """

    floor_friction: tuple[float, float] | None = None
    mass_error: float = 0.01
    com_error_m: float = 0.002
    push_n: float = 0.0
    push_every_s: tuple[float, float] = (2.5, 4.0)
    push_s: float = 0.2
    bump_m: float = 0.0
    joint_friction: float = 0.0
    delay_s: float = 0.0


PUSHED_UP_TO_S = 300.0
"""Pushes are drawn for so much time of motion (assumed: longer than any task moves)."""

BUMP_HALF_LENGTH_M = 0.15
BUMP_HALF_WIDTH_M = 0.6
"""A bump is a plate as long as a foot and wider than a robot (assumed)."""


def draw_disturbances(
    streams: Callable[[str], np.random.Generator], ranges: DisturbanceRanges, way: tuple[Vector, Vector]
) -> Disturbances:
    """Draw one run's disturbances.

    Args:
        streams: gives a random stream for a name. ranges: how much.
        way: two points on the ground; a bump lies across the line between them, between 15 % and 85 % of it.
    """
    rng = streams("disturbances.body")
    share, com, slippery = rng.uniform(-1.0, 1.0), rng.normal(0.0, 1.0, 3), streams("disturbances.floor").uniform()
    low, high = ranges.floor_friction or (0.8, 0.8)
    friction = low + slippery * (high - low)
    x, y, z = ranges.com_error_m * com
    return Disturbances(
        floor_friction=None if ranges.floor_friction is None else friction,
        plates=_bump(streams("disturbances.bump"), ranges.bump_m, friction, way),
        pushes=_pushes(streams("disturbances.pushes"), ranges),
        mass_factor=1.0 + share * ranges.mass_error,
        com_error_m=(float(x), float(y), float(z)),
        joint_friction=ranges.joint_friction,
        delay_s=ranges.delay_s,
    )


def _bump(rng: np.random.Generator, height_m: float, friction: float, way: tuple[Vector, Vector]) -> tuple[Plate, ...]:
    (x0, y0, _), (x1, y1, _) = way
    u, askew = rng.uniform(0.15, 0.85), rng.uniform(-0.3, 0.3)
    yaw = float(np.arctan2(y1 - y0, x1 - x0)) + askew
    x, y = x0 + u * (x1 - x0), y0 + u * (y1 - y0)
    bump = Plate(x, y, yaw, BUMP_HALF_LENGTH_M, BUMP_HALF_WIDTH_M, height_m, friction)
    return (bump,) if height_m > 0 else ()


def _pushes(rng: np.random.Generator, ranges: DisturbanceRanges) -> tuple[Push, ...]:
    pushes: list[Push] = []
    at_s = 0.0
    while True:
        pause, angle = rng.uniform(*ranges.push_every_s), rng.uniform(-np.pi, np.pi)
        at_s += float(pause)
        if at_s > PUSHED_UP_TO_S or ranges.push_n == 0:
            return tuple(pushes)
        force = (float(ranges.push_n * np.cos(angle)), float(ranges.push_n * np.sin(angle)), 0.0)
        pushes.append(Push(at_s, ranges.push_s, force))
