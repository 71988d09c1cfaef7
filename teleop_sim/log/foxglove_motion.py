"""The robot's motion as ``foxglove.FrameTransforms``: many samples at once, by filling a template with numpy.

A message holds one transform for each frame that can move, always the same ones, so that all messages of a run have
the same bytes but for times and numbers. Numbers are rounded to 2^-20 (1e-6 m, or of a quaternion's component), which
leaves zeros for the compressor: it halves what motion adds to a log, and moves no link by 4e-5 m (a test).

Times are written as varints of five bytes whatever their value, which every reader must take.

Source: protobuf.dev, *Encoding*; schema ``foxglove.FrameTransforms``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from teleop_sim.core.records import PlantSample
from teleop_sim.core.views import Frame, SceneTree
from teleop_sim.log.wire import double, nested, text

GRID = 2.0**20
"""Steps a metre."""

_PELVIS = 7
_VARINT_BYTES = 5
_STAMP_BYTES = 2 + 2 * _VARINT_BYTES
_NOTHING = 1e-12
"""Smaller factors are rounding of the model's own numbers."""


class Motion:
    """Encodes samples of one scene; made by ``motion_of``.

    Args:
        tree: the scene. A frame whose joint it does not list stays out.

    Attributes:
        joints: how many a sample has.

    """

    def __init__(self, tree: SceneTree) -> None:
        self.joints = len(tree.joints)
        columns = {name: k for k, name in enumerate(tree.joints)}
        self._roots = [f for f in tree.frames if f.kind == "free"][:1]
        frames = [f for f in tree.frames if f.joint in columns]
        self._columns = np.array([_PELVIS + columns[f.joint] for f in frames], int)
        self._zeros = np.array([f.zero for f in frames])
        turns, moves = _turns(frames), _moves(frames)
        turning, moving = _follow(turns, (1, 2)), _follow(moves, (1, 2, 3))
        template = _Template()
        for root in self._roots:
            template.add(root, (None,) * 3, (None,) * 4)
        for k, frame in enumerate(frames):
            template.add(frame, _numbers(moves[0, k], moving[k]), _numbers(turns[0, k], turning[k]))
        self._bytes, self._fields = template.done()
        names = self._fields.names or ()
        self._times = [name for name in names if name[0] == "t"]
        self._numbers = [name for name in names if name[0] == "v"]
        # In the order of the template: a frame's translation, then its rotation.
        which = np.concatenate([moving, turning], axis=1)
        self._frame, component = np.nonzero(which)
        self._is_turn = component >= moving.shape[1]
        self._turning, self._moving = self._frame[self._is_turn], self._frame[~self._is_turn]
        self._turn = turns[:, self._turning, component[self._is_turn] - moving.shape[1]]
        self._move = moves[:, self._moving, component[~self._is_turn]]

    def fits(self, sample: PlantSample) -> bool:
        """Whether a sample is of this scene."""
        return len(sample.joints) == self.joints and len(sample.pelvis) == _PELVIS

    def encode(self, times_ns: Sequence[int], samples: np.ndarray) -> list[memoryview]:
        """One message a sample.

        Args:
            times_ns: (n,) simulated times. samples: (n, 7 + k): pelvis, then joints, as in ``PlantSample``.
        """
        filled = np.empty((len(times_ns), len(self._bytes)), np.uint8)
        filled[:] = self._bytes
        rows: Any = filled.view(self._fields)[:, 0]
        stamps = _stamps(np.asarray(times_ns, np.int64))
        for name in self._times:
            rows[name] = stamps
        for name, numbers in zip(self._numbers, self._values(samples), strict=True):
            rows[name] = numbers
        size, whole = len(self._bytes), filled.data.cast("B")
        return [whole[at : at + size] for at in range(0, len(whole), size)]

    def _values(self, samples: np.ndarray) -> np.ndarray:
        """Numbers of the template by row, (m, n)."""
        columns = samples.T
        values = np.empty((_PELVIS * len(self._roots) + len(self._frame), len(samples)))
        if self._roots:
            # x, y, z of the place; the schema has a quaternion's w last.
            values[:_PELVIS] = columns[[0, 1, 2, 4, 5, 6, 3]]
        rest = values[_PELVIS * len(self._roots) :]
        angles = columns[self._columns] - self._zeros[:, None]
        half = 0.5 * angles
        _, cosine, sine = self._turn[..., None]
        turned = cosine * np.cos(half)[self._turning]
        turned += sine * np.sin(half)[self._turning]
        if len(self._moving) == 0:
            rest[:] = turned
        else:
            rest[self._is_turn] = turned
            a = angles[self._moving]
            constant, cosine, sine, slope = self._move[..., None]
            rest[~self._is_turn] = constant + cosine * np.cos(a) + sine * np.sin(a) + slope * a
        values *= GRID
        np.rint(values, out=values)
        values /= GRID
        return values


@lru_cache(maxsize=2)
def motion_of(tree: SceneTree) -> Motion:
    """The encoder of a scene; runs of a sweep that share the scene share it."""
    return Motion(tree)


