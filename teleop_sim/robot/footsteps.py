"""Where the feet go: a gait's figures, body poses along a way, and the footsteps under them. Plane geometry."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from teleop_sim.robot.commands import PlanarPose

LEFT, RIGHT = 0, 1

STILL_M, STILL_RAD = 0.005, 0.01
"""Moves too small for a step: robots place their feet within 5 mm (docs/physics.md), and a turn of a microradian,
planned as one, takes 5 s."""

NO_LEG_M = 0.02
"""Shorter legs of a path are left out (a walk that ends further off is put right)."""


@dataclass(frozen=True)
class Gait:
    """Walking figures.

    ``swing_s``, ``transfer_s``: WPI's task code (both 0.7 s; val_task1.cpp). ``stride_m`` 0.3 and turning up to 0.2 rad
    with it, 0.6 rad on the spot: WPI's step options (footsteps_valkyrie.yaml, June 2017). ``lift_m``: 8 cm clears a
    2 cm bump (measured). ``width_m``: between sole centres. ``first_s``, ``last_s``: first load shift, rest (assumed).
    ``lean_rad``: how far the pelvis leans over a foot that bears all the weight; it takes load off the hip's roll.
    ``zmp_ahead_m``: how far ahead of the middle of a sole that bears all the ZMP is planned; that relieves the knee.
    """

    swing_s: float = 0.7
    transfer_s: float = 0.7
    lift_m: float = 0.08
    stride_m: float = 0.3
    back_stride_m: float = 0.25
    side_m: float = 0.1
    turn_rad: float = 0.6
    turn_walking_rad: float = 0.2
    width_m: float = 0.26
    first_s: float = 1.0
    last_s: float = 1.0
    lean_rad: float = 0.0
    zmp_ahead_m: float = 0.0


@dataclass(frozen=True)
class Footstep:
    """A sole's next place: foot 0 (left) or 1, sole centre x, y [m], yaw [rad]."""

    foot: int
    x: float
    y: float
    yaw: float


def sole_place(body: PlanarPose, foot: int, width_m: float) -> Footstep:
    """Where a sole belongs under a body pose."""
    x, y, yaw = body
    half = width_m / 2 * (1 if foot == LEFT else -1)
    return Footstep(foot, x - np.sin(yaw) * half, y + np.cos(yaw) * half, yaw)


def wrap(angle_rad: float) -> float:
    """The angle within (-pi, pi]."""
    return float(np.pi - (np.pi - angle_rad) % (2 * np.pi))


def body_between(feet: Sequence[PlanarPose]) -> PlanarPose:
    """Pose of the middle of both soles."""
    (x0, y0, a0), (x1, y1, a1) = feet
    return (x0 + x1) / 2, (y0 + y1) / 2, a0 + wrap(a1 - a0) / 2


def steps_along(bodies: Sequence[PlanarPose], first: int, gait: Gait) -> tuple[Footstep, ...]:
    """Alternate feet under successive body poses, then bring the other foot beside unless it is there."""
    steps = []
    foot = first
    for body in bodies:
        steps.append(sole_place(body, foot, gait.width_m))
        foot = 1 - foot
    if len(bodies) == 1 or (bodies and bodies[-1] != bodies[-2]):
        steps.append(sole_place(bodies[-1], foot, gait.width_m))
    return tuple(steps)


def walk_bodies(start: PlanarPose, path: Sequence[PlanarPose], gait: Gait) -> list[PlanarPose]:
    """Body poses, one a step, along straight legs: face the next place, walk to it; at the last, turn to its yaw.

    A turn that strides can make takes no steps of its own, nor does a bend end a stride. Paths bend here or there by
    centimetres and meet their goals' headings within milliradians of a sighting: such a turn would take its two steps
    on the spot, 5 s, or not, by chance, and so would each leg's last stride.
    """
    bodies: list[PlanarPose] = []
    here = start
    for bends in _stretches(start, path, gait):
        walked = _stretch(here, bends, gait)
        bodies += walked
        here = walked[-1]
    x, y, yaw = here
    last = wrap(path[-1][2] - yaw)
    before = bodies[-2][2] if len(bodies) > 1 else start[2]
    if bodies and abs(wrap(yaw + last - before)) <= gait.turn_walking_rad:
        return [*bodies[:-1], (x, y, yaw + last)]
    return bodies + turn_bodies(here, last, gait)


