"""What the robot stands on: soil and walkway, in convex pieces that do not overlap.

A bend of the walkway is the union of two boxes. A sole on both would be carried twice, and each step would cost a third
more; so both are cut along the bend's line of symmetry, which leaves their union as it is.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import mujoco
import numpy as np

from teleop_sim.world.dish_layout import Layout, Slab

Point = tuple[float, float]
Polygon = tuple[Point, ...]

HALF_THICKNESS_M = 0.075
"""Of a tile: it lies 15 cm thick, its top at z = 0 (the published tile: 0.152 m)."""


def corners(slab: Slab) -> Polygon:
    """The four corners of a slab, anticlockwise."""
    x, y, yaw = slab.pose
    c, s = math.cos(yaw), math.sin(yaw)
    around = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ends = [(a * slab.half_along_m, b * slab.half_across_m) for a, b in around]
    return tuple((x + c * u - s * v, y + s * u + c * v) for u, v in ends)


def cut(polygon: Polygon, at: Point, normal: Point) -> Polygon:
    """The part of a convex polygon on the side of a line against which ``normal`` points.

    Source: Sutherland and Hodgman, Communications of the ACM 17 (1974), 32-42, one clipping plane.
    """

    def beyond_m(p: Point) -> float:
        return (p[0] - at[0]) * normal[0] + (p[1] - at[1]) * normal[1]

    kept: list[Point] = []
    for p, q in pairwise((*polygon, polygon[0])):
        before, after = beyond_m(p), beyond_m(q)
        if before <= 0.0:
            kept.append(p)
        if (before < 0.0 < after) or (after < 0.0 < before):
            u = before / (before - after)
            kept.append((p[0] + u * (q[0] - p[0]), p[1] + u * (q[1] - p[1])))
    return tuple(kept)


def pieces(layout: Layout) -> tuple[Slab | Polygon, ...]:
    """The walkway: whole slabs, and the two halves of each bend."""
    found: list[Slab | Polygon] = []
    slabs = list(layout.slabs)
    while slabs:
        first = slabs.pop(0)
        if slabs and first.bends_into(slabs[0]):
            found += _halves(first, slabs.pop(0))
        else:
            found.append(first)
    return tuple(found)


def _halves(a: Slab, b: Slab) -> tuple[Polygon, Polygon]:
    """Two overlapping slabs cut along the line of symmetry of their headings, through where their middles cross."""
    ha, hb = _heading(a), _heading(b)
    u, _ = np.linalg.solve(np.column_stack([ha, -hb]), np.array(b.pose[:2]) - np.array(a.pose[:2]))
    at = np.array(a.pose[:2]) + u * ha
    normal = ha + hb
    crossing, ahead = (float(at[0]), float(at[1])), (float(normal[0]), float(normal[1]))
    return cut(corners(a), crossing, ahead), cut(corners(b), crossing, (-ahead[0], -ahead[1]))


def _heading(slab: Slab) -> np.ndarray:
    return np.array([math.cos(slab.pose[2]), math.sin(slab.pose[2])])


def add_walkway(spec: mujoco.MjSpec, layout: Layout, look: dict[str, Any]) -> None:
    """Add the pieces as geoms ``walkway0`` and so on; ``look`` holds friction, collision and colour."""
    for number, piece in enumerate(pieces(layout)):
        name = f"walkway{number}"
        if isinstance(piece, Slab):
            x, y, yaw = piece.pose
            spec.worldbody.add_geom(
                name=name,
                type=mujoco.mjtGeom.mjGEOM_BOX,
                pos=[x, y, -HALF_THICKNESS_M],
                quat=[math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)],
                size=[piece.half_along_m, piece.half_across_m, HALF_THICKNESS_M],
                **look,
            )
        else:
            vertices = [(x, y, z) for x, y in piece for z in (-2 * HALF_THICKNESS_M, 0.0)]
            spec.add_mesh(name=name, uservert=[c for vertex in vertices for c in vertex])
            spec.worldbody.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, **look)
