"""What a hand is made of, whatever its kind: solids, moving parts with a servo each, and what a planner takes it for.

All places are in the tool frame: its origin is where the middle of a held thing goes, its z points from the palm to
that thing (the approach direction), its x is the direction in which jaws slide. A closing solid has ``Bar`` in its name
and any other ``Flange``: who watches contacts tells by that what is meant to touch.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from teleop_sim.world import contact
from teleop_sim.world.description import Link, Vector

ORIGIN: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Solid:
    """One shape on the hand or on a part of it.

    Attributes:
        name: without the side.
        kind: ``capsule`` from ``a_m`` to ``b_m`` with ``radius_m``; ``box`` at ``a_m`` with half sizes ``b_m``;
            ``cylinder`` about z at ``a_m`` with ``radius_m`` and half its length in the last of ``b_m``.
        mass_kg: zero where the part has an inertia of its own.
        friction: sliding; of two geoms that touch the larger counts, so a small one lets the world's decide.

    """

    name: str
    kind: Literal["capsule", "box", "cylinder"]
    a_m: Vector
    b_m: Vector
    radius_m: float = 0.0
    mass_kg: float = 0.0
    friction: float = contact.OWN_FRICTION


@dataclass(frozen=True)
class Drive:
    """A part's joint and its position servo: force = kp (reference - q) - kv q', within the limit.

    ``rotary``: a hinge, units rad and N m; else a slide, m and N. ``open_q``, ``shut_q``: references; a skill that asks
    for more than shut presses the harder.
    """

    rotary: bool
    axis: Vector
    lower: float
    upper: float
    open_q: float
    shut_q: float
    kp: float
    kv: float
    limit: float
    damping: float
    armature: float


@dataclass(frozen=True)
class HandPart:
    """A moving body of a hand.

    Attributes:
        name: of body, joint and actuator, without the side.
        parent: name of the part that carries it, or nothing for the hand itself.
        position_m, rotation: where it sits on its parent at zero; (3, 3).
        link: its inertia, or none if its solids have their masses.

    """

    name: str
    parent: str
    position_m: Vector
    rotation: np.ndarray
    drive: Drive
    solids: tuple[Solid, ...]
    link: Link | None = None


@dataclass(frozen=True)
class Lump:
    """A cylinder about tool z that stands for some of a hand in plans: mass [kg], middle, radius, length [m]."""

    mass_kg: float
    at_m: Vector
    radius_m: float
    length_m: float


class Hand(Protocol):
    """A kind of hand as data, with its sizes as attributes."""

    @property
    def mass_kg(self) -> float:
        """Of all of it."""

    @property
    def fixed(self) -> tuple[Solid, ...]:
        """Solids that do not move against the palm."""

    @property
    def parts(self) -> tuple[HandPart, ...]:
        """Moving parts, parents first, in MuJoCo's order (depth first)."""

    @property
    def lumps(self) -> tuple[Lump, ...]:
        """The open hand as a planner takes it: exact in mass and centre, near enough in inertia."""


@dataclass(frozen=True)
class Placed:
    """A solid of the open hand in the tool frame: placement (3, 3), (3,) [m] of the body it sits on."""

    solid: Solid
    rotation: np.ndarray
    position_m: np.ndarray


def opened(hand: Hand) -> tuple[Placed, ...]:
    """All solids of a hand where they stand when it is open."""
    found = [Placed(solid, np.eye(3), np.zeros(3)) for solid in hand.fixed]
    frames = {"": (np.eye(3), np.zeros(3))}
    for part in hand.parts:
        rotation, position = frames[part.parent]
        position = position + rotation @ np.array(part.position_m)
        rotation = rotation @ part.rotation
        drive, axis = part.drive, np.array(part.drive.axis)
        if drive.rotary:
            rotation = rotation @ turned(axis, drive.open_q)
        else:
            position = position + rotation @ axis * drive.open_q
        frames[part.name] = (rotation, position)
        found += [Placed(solid, rotation, position) for solid in part.solids]
    return tuple(found)


def turned(axis: np.ndarray, angle_rad: float) -> np.ndarray:
    """Rotation (3, 3) about a unit axis (Rodrigues)."""
    x, y, z = axis
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle_rad) * k + (1.0 - np.cos(angle_rad)) * (k @ k))
