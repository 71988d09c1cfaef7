"""Affordances and usabilities: how a thing can move, and which point of what a hand holds is meant to do it.

An affordance is a motion of a held thing: along a line, round an axis, or round an axis while going along it. It is
*grasp-agnostic*: it says nothing of where a hand holds the thing, and is carried out from wherever the hand (or the
tool in it) is. A usability is a frame fixed in a held thing, such as a drill's bit; it takes the hand's place.

Source of both ideas, and of the kinds: Romay et al., object templates of Team ViGIR (team-vigir/vigir_templates
@8fc2e9b): affordances ``cartesian`` and ``circular``, the latter with a ``pitch``; here linear, circular and screw.

Amounts are metres on a line, radians round an axis (anticlockwise seen against the axis). Positions are (3,) arrays [m]
in the frame in which the affordance stands, everywhere the odometry frame. Not modelled: motions of two joints at once,
handles that turn in the hand's grip about anything but the hand's own approach axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from teleop_sim.core.errors import BadInput, Problem

Kind = Literal["linear", "circular", "screw"]
Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Affordance:
    """One way in which a thing can move.

    Attributes:
        kind: ``linear``, ``circular`` or ``screw``.
        axis: unit vector along the line or the axis of turning.
        origin: a point on the axis [m]; a line needs none.
        pitch_m: of a screw: how far along the axis for one turn [m], right-handed if positive.
        extent: least and greatest amount from where the thing is now.
        keep_orientation: whether the hand keeps its orientation while the thing turns, as on a loose knob.

    Raises:
        BadInput: an axis that is no unit vector, a pitch without a screw or a screw without one, a reversed extent.

    """

    kind: Kind
    axis: Triple
    origin: Triple = (0.0, 0.0, 0.0)
    pitch_m: float = 0.0
    extent: tuple[float, float] = (-math.inf, math.inf)
    keep_orientation: bool = False

    def __post_init__(self) -> None:
        problems = []
        if abs(math.hypot(*self.axis) - 1.0) > 1e-6:
            problems.append(Problem("affordance.axis", f"{self.axis} is no unit vector", "divide it by its length"))
        if (self.kind == "screw") != (self.pitch_m != 0.0):
            hint = "a screw has a pitch, nothing else has"
            problems.append(Problem("affordance.pitch_m", f"{self.pitch_m} m for a {self.kind} one", hint))
        if not self.extent[0] <= 0.0 <= self.extent[1]:
            problems.append(Problem("affordance.extent", f"{self.extent} leaves out where the thing is", "span 0"))
        if problems:
            raise BadInput(tuple(problems))

    @property
    def unit(self) -> str:
        """What an amount is counted in."""
        return "m" if self.kind == "linear" else "rad"


@dataclass(frozen=True)
class Usability:
    """A frame of a held thing, in the hand's tool frame: the thing is taken to be fixed in the hand.

    Attributes:
        name: such as ``bit`` or ``switch``.
        position: of the frame's origin [m].
        pointing: unit vector that takes the place of the hand's approach axis.
        mass_kg: of the held thing, whose weight the wrist feels.

    """

    name: str
    position: Triple
    pointing: Triple = (0.0, 0.0, 1.0)
    mass_kg: float = 0.0

    def __post_init__(self) -> None:
        if abs(math.hypot(*self.pointing) - 1.0) > 1e-6:
            problem = Problem("usability.pointing", f"{self.pointing} is no unit vector", "divide it by its length")
            raise BadInput((problem,))


def moved(affordance: Affordance, amount: float, point: np.ndarray) -> np.ndarray:
    """Where a point (3,) of the thing goes when the thing has moved by an amount."""
    axis = np.array(affordance.axis)
    if affordance.kind == "linear":
        return np.asarray(point + amount * axis)
    origin = np.array(affordance.origin)
    return np.asarray(origin + rotated(axis, amount, point - origin) + _advance_m(affordance, amount) * axis)


def turned(affordance: Affordance, amount: float, direction: np.ndarray) -> np.ndarray:
    """The direction (3,) that a hand's approach axis takes when the thing has moved by an amount."""
    if affordance.kind == "linear" or affordance.keep_orientation:
        return direction
    return rotated(np.array(affordance.axis), amount, direction)


