"""Simple solids, and the signed distance of points to the surface of several together.

Distances are positive outside; normals point outwards. In the template's frame, metres. Inside of a union the distance
is the one to the nearest solid's surface, which may lie in another solid: exact outside, a bound inside.

Source of the distances: Hart, The Visual Computer 12 (1996), 527-545 (sphere tracing), appendix A.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from teleop_sim.templates.poses import Floats, Triple, rotation

_TINY = 1e-12


@dataclass(frozen=True, slots=True)
class Box:
    """A box: centre, half sizes, and how it is turned about its centre (rotation vector [rad])."""

    centre: Triple
    half: Triple
    turn: Triple = (0.0, 0.0, 0.0)

    def signed(self, points: Floats) -> tuple[Floats, Floats]:
        """Distance (n,) and outward normal (n, 3) of points (n, 3)."""
        turned = rotation(self.turn)
        local = (points - np.array(self.centre)) @ turned
        beyond = np.abs(local) - np.array(self.half)
        out = np.maximum(beyond, 0.0)
        far = np.sqrt(np.einsum("ij,ij->i", out, out))
        deepest = beyond.argmax(axis=1)
        inside = far < _TINY
        normal = out / np.maximum(far, _TINY)[:, None]
        normal[inside] = np.eye(3)[deepest[inside]]
        distance = far + np.minimum(beyond.max(axis=1), 0.0)
        return distance, (normal * np.where(local < 0.0, -1.0, 1.0)) @ turned.T


@dataclass(frozen=True, slots=True)
class Rod:
    """A straight rod with round ends: everything within ``radius_m`` of the line from ``start`` to ``end``."""

    start: Triple
    end: Triple
    radius_m: float

    def signed(self, points: Floats) -> tuple[Floats, Floats]:
        """Distance (n,) and outward normal (n, 3) of points (n, 3)."""
        along = np.array(self.end) - np.array(self.start)
        off = points - np.array(self.start)
        share = np.clip(off @ along / max(float(along @ along), _TINY), 0.0, 1.0)
        off = off - share[:, None] * along
        far = np.sqrt(np.einsum("ij,ij->i", off, off))
        return far - self.radius_m, off / np.maximum(far, _TINY)[:, None]


@dataclass(frozen=True, slots=True)
class Ring:
    """A torus: a tube of radius ``tube_m`` bent to a circle of radius ``radius_m`` about ``axis`` (unit)."""

    centre: Triple
    axis: Triple
    radius_m: float
    tube_m: float

    def signed(self, points: Floats) -> tuple[Floats, Floats]:
        """Distance (n,) and outward normal (n, 3) of points (n, 3)."""
        high, wide, outwards = _round(points, self.centre, self.axis)
        beside = wide - self.radius_m
        far = np.hypot(beside, high)
        normal = beside[:, None] * outwards + high[:, None] * np.array(self.axis)
        return far - self.tube_m, normal / np.maximum(far, _TINY)[:, None]


@dataclass(frozen=True, slots=True)
class Disc:
    """A cylinder about ``axis`` (unit), ``half_m`` to either side of its centre."""

    centre: Triple
    axis: Triple
    radius_m: float
    half_m: float

    def signed(self, points: Floats) -> tuple[Floats, Floats]:
        """Distance (n,) and outward normal (n, 3) of points (n, 3)."""
        high, wide, outwards = _round(points, self.centre, self.axis)
        beyond = np.stack([wide - self.radius_m, np.abs(high) - self.half_m], axis=1)
        out = np.maximum(beyond, 0.0)
        far = np.hypot(out[:, 0], out[:, 1])
        inside = far < _TINY
        flat = out / np.maximum(far, _TINY)[:, None]
        flat[inside] = np.eye(2)[beyond.argmax(axis=1)[inside]]
        upright = (flat[:, 1] * np.where(high < 0.0, -1.0, 1.0))[:, None] * np.array(self.axis)
        return far + np.minimum(beyond.max(axis=1), 0.0), flat[:, :1] * outwards + upright


Shape = Box | Rod | Ring | Disc


def signed(shapes: tuple[Shape, ...], points: Floats) -> tuple[Floats, Floats]:
    """Distance (n,) of points (n, 3) to the surface of all solids together, and the nearest one's normal (n, 3)."""
    distance, normal = shapes[0].signed(points)
    for shape in shapes[1:]:
        other, way = shape.signed(points)
        nearer = other < distance
        distance = np.where(nearer, other, distance)
        normal[nearer] = way[nearer]
    return distance, normal


def bounds(shapes: tuple[Shape, ...]) -> tuple[Floats, Floats]:
    """Least and greatest corner (3,) of a box around the solids."""
    corners = np.concatenate([_corners(shape) for shape in shapes])
    return corners.min(axis=0), corners.max(axis=0)


def _round(points: Floats, centre: Triple, axis: Triple) -> tuple[Floats, Floats, Floats]:
    """Height along an axis (n,), distance from it (n,) and unit vector away from it (n, 3)."""
    way = np.array(axis)
    off = points - np.array(centre)
    high = off @ way
    flat = off - high[:, None] * way
    wide = np.sqrt(np.einsum("ij,ij->i", flat, flat))
    return high, wide, flat / np.maximum(wide, _TINY)[:, None]


def _corners(shape: Shape) -> Floats:
    if isinstance(shape, Box):
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        return np.asarray((signs * np.array(shape.half)) @ rotation(shape.turn).T + np.array(shape.centre))
    if isinstance(shape, Rod):
        ends = np.array([shape.start, shape.end])
        return np.concatenate([ends - shape.radius_m, ends + shape.radius_m])
    way, centre = np.array(shape.axis), np.array(shape.centre)
    flat = np.sqrt(np.maximum(1.0 - way * way, 0.0))
    if isinstance(shape, Ring):
        reach = shape.radius_m * flat + shape.tube_m
    else:
        reach = shape.radius_m * flat + shape.half_m * np.abs(way)
    return np.array([centre - reach, centre + reach])
