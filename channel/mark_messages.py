"""What a robot claims to see in a picture that it has sent: marks to be laid over it."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import ClassVar, Self

from teleop_sim.channel.codec import BadMessage
from teleop_sim.channel.message import Message, body_of, index_of, message

MARK_NAMES: tuple[str, ...] = ("yaw_wheel", "pitch_wheel", "yaw_handle", "pitch_handle")
_MARKS_HEAD, _MARK = struct.Struct(">HI"), struct.Struct(">BhhHH")
MARK_STEP_PX = 0.125
"""Resolution of a mark: an eighth of a pixel, finer than anybody sees (assumed)."""


@dataclass(frozen=True)
class PixelMark:
    """Where a picture should show something, if the robot is right: its middle and its half sizes [px].

    Attributes:
        what: one of ``MARK_NAMES``.
        across, down: from the picture's upper left corner; may lie outside.
        half_width, half_height: of the upright box around it.

    """

    what: str
    across: float
    down: float
    half_width: float
    half_height: float

    def codes(self) -> tuple[int, ...]:
        """As sent: the name's number, then whole steps."""
        places = (self.across, self.down, self.half_width, self.half_height)
        if not all(math.isfinite(v) for v in places):
            raise BadMessage(Marks.topic, f"a mark at {places}", "Give finite pixels.")
        return (index_of(self.what, MARK_NAMES, Marks.topic), *(round(v / MARK_STEP_PX) for v in places))


@message("down", "marks", b"\x94")
class Marks(Message):
    """What the robot claims to see in a picture that it has sent, as marks to be laid over it.

    Attributes:
        edge: of the machine's table, which tells of the sighting.
        picture: CRC-32 of the coded picture: which one it is, even if others were lost.
        places: the marks, sent to an eighth of a pixel.

    """

    layout: ClassVar = "type, edge (2), CRC-32 of the picture (4), per mark: name, middle (4), half sizes (4)"
    resolution: ClassVar = "1/8 px up to ±4095 px"

    edge: int
    picture: int
    places: tuple[PixelMark, ...]

    @classmethod
    def example(cls) -> Self:
        """Both wheels and both handles."""
        return cls(40, 0xDEADBEEF, tuple(PixelMark(what, 100.0, 80.0, 30.0, 28.5) for what in MARK_NAMES))

    def encode(self) -> bytes:
        """Type, edge, picture, marks."""
        try:
            head = _MARKS_HEAD.pack(self.edge, self.picture)
            return self.marks + head + b"".join(_MARK.pack(*mark.codes()) for mark in self.places)
        except struct.error:
            came = f"edge {self.edge}, picture {self.picture}, {self.places}"
            raise BadMessage(self.topic, came, "Give an edge, a CRC-32 and marks within ±4095 px.") from None

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``, to the resolution stated above."""
        body = body_of(cls, payload)
        if len(body) < _MARKS_HEAD.size or (len(body) - _MARKS_HEAD.size) % _MARK.size:
            raise BadMessage(cls.topic, f"{len(payload)} bytes", "7 come before the marks, 9 make a mark.")
        edge, picture = _MARKS_HEAD.unpack(body[: _MARKS_HEAD.size])
        made = tuple(_pixel_mark(*codes) for codes in _MARK.iter_unpack(body[_MARKS_HEAD.size :]))
        return cls(edge, picture, made)


def _pixel_mark(name: int, across: int, down: int, half_width: int, half_height: int) -> PixelMark:
    if name >= len(MARK_NAMES):
        raise BadMessage(Marks.topic, f"mark number {name}", f"Known: 0 to {len(MARK_NAMES) - 1}.")
    places = (v * MARK_STEP_PX for v in (across, down, half_width, half_height))
    return PixelMark(MARK_NAMES[name], *places)
