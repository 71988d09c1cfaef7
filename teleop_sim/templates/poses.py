"""Poses: a place and a rotation vector, composed, turned round and compared."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Triple = tuple[float, float, float]
Floats = npt.NDArray[np.float64]

LEAST_ANGLE_RAD = 1e-12
"""Below it a rotation is none: its axis would be rounding."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a frame is in another one.

    Attributes:
        position_m: of its origin [m].
        rotation_rad: rotation vector: unit axis times angle [rad].

    """

    position_m: Triple = (0.0, 0.0, 0.0)
    rotation_rad: Triple = (0.0, 0.0, 0.0)

    @property
    def matrix(self) -> Floats:
        """Rotation matrix (3, 3): its columns are the frame's axes."""
        return rotation(self.rotation_rad)

    def place(self, points_m: Floats) -> Floats:
        """Points (n, 3) or (3,) of the frame in the outer frame."""
        return np.asarray(points_m @ self.matrix.T + np.array(self.position_m))

    def after(self, inner: Pose) -> Pose:
        """The pose in the outer frame of what has the pose ``inner`` in this one."""
        return pose_of(self.place(np.array(inner.position_m)), self.matrix @ inner.matrix)

    def inverse(self) -> Pose:
        """The outer frame as seen from this one."""
        turned = self.matrix.T
        return pose_of(-turned @ np.array(self.position_m), turned)


def rotation(vector_rad: Sequence[float] | Floats) -> Floats:
    """Rotation matrix (3, 3) of a rotation vector (3,) [rad]. Source: Rodrigues' formula (1840)."""
    x, y, z = (float(v) for v in vector_rad)
    angle = math.sqrt(x * x + y * y + z * z)
    if angle < LEAST_ANGLE_RAD:
        return np.array([[1.0, -z, y], [z, 1.0, -x], [-y, x, 1.0]])
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) / angle
    return np.asarray(np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * (k @ k))


def rotation_vector(matrix: Floats) -> Triple:
    """Inverse of ``rotation``, with an angle of at most pi. Source: Shepperd, J. Guidance 1 (1978), 223-224."""
    m = np.asarray(matrix)
    trace = float(m[0, 0] + m[1, 1] + m[2, 2])
    squares = [1.0 + trace] + [1.0 - trace + 2.0 * float(m[i, i]) for i in range(3)]
    best = int(np.argmax(squares))
    skew = (float(m[2, 1] - m[1, 2]), float(m[0, 2] - m[2, 0]), float(m[1, 0] - m[0, 1]))
    if best == 0:
        w, axis = squares[0], list(skew)
    else:
        i = best - 1
        w = skew[i]
        axis = [float(m[i, j] + m[j, i]) for j in range(3)]
        axis[i] = squares[best]
    return _vector(w, axis)


def pose_of(position_m: Floats, matrix: Floats) -> Pose:
    """The pose with a position (3,) [m] and a rotation matrix (3, 3)."""
    x, y, z = (float(v) for v in position_m)
    return Pose((x, y, z), rotation_vector(matrix))


def from_quaternion(position_m: Triple, quat_xyzw: Sequence[float]) -> Pose:
    """The pose with a quaternion x, y, z, w of any length but zero."""
    x, y, z, w = (float(v) for v in quat_xyzw)
    return Pose(position_m, _vector(w, [x, y, z]))


def gap(a: Pose, b: Pose) -> tuple[float, float]:
    """How far two poses are apart: distance of the origins [m], angle between them [rad]."""
    turn = rotation_vector(a.matrix.T @ b.matrix)
    return math.dist(a.position_m, b.position_m), math.hypot(*turn)


def _vector(w: float, axis: list[float]) -> Triple:
    """Rotation vector of a quaternion of any length."""
    length = math.hypot(*axis)
    if length < LEAST_ANGLE_RAD * max(1.0, abs(w)):
        return (0.0, 0.0, 0.0)
    angle = 2.0 * math.atan2(length, abs(w))
    x, y, z = (v * math.copysign(angle, w) / length for v in axis)
    return (x, y, z)