class _Template:
    """A message under construction: its constant bytes, and where times and numbers go."""

    def __init__(self) -> None:
        self._data = bytearray()
        self._times: list[int] = []
        self._places: list[int] = []

    def add(self, frame: Frame, translation: Sequence[float | None], rotation: Sequence[float | None]) -> None:
        """Add a transform. Components that are None are filled in later; rotation: x, y, z, w."""
        parts = [nested(1, bytes(_STAMP_BYTES)), text(2, frame.parent), text(3, frame.name)]
        places: list[int] = []
        for number, vector in ((4, translation), (5, rotation)):
            inner, inside = _doubles(vector)
            parts.append(nested(number, inner))
            at = sum(map(len, parts)) - len(inner)
            places += [at + place for place in inside]
        body = b"".join(parts)
        head = nested(1, body)[: -len(body)]
        start = len(self._data) + len(head)
        self._times.append(start + 2)
        self._places += [start + place for place in places]
        self._data += head + body

    def done(self) -> tuple[np.ndarray, np.dtype[Any]]:
        """The bytes (size,), and a structured type that reaches times (``t0`` ...) and numbers (``v0`` ...)."""
        names = [f"t{k}" for k in range(len(self._times))] + [f"v{k}" for k in range(len(self._places))]
        formats = [f"V{_STAMP_BYTES}"] * len(self._times) + ["<f8"] * len(self._places)
        offsets = [*self._times, *self._places]
        layout: Any = {"names": names, "formats": formats, "offsets": offsets, "itemsize": len(self._data)}
        return np.frombuffer(bytes(self._data), np.uint8), np.dtype(layout)


def _turns(frames: Sequence[Frame]) -> np.ndarray:
    """Rotations x, y, z, w (j, 4) as ``rest`` of what does not turn, factors of cos(a/2) and of sin(a/2): (3, j, 4)."""
    made = np.zeros((3, len(frames), 4))
    for k, frame in enumerate(frames):
        w, x, y, z = frame.rotation
        if frame.kind == "hinge":
            a, b, c = frame.axis
            made[1, k] = x, y, z, w
            # The frame's rotation times the axis as a quaternion.
            made[2, k] = (
                w * a + y * c - z * b,
                w * b + z * a - x * c,
                w * c + x * b - y * a,
                -x * a - y * b - z * c,
            )
        else:
            made[0, k] = x, y, z, w
    return np.where(np.abs(made) < _NOTHING, 0.0, made)


def _moves(frames: Sequence[Frame]) -> np.ndarray:
    """Translations (j, 3) as rest, factors of cos(a), of sin(a), and of a: (4, j, 3)."""
    made = np.zeros((4, len(frames), 3))
    for k, frame in enumerate(frames):
        turn = _matrix(frame.rotation)
        axis, anchor = np.array(frame.axis), np.array(frame.anchor_m)
        made[0, k] = frame.position_m
        if frame.kind == "hinge" and any(frame.anchor_m):
            # An anchor p stays where it is: p - R(a) p, after Rodrigues.
            across = turn @ (anchor - axis * (axis @ anchor))
            made[0, k] += across
            made[1, k] = -across
            made[2, k] = -turn @ np.cross(axis, anchor)
        elif frame.kind == "slide":
            made[3, k] = turn @ axis
    return np.where(np.abs(made) < _NOTHING, 0.0, made)


def _follow(factors: np.ndarray, which: tuple[int, ...]) -> np.ndarray:
    """Which components follow the joint, (j, c)."""
    follows: np.ndarray = np.any(factors[list(which)] != 0.0, axis=0)
    return follows


def _numbers(rest: np.ndarray, follows: np.ndarray) -> list[float | None]:
    return [None if moves else float(value) for value, moves in zip(rest, follows, strict=True)]


def _matrix(rotation: tuple[float, float, float, float]) -> np.ndarray:
    w, x, y, z = rotation
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _stamps(times_ns: np.ndarray) -> np.ndarray:
    """Times as ``google.protobuf.Timestamp``, (n,) of ``_STAMP_BYTES`` bytes each."""
    made = np.empty((len(times_ns), _STAMP_BYTES), np.uint8)
    for at, tag, values in ((0, 0x08, times_ns // 10**9), (1 + _VARINT_BYTES, 0x10, times_ns % 10**9)):
        made[:, at] = tag
        for k in range(_VARINT_BYTES):
            more = 0x80 if k < _VARINT_BYTES - 1 else 0
            made[:, at + 1 + k] = (values >> (7 * k) & 0x7F) | more
    stamps: np.ndarray = made.view(f"V{_STAMP_BYTES}")[:, 0]
    return stamps


def _doubles(vector: Sequence[float | None]) -> tuple[bytes, list[int]]:
    """A message of doubles numbered from 1, and where those begin that are to be filled in. Zeros are not stored."""
    body, places = b"", []
    for number, value in enumerate(vector, start=1):
        if value is None:
            places.append(len(body) + 1)
        body += double(number, math.nan if value is None else value)
    return body, places