def rotated(axis: np.ndarray, angle_rad: float, vector: np.ndarray) -> np.ndarray:
    """A vector (3,) turned about a unit vector (3,). Source: Rodrigues' formula (1840)."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.asarray(c * vector + s * cross(axis, vector) + (1.0 - c) * float(axis @ vector) * axis)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Vector product of (3,) and (3,); numpy's own takes ten times as long for one."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def metres_per_unit(affordance: Affordance, point: np.ndarray) -> float:
    """How far a point of the thing goes for one unit of amount [m/m or m/rad]: a helix' arc length."""
    if affordance.kind == "linear":
        return 1.0
    return math.hypot(arm_m(affordance, point), affordance.pitch_m / (2 * math.pi))


def arm_m(affordance: Affordance, point: np.ndarray) -> float:
    """Distance of a point (3,) from the axis [m]."""
    away, axis = point - np.array(affordance.origin), np.array(affordance.axis)
    return float(np.linalg.norm(away - (away @ axis) * axis))


def course(affordance: Affordance, amount: float, point: np.ndarray) -> np.ndarray:
    """Unit vector (3,) along which a point of the thing, once moved by an amount, goes on as the amount grows."""
    axis = np.array(affordance.axis)
    if affordance.kind == "linear":
        return axis
    away = moved(affordance, amount, point) - np.array(affordance.origin)
    way = cross(axis, away) + affordance.pitch_m / (2 * math.pi) * axis
    return np.asarray(way / math.sqrt(way @ way))


def felt(affordance: Affordance, start: np.ndarray, now: np.ndarray, near: float) -> tuple[float, np.ndarray]:
    """Read an amount off a point of the thing that was at ``start`` and is now at ``now``, both (3,).

    Of the turns that fit, the one nearest the amount ``near``. Returns the amount and how far off its path the point
    is, (3,) [m]. A point on the axis of turning tells nothing: amount ``near``.
    """
    axis = np.array(affordance.axis)
    if affordance.kind == "linear":
        amount = float((now - start) @ axis)
    else:
        origin = np.array(affordance.origin)
        before, after = start - origin, now - origin
        sine, cosine = float(axis @ cross(before, after)), float(before @ after - (before @ axis) * (after @ axis))
        angle = math.atan2(sine, cosine) if math.hypot(sine, cosine) > 0.0 else near
        amount = near + math.remainder(angle - near, 2 * math.pi)
    return amount, now - moved(affordance, amount, start)


def strokes(affordance: Affordance, amount: float, reach: float) -> tuple[float, ...]:
    """Cut an amount into equal strokes no longer than ``reach``, between which the hand goes back and grips anew.

    Both in the affordance's own unit; ``reach`` is positive: what an ``Act`` that ended ``no_plan`` gave. Every stroke
    keeps the amount's sign and they add up to it; no amount needs none.

    Raises:
        BadInput: a reach of nothing, or an amount beyond the affordance's extent.

    """
    problems = []
    if not reach > 0.0:
        problems.append(Problem("strokes.reach", f"{reach} {affordance.unit}", "give more than 0"))
    if not within(affordance, amount):
        problems.append(Problem("strokes.amount", f"{amount} {affordance.unit}", f"stay in {affordance.extent}"))
    if problems:
        raise BadInput(tuple(problems))
    count = math.ceil(abs(amount) / reach - 1e-9)
    return (amount / count,) * count if count else ()


def within(affordance: Affordance, amount: float) -> bool:
    """Whether the thing can go that far."""
    return affordance.extent[0] <= amount <= affordance.extent[1]


def _advance_m(affordance: Affordance, amount: float) -> float:
    return affordance.pitch_m * amount / (2 * math.pi)
