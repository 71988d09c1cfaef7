"""Small vector algebra for the compiled control law. Written out: linear-algebra libraries round
differently from one processor to the next.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from numba.extending import register_jitable


def compiled(function: Callable[..., Any]) -> Any:
    """The function compiled by numba, kept on disk where that can be: 0.3 s to load instead of 15 s to compile."""
    try:
        # numpy's division by zero: Python's check of every divisor costs more than the division.
        return njit(cache=True, error_model="numpy")(function)
    except RuntimeError:
        # An installation that may not be written and no home to write to: compile anew in every process.
        return njit(error_model="numpy")(function)


@register_jitable
def solve(A, b):
    """Gauss elimination with pivoting in place: b becomes the solution of A x = b. Tiny pivots are held at 1e-4."""
    n, m = A.shape[0], b.shape[1]
    for k in range(n):
        p = k
        for i in range(k + 1, n):
            if abs(A[i, k]) > abs(A[p, k]):
                p = i
        if p != k:
            for j in range(n):
                A[k, j], A[p, j] = A[p, j], A[k, j]
            for j in range(m):
                b[k, j], b[p, j] = b[p, j], b[k, j]
        if abs(A[k, k]) < 1e-4:
            A[k, k] = 1e-4 if A[k, k] >= 0 else -1e-4
        for i in range(k + 1, n):
            f = A[i, k] / A[k, k]
            for j in range(k + 1, n):
                A[i, j] -= f * A[k, j]
            for j in range(m):
                b[i, j] -= f * b[k, j]
    for j in range(m):
        for i in range(n - 1, -1, -1):
            s = b[i, j]
            for k in range(i + 1, n):
                s -= A[i, k] * b[k, j]
            b[i, j] = s / A[i, i]


@register_jitable
def clip(x, low, high):
    """x kept within [low, high]."""
    return low if x < low else (high if x > high else x)


@register_jitable
def cross(a, b):
    """a x b. Tuples cost no memory to ask for, as small arrays would."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@register_jitable
def dot(a, b):
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@register_jitable
def into(R, v):
    """R' v: a world vector in the frame R."""
    return (
        R[0, 0] * v[0] + R[1, 0] * v[1] + R[2, 0] * v[2],
        R[0, 1] * v[0] + R[1, 1] * v[1] + R[2, 1] * v[2],
        R[0, 2] * v[0] + R[1, 2] * v[1] + R[2, 2] * v[2],
    )


@register_jitable
def out_of(R, v):
    """R v: a vector of the frame R in the world."""
    return (
        R[0, 0] * v[0] + R[0, 1] * v[1] + R[0, 2] * v[2],
        R[1, 0] * v[0] + R[1, 1] * v[1] + R[1, 2] * v[2],
        R[2, 0] * v[0] + R[2, 1] * v[1] + R[2, 2] * v[2],
    )


@register_jitable
def tilt_error(R, c, s):
    """Small rotation vector (world) that takes R to a level frame with heading (cos, sin)."""
    # Half the sum of the cross products of both frames' axes.
    return (
        0.5 * (R[1, 2] - s * R[2, 0] - c * R[2, 1]),
        0.5 * (c * R[2, 0] - s * R[2, 1] - R[0, 2]),
        0.5 * (s * R[0, 0] - c * R[1, 0] + c * R[0, 1] + s * R[1, 1]),
    )


@register_jitable
def base_rotation(qpos):
    """Rotation matrix of the free root."""
    w, x, y, z = qpos[3], qpos[4], qpos[5], qpos[6]
    R = np.empty((3, 3))
    R[0, 0] = 1 - 2 * (y * y + z * z)
    R[0, 1] = 2 * (x * y - w * z)
    R[0, 2] = 2 * (x * z + w * y)
    R[1, 0] = 2 * (x * y + w * z)
    R[1, 1] = 1 - 2 * (x * x + z * z)
    R[1, 2] = 2 * (y * z - w * x)
    R[2, 0] = 2 * (x * z - w * y)
    R[2, 1] = 2 * (y * z + w * x)
    R[2, 2] = 1 - 2 * (x * x + y * y)
    return R


@compiled
def dcm_backwards(zmp, decay):
    """xi (n, 2) with xi[n - 1] = zmp[n - 1] and xi[k] = zmp[k] + (xi[k + 1] - zmp[k]) decay."""
    xi = zmp.copy()
    for k in range(len(zmp) - 2, -1, -1):
        xi[k] = zmp[k] + (xi[k + 1] - zmp[k]) * decay
    return xi


@compiled
def com_forwards(zmp, xi, start, decay, growth):
    """Centre of mass (n, 2) under a ZMP and its DCM: c[k + 1] = z + (c - z) decay + (xi - z) growth."""
    com = np.empty_like(zmp)
    com[0] = start
    for k in range(len(zmp) - 1):
        com[k + 1] = zmp[k] + (com[k] - zmp[k]) * decay + (xi[k] - zmp[k]) * growth
    return com
