"""The inner loops of a fit, compiled: distances of points to solids, normal equations, votes for planes.

Written out point by point, so that sums come in the order of the points on every processor, and no solid is looked at
whose ball is farther away than another solid's surface. The formulas of distances are those of ``templates/shapes.py``
(Hart 1996); a test compares the two.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit

from teleop_sim.templates.poses import rotation
from teleop_sim.templates.shapes import Box, Disc, Ring, Rod, Shape, bounds

Floats = npt.NDArray[np.float64]

_BOX, _ROD, _RING, _DISC = 0, 1, 2, 3
_TINY = 1e-12


def compiled(function: Callable[..., Any]) -> Any:
    """The function compiled by numba, kept on disk where that can be."""
    try:
        return njit(cache=True, error_model="numpy")(function)
    except RuntimeError:
        # An installation that may not be written and no home to write to: compile anew in every process.
        return njit(error_model="numpy")(function)


@lru_cache(maxsize=64)
def packed(shapes: tuple[Shape, ...]) -> Floats:
    """Solids (k, 22) as the loops want them: kind, centre, three numbers, two radii, rotation (9), their ball (4)."""
    return np.array([_row(shape) for shape in shapes])


def _row(shape: Shape) -> list[float]:
    low, high = bounds((shape,))
    middle = 0.5 * (low + high)
    # The ball must hold the solid in spite of rounding.
    ball = float(np.linalg.norm(high - middle)) + 1e-9
    turned, radii = np.eye(3), (0.0, 0.0)
    match shape:
        case Box(centre=at, half=numbers, turn=turn):
            kind, turned = _BOX, rotation(turn)
        case Rod(start=at, end=end, radius_m=radius):
            along = np.array(end) - np.array(at)
            kind, numbers, radii = _ROD, (float(along[0]), float(along[1]), float(along[2])), (radius, 0.0)
        case Ring(centre=at, axis=numbers, radius_m=radius, tube_m=tube):
            kind, radii = _RING, (radius, tube)
        case Disc(centre=at, axis=numbers, radius_m=radius, half_m=half):
            kind, radii = _DISC, (radius, half)
    return [float(kind), *at, *numbers, *radii, *turned.ravel().tolist(), *middle.tolist(), ball]


@compiled
def _to_box(s: Floats, x: float, y: float, z: float) -> tuple[float, float, float, float]:
    x, y, z = x - s[1], y - s[2], z - s[3]
    a = x * s[9] + y * s[12] + z * s[15]
    b = x * s[10] + y * s[13] + z * s[16]
    c = x * s[11] + y * s[14] + z * s[17]
    u, v, w = abs(a) - s[4], abs(b) - s[5], abs(c) - s[6]
    most = max(u, v, w)
    p, q, r = max(u, 0.0), max(v, 0.0), max(w, 0.0)
    far = math.sqrt(p * p + q * q + r * r)
    if far < _TINY:
        p, q, r = 0.0, 0.0, 0.0
        if u >= v and u >= w:
            p = 1.0
        elif v >= w:
            q = 1.0
        else:
            r = 1.0
    else:
        p, q, r = p / far, q / far, r / far
    p, q, r = -p if a < 0.0 else p, -q if b < 0.0 else q, -r if c < 0.0 else r
    return (
        far + min(most, 0.0),
        p * s[9] + q * s[10] + r * s[11],
        p * s[12] + q * s[13] + r * s[14],
        p * s[15] + q * s[16] + r * s[17],
    )


@compiled
def _to_rod(s: Floats, x: float, y: float, z: float) -> tuple[float, float, float, float]:
    x, y, z = x - s[1], y - s[2], z - s[3]
    share = (x * s[4] + y * s[5] + z * s[6]) / max(s[4] * s[4] + s[5] * s[5] + s[6] * s[6], _TINY)
    share = min(max(share, 0.0), 1.0)
    x, y, z = x - share * s[4], y - share * s[5], z - share * s[6]
    far = math.sqrt(x * x + y * y + z * z)
    over = max(far, _TINY)
    return far - s[7], x / over, y / over, z / over


@compiled
def _to_round(s: Floats, x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """A ring or a disc."""
    x, y, z = x - s[1], y - s[2], z - s[3]
    high = x * s[4] + y * s[5] + z * s[6]
    x, y, z = x - high * s[4], y - high * s[5], z - high * s[6]
    wide = math.sqrt(x * x + y * y + z * z)
    over = max(wide, _TINY)
    x, y, z = x / over, y / over, z / over
    beside, up = wide - s[7], high
    if s[0] == _RING:
        far = math.hypot(beside, high)
        distance, over = far - s[8], max(far, _TINY)
        beside, up = beside / over, up / over
    else:
        above = abs(high) - s[8]
        p, q = max(beside, 0.0), max(above, 0.0)
        far = math.hypot(p, q)
        distance = far + min(max(beside, above), 0.0)
        if far < _TINY:
            p, q = (1.0, 0.0) if beside >= above else (0.0, 1.0)
        else:
            p, q = p / far, q / far
        beside, up = p, -q if high < 0.0 else q
    return distance, beside * x + up * s[4], beside * y + up * s[5], beside * z + up * s[6]


@compiled
def _nearest(solids: Floats, x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """Distance of a point to all solids together, and the nearest one's normal."""
    best, nx, ny, nz = math.inf, 0.0, 0.0, 0.0
    for k in range(len(solids)):
        s = solids[k]
        reach = best + s[21]
        apart = (x - s[18]) ** 2 + (y - s[19]) ** 2 + (z - s[20]) ** 2
        if reach <= 0.0 or apart >= reach * reach:
            continue
        if s[0] == _BOX:
            d, a, b, c = _to_box(s, x, y, z)
        elif s[0] == _ROD:
            d, a, b, c = _to_rod(s, x, y, z)
        else:
            d, a, b, c = _to_round(s, x, y, z)
        if d < best:
            best, nx, ny, nz = d, a, b, c
    return best, nx, ny, nz