def _stretches(start: PlanarPose, path: Sequence[PlanarPose], gait: Gait) -> list[list[tuple[float, float]]]:
    """The places of a path, parted where it bends further than three strides turn; legs under 2 cm left out."""
    stretches: list[list[tuple[float, float]]] = []
    x, y, heading = start[0], start[1], math.inf
    for px, py, _ in path:
        if math.hypot(px - x, py - y) < NO_LEG_M:
            continue
        before, heading = heading, math.atan2(py - y, px - x)
        if math.isfinite(before) and abs(wrap(heading - before)) <= 3 * gait.turn_walking_rad:
            stretches[-1].append((px, py))
        else:
            stretches.append([(px, py)])
        x, y = px, py
    return stretches


def _stretch(start: PlanarPose, bends: Sequence[tuple[float, float]], gait: Gait) -> list[PlanarPose]:
    """Body poses from a place through bends to the last of them, in equal strides."""
    x, y, yaw = start
    places = np.array([(x, y), *bends])
    legs = np.diff(places, axis=0)
    ends = np.concatenate([[0.0], np.cumsum(np.hypot(legs[:, 0], legs[:, 1]))])
    headings = np.arctan2(legs[:, 1], legs[:, 0])
    n = int(np.ceil(ends[-1] / gait.stride_m - 1e-9))
    turn = wrap(float(headings[0]) - yaw)
    # What the strides can turn on the way need not be turned on the spot.
    spot = math.copysign(max(0.0, abs(turn) - 2 * gait.turn_walking_rad), turn) if n > 3 else turn
    if abs(spot) <= gait.turn_walking_rad:
        spot = 0.0
    bodies = turn_bodies(start, spot, gait)
    yaw += spot
    for k in range(1, n + 1):
        at_m = ends[-1] * k / n
        leg = min(int(np.searchsorted(ends, at_m - 1e-9)), len(legs)) - 1
        share = (at_m - ends[leg]) / (ends[leg + 1] - ends[leg])
        yaw += float(np.clip(wrap(float(headings[leg]) - yaw), -gait.turn_walking_rad, gait.turn_walking_rad))
        px, py = places[leg] + share * legs[leg]
        bodies.append((float(px), float(py), yaw))
    bodies[-1] = (*bends[-1], yaw)
    return bodies


def turn_bodies(start: PlanarPose, turn_rad: float, gait: Gait) -> list[PlanarPose]:
    """Body poses of a turn on the spot: each angle twice, once for each foot; none for less than ``STILL_RAD``."""
    x, y, yaw = start
    n = int(np.ceil(abs(turn_rad) / gait.turn_rad - 1e-9)) if abs(turn_rad) > STILL_RAD else 0
    return [(x, y, yaw + turn_rad * k / n) for k in range(1, n + 1) for _ in (0, 1)]


def shift_bodies(
    start: PlanarPose, forward_m: float, left_m: float, gait: Gait, turn_rad: float = 0.0
) -> list[PlanarPose]:
    """Body poses of a move in the robot's own frame, with a small turn on the way; none for less than ``STILL_M``."""
    if np.hypot(forward_m, left_m) < STILL_M:
        return []
    x, y, yaw = start
    c, s = np.cos(yaw), np.sin(yaw)
    stride = gait.stride_m if forward_m > 0 else gait.back_stride_m
    n = int(np.ceil(max(abs(forward_m) / stride, abs(left_m) / gait.side_m) - 1e-9))
    moves = [(forward_m * k / n, left_m * k / n, turn_rad * k / n) for k in range(1, n + 1)]
    # A side step needs both feet at each place, or the legs would cross.
    repeat = (0, 1) if abs(left_m) > STILL_M else (0,)
    return [(x + c * f - s * m, y + s * f + c * m, yaw + t) for f, m, t in moves for _ in repeat]


def first_foot(turn_rad: float, left_m: float = 0.0) -> int:
    """The foot that leads: the inner one of a turn, the outer one of a side step."""
    return LEFT if turn_rad + left_m > 0 else RIGHT
