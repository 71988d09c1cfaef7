"""A panel with a handle, as a door with its lever: laid as whoever compares template and cloud would lay it.

A fit of points to surfaces leaves a template where it explains the points; it does not mind that no point is where
the template has a lever, nor does it know where along a panel to be. So in turn: the face goes into the plane of the
points; the thing is slid along it, upright as such things stand, to points that stand off it; and of all places there
the one is taken where points and handle bear each other out, the points having the handle's surface near them and the
handle's surface, as far as it faces the sensor, having points near it. The panel's back cannot be seen from there: a
point behind the face is one of the face with an error, however thin the panel.

Not modelled: what hides the handle from the sensor, but its own back; panels that do not stand upright.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from types import ModuleType
from typing import Final

import numpy as np

from teleop_sim.operators.descent import (
    COARSE_POINTS,
    COARSE_ROUNDS,
    COARSE_SCALES_M,
    FINE_POINTS,
    FINE_ROUNDS,
    Floats,
    Prepared,
    Solid,
    cost_at,
    descend,
    evenly,
    loops,
)
from teleop_sim.templates.elements import Template
from teleop_sim.templates.poses import Pose, pose_of
from teleop_sim.templates.shapes import Box, Shape, bounds, signed

# Assumed, from trials on doors with 1 cm of noise.
SAMPLES: Final = 64  # of a handle's surface
ACROSS: Final = 9  # of the grid that they come from, each way
MARGIN_M: Final = 0.005  # of that grid around a solid
CLEAR: Final = 0.5  # of how far the handle stands off: nearer to the face its surface is not told from it
DEEPER_M: Final = 0.1  # behind a panel nothing is seen
PLACES: Final = 40  # along the face that are looked at
BESIDE_M: Final = 0.25  # of the start, farther off no place is looked at
STEPS_M: Final = (0.015, 0.005, 0.0015)  # of the last comparing, coarse to fine
STEPS: Final = np.array([(y, z) for y in (-2.0, -1.0, 0.0, 1.0, 2.0) for z in (-2.0, -1.0, 0.0, 1.0, 2.0)])


@dataclass(frozen=True, eq=False)
class Handle:
    """What stands off a panel, in the template's frame.

    Attributes:
        thing: the whole. seen: the same, as from before: the panel's back far away.
        points: (m, 3) of the handle's surface [m]. normals: (m, 3), outward.
        middle: (3,) of the handle.

    """

    thing: Solid
    seen: Solid
    points: Floats
    normals: Floats
    middle: Floats


def handle_of(template: Template) -> Handle | None:
    """What stands off a template's only face, which lies across its x axis; None: there is no such thing.

    Several faces hold a template in place without this.
    """
    faces = tuple(s for s in template.shapes if replace(template, shapes=(s,)).has_face)
    rest = tuple(s for s in template.shapes if s not in faces)
    face = faces[0] if len(faces) == 1 else None
    if not rest or not isinstance(face, Box) or face.turn != (0.0, 0.0, 0.0) or face.half[0] != min(face.half):
        return None
    return _handle(face, rest, template.middle_m, template.handle_m)


@lru_cache(maxsize=64)
def _handle(
    face: Box, rest: tuple[Shape, ...], middle_m: tuple[float, float, float], handle_m: tuple[float, float, float]
) -> Handle:
    whole, middle, handle = (face, *rest), np.array(middle_m), np.array(handle_m)
    thing, seen = (Solid(loops().packed(shapes), middle) for shapes in (whole, (_deep(face, handle), *rest)))
    found = []
    for shape in rest:
        low, high = bounds((shape,))
        grid = np.meshgrid(*np.linspace(low - MARGIN_M, high + MARGIN_M, ACROSS).T, indexing="ij")
        points = np.stack(grid, axis=-1).reshape(-1, 3)
        away, normal = signed((shape,), points)
        found.append(points - away[:, None] * normal)
    points = np.concatenate(found)
    points = points[signed(rest, points)[0] > -1e-9]
    clear = signed((face,), points)[0]
    points = points[evenly(np.flatnonzero(clear > CLEAR * clear.max()), SAMPLES)]
    return Handle(thing, seen, points, signed(rest, points + 1e-9)[1], handle)


def _deep(face: Box, handle: Floats) -> Box:
    """The panel with its back farther from the handle."""
    x, y, z = face.centre
    a, b, c = face.half
    return Box((x - math.copysign(DEEPER_M, float(handle[0]) - x), y, z), (a + DEEPER_M, b, c))


def laid_on_face(handle: Handle, cloud: Prepared, start: Pose, beside_m: float = BESIDE_M) -> Pose:
    """The face in the points' plane, upright, slid to where points stand off it and bear the handle out.

    Args:
        handle: of the template. cloud: with its points off the plane told.
        start: facing about the right way.
        beside_m: how far along the face from there places are looked at.

    """
    solid, few = _as_seen(handle, cloud), cloud.only(~cloud.off).thinned(COARSE_POINTS)
    pose = _parallel(handle, few.points, start)
    for scale_m in (*COARSE_SCALES_M, cloud.fine_m):
        pose = descend(solid, few, pose, scale_m, COARSE_ROUNDS)
    # Points of a face say little of where along it: the handle stays where it was put.
    pose = _upright(pose, handle.middle)
    back = pose.inverse().place(start.place(handle.middle)) - handle.middle
    pose = pose_of(_slid(pose, back[None, 1:])[0], pose.matrix)
    scale_m, some = COARSE_SCALES_M[-1], cloud.thinned(COARSE_POINTS // 2)
    matrix, slides = pose.matrix, _places(handle, cloud, pose, beside_m)
    shifts = _slid(pose, slides)
    costs = [cost_at(solid, some, matrix, at, scale_m) + _borne(handle, cloud, matrix, at, scale_m)[0] for at in shifts]
    return pose_of(shifts[int(np.argmin(costs))], matrix)


def _parallel(handle: Handle, points: Floats, pose: Pose) -> Pose:
    """Turned about the handle until its x axis is the normal of the plane through points (n, 3), and upright."""
    off = points - points.mean(axis=0)
    normal = np.linalg.eigh(off.T @ off)[1][:, 0]
    x = normal if normal @ pose.matrix[:, 0] > 0.0 else -normal
    return _turned(x, pose, handle.middle)


def settled(handle: Handle, cloud: Prepared, pose: Pose) -> Pose:
    """The best of a pose's surroundings: least squares of the whole, then along the face by the handle alone."""
    pose = descend(_as_seen(handle, cloud), cloud.even().thinned(FINE_POINTS), pose, cloud.fine_m, FINE_ROUNDS)
    if cloud.eye is None:
        return pose
    pose = _upright(pose, handle.middle)
    matrix = pose.matrix
    for step_m in STEPS_M:
        shifts = _slid(pose, step_m * STEPS)
        costs = [sum(_borne(handle, cloud, matrix, at, cloud.fine_m)[:2]) for at in shifts]
        pose = pose_of(shifts[int(np.argmin(costs))], matrix)
    return pose