@compiled
def distances(solids: Floats, points: Floats, matrix: Floats, pivot: Floats, middle: Floats) -> Floats:
    """Signed distance (n,) of points (n, 3) to solids that are turned about ``middle``, which lies at ``pivot``."""
    found = np.empty(len(points))
    for i in range(len(points)):
        x, y, z = points[i, 0] - pivot[0], points[i, 1] - pivot[1], points[i, 2] - pivot[2]
        a = x * matrix[0, 0] + y * matrix[1, 0] + z * matrix[2, 0] + middle[0]
        b = x * matrix[0, 1] + y * matrix[1, 1] + z * matrix[2, 1] + middle[1]
        c = x * matrix[0, 2] + y * matrix[1, 2] + z * matrix[2, 2] + middle[2]
        found[i] = _nearest(solids, a, b, c)[0]
    return found


@compiled
def equations(
    solids: Floats, points: Floats, weights: Floats, matrix: Floats, pivot: Floats, middle: Floats, scale: float
) -> tuple[Floats, Floats]:
    """Normal equations (6, 6) and right side (6,) of a Gauss-Newton step: a turn about the pivot, then a shift.

    Weights (n,) times those of Geman and McClure at a scale.
    """
    square, right, slope = np.zeros((6, 6)), np.zeros(6), np.empty(6)
    for i in range(len(points)):
        x, y, z = points[i, 0] - pivot[0], points[i, 1] - pivot[1], points[i, 2] - pivot[2]
        a = x * matrix[0, 0] + y * matrix[1, 0] + z * matrix[2, 0] + middle[0]
        b = x * matrix[0, 1] + y * matrix[1, 1] + z * matrix[2, 1] + middle[1]
        c = x * matrix[0, 2] + y * matrix[1, 2] + z * matrix[2, 2] + middle[2]
        error, na, nb, nc = _nearest(solids, a, b, c)
        nx = matrix[0, 0] * na + matrix[0, 1] * nb + matrix[0, 2] * nc
        ny = matrix[1, 0] * na + matrix[1, 1] * nb + matrix[1, 2] * nc
        nz = matrix[2, 0] * na + matrix[2, 1] * nb + matrix[2, 2] * nc
        slope[0], slope[1], slope[2] = z * ny - y * nz, x * nz - z * nx, y * nx - x * ny
        slope[3], slope[4], slope[5] = -nx, -ny, -nz
        far = error / scale
        weight = weights[i] / (1.0 + far * far) ** 2
        for j in range(6):
            pull = weight * slope[j]
            right[j] += pull * error
            for k in range(j + 1):
                square[j, k] += pull * slope[k]
    for j in range(6):
        for k in range(j):
            square[k, j] = square[j, k]
    return square, right


