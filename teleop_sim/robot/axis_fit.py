"""Where an axis truly is, learned from the way on which the thing that turns about it has led the hand.

A believed axis is off by centimetres; a hand that is led round it stays at one distance from the true one. The place is
estimated by Gauss-Newton least squares with what was believed as prior: f_i(c) = |p_i - c| less their mean, in the
plane across the axis. Its direction is taken as believed: a loose grip tells little about it. The first centimetres
do not count: a handle that was taken askew finds its seat in the hand.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from teleop_sim.robot.affordance import Affordance, course, felt, moved

PRIOR_M = 0.02
"""How far a believed axis is off (assumed: what perception leaves over)."""
NOISE_M = 0.003
"""How far a held handle plays in the hand: 2 mm in a closed cage, and what it gives way (assumed)."""
SPACING_M = 0.01
"""Between two places that are remembered: nearer ones say the same."""
SEAT_M = 0.03
"""Way of the tool after which the handle has found its seat (assumed: as far as an open cage can be off)."""
STEPS = 4
"""Of Gauss-Newton, each time a place is added: it begins where it was the last time."""


@dataclass(frozen=True)
class AxisFit:
    """What is known of an axis.

    Attributes:
        believed: the affordance as told.
        now: the affordance with its origin as learned.
        start: (3,) where the tool was when the thing began to move [m].
        seat, seat_amount: the first place that counts, and the amount there as it was believed.
        places: (n, 3) where the tool was since [m].

    """

    believed: Affordance
    now: Affordance
    start: np.ndarray
    seat: np.ndarray
    seat_amount: float
    places: np.ndarray

    def seen(self, place: np.ndarray, amount: float) -> AxisFit:
        """Take in where the tool is (3,), at which amount; the same if it has hardly moved, or goes along a line."""
        if self.believed.kind == "linear":
            return self
        if not len(self.places):
            seated = float(np.linalg.norm(place - self.start)) >= SEAT_M
            return replace(self, seat=place, seat_amount=amount, places=place[None, :]) if seated else self
        if float(np.linalg.norm(place - self.places[-1])) < SPACING_M:
            return self
        places = np.vstack([self.places, place])
        origin = _fit(self.believed, np.array(self.now.origin), places)
        at = (float(origin[0]), float(origin[1]), float(origin[2]))
        return replace(self, now=replace(self.now, origin=at), places=places)

    def felt(self, place: np.ndarray, near: float) -> tuple[float, np.ndarray]:
        """The amount at which the tool is, and how far it is off the learned path (3,) [m]; see ``affordance.felt``."""
        amount, off = felt(self.now, self.seat, place, near - self.seat_amount)
        return amount + self.seat_amount, off

    def at(self, amount: float) -> np.ndarray:
        """Where the learned path takes the tool (3,) [m]."""
        return moved(self.now, amount - self.seat_amount, self.seat)

    def course(self, amount: float) -> np.ndarray:
        """Unit vector (3,) along the learned path."""
        return course(self.now, amount - self.seat_amount, self.seat)


def axis_fit(affordance: Affordance, start: np.ndarray) -> AxisFit:
    """Nothing learned yet; the tool is at ``start`` (3,)."""
    return AxisFit(affordance, affordance, start, start, 0.0, np.empty((0, 3)))


def _fit(believed: Affordance, origin: np.ndarray, places: np.ndarray) -> np.ndarray:
    """The origin (3,), moved across the axis to where the places are best on one circle about it."""
    plane = _across(np.array(believed.axis))
    flat, prior = places @ plane.T, plane @ np.array(believed.origin)
    centre = plane @ origin
    for _ in range(STEPS):
        away = flat - centre
        length = np.maximum(np.linalg.norm(away, axis=1), 1e-9)
        units = away / length[:, None]
        slope, error = units.mean(axis=0) - units, length - length.mean()
        normal = slope.T @ slope / NOISE_M**2 + np.eye(2) / PRIOR_M**2
        right = slope.T @ error / NOISE_M**2 + (centre - prior) / PRIOR_M**2
        centre = centre - np.linalg.solve(normal, right)
    return np.asarray(np.array(believed.origin) + plane.T @ (centre - prior))


def _across(axis: np.ndarray) -> np.ndarray:
    """Two unit vectors (2, 3) across an axis."""
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    first = np.cross(axis, helper)
    first = first / np.linalg.norm(first)
    return np.array([first, np.cross(axis, first)])
