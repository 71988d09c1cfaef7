"""Compiled: do points and the surface of a handle bear each other out? Written out as in ``fit_math.py``."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from teleop_sim.operators.fit_math import compiled

Floats = npt.NDArray[np.float64]


@compiled
def _far(square: float) -> float:
    """Geman and McClure's function of a square; 1 at infinity."""
    return 1.0 - 1.0 / (1.0 + square)


@compiled
def borne_out(
    samples: Floats, normals: Floats, points: Floats, matrix: Floats, shift: Floats, eye: Floats, scale: float
) -> tuple[float, float, float]:
    """How badly points (n, 3) and a surface, given by samples and outward normals (m, 3), bear each other out.

    Of the samples only those count that face the eye at this pose; all, if it is not finite. Two means of Geman and
    McClure's function, 0 (all is there) to 1 (nothing is): of the samples' distances to the nearest point, and of the
    points' to the nearest sample. And the share of the samples with a point within ``scale``.
    """
    blind, least = not math.isfinite(eye[0]), np.full(len(points), math.inf)
    total, near, seen = 0.0, 0, 0
    for i in range(len(samples)):
        a, b, c = samples[i, 0], samples[i, 1], samples[i, 2]
        x = matrix[0, 0] * a + matrix[0, 1] * b + matrix[0, 2] * c + shift[0]
        y = matrix[1, 0] * a + matrix[1, 1] * b + matrix[1, 2] * c + shift[1]
        z = matrix[2, 0] * a + matrix[2, 1] * b + matrix[2, 2] * c + shift[2]
        a, b, c = normals[i, 0], normals[i, 1], normals[i, 2]
        if not blind:
            u = (matrix[0, 0] * a + matrix[0, 1] * b + matrix[0, 2] * c) * (eye[0] - x)
            v = (matrix[1, 0] * a + matrix[1, 1] * b + matrix[1, 2] * c) * (eye[1] - y)
            w = (matrix[2, 0] * a + matrix[2, 1] * b + matrix[2, 2] * c) * (eye[2] - z)
            if u + v + w <= 0.0:
                continue
        best = math.inf
        for k in range(len(points)):
            apart = (points[k, 0] - x) ** 2 + (points[k, 1] - y) ** 2 + (points[k, 2] - z) ** 2
            best, least[k] = min(best, apart), min(least[k], apart)
        seen += 1
        total += _far(best / (scale * scale))
        if best <= scale * scale:
            near += 1
    back = 0.0
    for k in range(len(points)):
        back += _far(least[k] / (scale * scale))
    if not seen or not len(points):
        return 1.0, 1.0, 0.0
    return total / seen, back / len(points), near / seen