def borne_share(handle: Handle, cloud: Prepared, pose: Pose) -> float:
    """The share of the handle's surface, as far as it faces the sensor, with a point that stands off near it."""
    return _borne(handle, cloud, pose.matrix, np.array(pose.position_m), cloud.fine_m)[2]


def _as_seen(handle: Handle, cloud: Prepared) -> Solid:
    return handle.thing if cloud.eye is None else handle.seen


def _places(handle: Handle, cloud: Prepared, pose: Pose, beside_m: float) -> Floats:
    """Slides (k, 2) along the face that bring the handle's middle before points off the plane; none first [m]."""
    local = (pose.inverse().place(cloud.points[cloud.off]) - handle.middle)[:, 1:]
    local = local[np.hypot(local[:, 0], local[:, 1]) < beside_m]
    return np.concatenate([np.zeros((1, 2)), local[evenly(np.arange(len(local)), PLACES)]])


def _borne(handle: Handle, cloud: Prepared, matrix: Floats, at: Floats, scale_m: float) -> tuple[float, float, float]:
    """The handle's surface by points off the plane, these by it, share of it borne out: ``borne_math.borne_out``."""
    eye = np.full(3, np.inf) if cloud.eye is None else cloud.eye
    off = cloud.points[cloud.off]
    found: tuple[float, float, float] = _loops().borne_out(handle.points, handle.normals, off, matrix, at, eye, scale_m)
    return found


def _loops() -> ModuleType:
    """Compiled, and loaded with the first panel."""
    from teleop_sim.operators import borne_math

    return borne_math


def _slid(pose: Pose, slides: Floats) -> Floats:
    """Positions (k, 3) of a pose slid along its y and z axes by (k, 2) [m]."""
    return np.asarray(np.array(pose.position_m) + slides @ pose.matrix[:, 1:].T)


def _upright(pose: Pose, pivot: Floats) -> Pose:
    """Turned about its x axis through a point (3,) until its z axis is as near the vertical as it can be."""
    return _turned(pose.matrix[:, 0], pose, pivot)


def _turned(x: Floats, pose: Pose, pivot: Floats) -> Pose:
    """Turned about a point (3,) until its x axis is a given one and its z axis as near the vertical as it can be."""
    y = np.cross((0.0, 0.0, 1.0), x)
    y /= max(float(np.linalg.norm(y)), 1e-9)
    matrix = np.stack([x, y, np.cross(x, y)], axis=1)
    return pose_of(pose.place(pivot) - matrix @ pivot, matrix)