@compiled
def solved(square: Floats, right: Floats) -> Floats:
    """The solution (n,) of square x = right, for a symmetric positive definite square (n, n), which is used up.

    Source: Cholesky's decomposition; Golub and Van Loan, Matrix Computations, 4.2.
    """
    n, x = len(right), right.copy()
    for j in range(n):
        for k in range(j):
            square[j, j] -= square[j, k] * square[j, k]
        square[j, j] = math.sqrt(square[j, j])
        for i in range(j + 1, n):
            for k in range(j):
                square[i, j] -= square[i, k] * square[j, k]
            square[i, j] /= square[j, j]
    for i in range(n):
        for k in range(i):
            x[i] -= square[i, k] * x[k]
        x[i] /= square[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= square[k, i] * x[k]
        x[i] /= square[i, i]
    return x


@compiled
def turned(turn: Floats, matrix: Floats) -> Floats:
    """A matrix (3, 3) turned by a rotation vector (3,): Rodrigues' formula, column by column."""
    angle = math.sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2])
    if angle < _TINY:
        return matrix.copy()
    x, y, z = turn[0] / angle, turn[1] / angle, turn[2] / angle
    c, s = math.cos(angle), math.sin(angle)
    found = np.empty((3, 3))
    for j in range(3):
        u, v, w = matrix[0, j], matrix[1, j], matrix[2, j]
        along = (1.0 - c) * (x * u + y * v + z * w)
        found[0, j] = c * u + s * (y * w - z * v) + along * x
        found[1, j] = c * v + s * (z * u - x * w) + along * y
        found[2, j] = c * w + s * (x * v - y * u) + along * z
    return found


@compiled
def descend(
    solids: Floats,
    points: Floats,
    weights: Floats,
    matrix: Floats,
    pivot: Floats,
    middle: Floats,
    scale: float,
    rounds: int,
    done: float,
    longest: float,
    damping: float,
    stiffness: float,
) -> tuple[Floats, Floats]:
    """Gauss-Newton rounds at one scale until a step is below ``done``; none is above ``longest`` [m, rad].

    ``damping`` is a share of the diagonal, ``stiffness`` is added to it. Returns matrix and pivot.
    """
    for _ in range(rounds):
        square, right = equations(solids, points, weights, matrix, pivot, middle, scale)
        for j in range(6):
            square[j, j] += damping * square[j, j] + stiffness
        step, most = solved(square, right), 0.0
        for j in range(6):
            step[j] = min(max(-step[j], -longest), longest)
            most = max(most, abs(step[j]))
        matrix, pivot = turned(step[:3], matrix), pivot + step[3:]
        if most < done:
            break
    return matrix, pivot


@compiled
def votes(points: Floats, normals: Floats, offsets: Floats, threshold: float) -> npt.NDArray[np.int64]:
    """How many points (n, 3) lie within a threshold of each plane: unit normals (m, 3), offsets (m,)."""
    found = np.zeros(len(normals), dtype=np.int64)
    for j in range(len(normals)):
        a, b, c, d = normals[j, 0], normals[j, 1], normals[j, 2], offsets[j]
        count = 0
        for i in range(len(points)):
            if abs(points[i, 0] * a + points[i, 1] * b + points[i, 2] * c - d) < threshold:
                count += 1
        found[j] = count
    return found
