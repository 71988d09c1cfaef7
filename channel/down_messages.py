"""What the field site can say to the operator."""

from __future__ import annotations

import math
from typing import ClassVar, Literal, Self

import numpy as np

from teleop_sim.channel.codec import (
    BadMessage,
    grey_jpeg,
    jpeg_pixels,
    jpeg_size,
    line_bytes,
    line_text,
    pack_counts,
    pack_pose,
    unpack_counts,
    unpack_pose,
)
from teleop_sim.channel.message import LEVEL_MAX, UINT8_MAX, UINT16_MAX, Counts, Message, body_of, index_of, message
from teleop_sim.core.records import MODES

RequestKind = Literal["confirm", "manual"]
HandleName = Literal["pitch", "yaw"]

REQUEST_KINDS: tuple[RequestKind, ...] = ("confirm", "manual")
HANDLES: tuple[HandleName, ...] = ("pitch", "yaw")

_LOG_TIME_CHARS, _LOG_SEPARATOR, _LOG_END = 13, " : ", "\r\n"


@message("down", "mirror", b"\x10")
class MirrorUpdate(Counts):
    """The machine took a transition: ``edge`` is its number in the machine's table, which both sites hold."""

    limits: ClassVar = (UINT8_MAX,)
    edge: int


@message("down", "mode", b"\x11")
class ModeIs(Counts):
    """The machine is in the mode ``MODES[mode]``."""

    limits: ClassVar = (len(MODES) - 1,)
    mode: int


@message("down", "level", b"\x12")
class LevelIs(Counts):
    """The autonomy level in force at the field site, 0 (Off) to 3 (Full)."""

    limits: ClassVar = (LEVEL_MAX,)
    level: int


@message("down", "request", b"\x13")
class Request(Message):
    """The field site asks: to ``confirm`` a suggested event, or for ``manual`` help.

    ``state`` and ``event`` are numbers in the machine's tables, 0 to 255; ``request`` is what an answer names.
    """

    limits: ClassVar = (UINT16_MAX, len(REQUEST_KINDS) - 1, UINT8_MAX, UINT8_MAX)
    request: int
    kind: RequestKind
    state: int
    event: int

    def __post_init__(self) -> None:
        """Refuse what could not be encoded.

        Raises:
            BadMessage: a number out of range or an unknown kind.

        """
        self.encode()

    def encode(self) -> bytes:
        """Type, request (two bytes), kind, state, event."""
        values = (self.request, index_of(self.kind, REQUEST_KINDS, self.topic), self.state, self.event)
        return self.marks + pack_counts(values, self.limits, self.topic)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``."""
        request, kind, state, event = unpack_counts(body_of(cls, payload), cls.limits, cls.topic)
        return cls(request, REQUEST_KINDS[kind], state, event)


@message("down", "log", b"0123456789")
class LogLine(Message):
    """A line of the field computer's log, as WPI's chat shows it: 13-character time, 3 separators, text, 2 end bytes.

    Attributes:
        time_s: of the line, zero or more; sent with three decimals (1 ms; the format within 13 characters is assumed).
        text: one line; UTF-8, so plain ASCII takes a byte a character.

    Source of the size: WPI-Humanoid-Robotics-Lab/SpaceRoboticsChallenge @ea36ad7, src_bringup/scripts/message_parser.py
    and broadcast_server.py. Not modelled: the 14 to 20 characters of sender address that each reader got.

    """

    time_s: float
    text: str

    def __post_init__(self) -> None:
        """Refuse what could not be encoded.

        Raises:
            BadMessage: a time that does not fit, or not one line of text.

        """
        self.encode()

    def encode(self) -> bytes:
        """Time, separator, text and line end."""
        time = f"{self.time_s:0{_LOG_TIME_CHARS}.3f}"
        if not (math.isfinite(self.time_s) and self.time_s >= 0.0 and len(time) == _LOG_TIME_CHARS):
            raise BadMessage(self.topic, f"time {self.time_s!r} s cannot be sent", "Give 0 to 999999999 s.")
        line_bytes(self.text, "utf-8", self.topic)
        return f"{time}{_LOG_SEPARATOR}{self.text}{_LOG_END}".encode()

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``; the time to 1 ms."""
        end = len(payload) - len(_LOG_END)
        if payload[max(end, 0) :] != _LOG_END.encode():
            raise BadMessage(cls.topic, f"no line end in {payload!r}", "A log line ends with CR LF.")
        line = line_text(payload[:end], "utf-8", cls.topic)
        time, gap, text = line[:_LOG_TIME_CHARS], line[_LOG_TIME_CHARS:][:3], line[_LOG_TIME_CHARS + 3 :]
        digits = time.replace(".", "", 1)
        if gap != _LOG_SEPARATOR or time[-4:-3] != "." or not (digits.isascii() and digits.isdigit()):
            raise BadMessage(cls.topic, f"no time in {line!r}", "A log line starts like 000000012.250 : ")
        return cls(float(time), text)


@message("down", "image", b"\x14")
class Image(Message):
    """A grey picture [px]. Sent as a type byte and the JPEG, which carries its own size."""

    width: int
    height: int
    jpeg: bytes

    def __post_init__(self) -> None:
        """Refuse what would not decode to the same.

        Raises:
            BadMessage: no whole grey JPEG of this size.

        """
        if jpeg_size(self.jpeg, self.topic) != (self.width, self.height):
            raise BadMessage(self.topic, f"the JPEG is not {self.width} x {self.height} px", "Use encode_image.")

    def encode(self) -> bytes:
        """The type byte and the JPEG."""
        return self.marks + self.jpeg

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``."""
        jpeg = body_of(cls, payload)
        return cls(*jpeg_size(jpeg, cls.topic), jpeg)

    def pixels(self) -> np.ndarray:
        """What the receiver sees, (height, width) uint8.

        Raises:
            BadMessage: a damaged JPEG.

        """
        return jpeg_pixels(self.jpeg, self.topic)


def encode_image(pixels: np.ndarray, width: int, height: int, quality: int) -> Image:
    """Compress an image, (h, w) or (h, w, 3) uint8, to a grey picture of ``width`` x ``height`` px; see ``grey_jpeg``.

    Raises:
        BadMessage: pixels of another shape or type, or a size or quality out of range.

    """
    return Image(width, height, grey_jpeg(pixels, width, height, quality))


@message("down", "handle_pose", b"\x15")
class HandlePose(Message):
    """Where the robot believes a handle to be, in the odometry frame.

    Attributes:
        which: handle.
        position_m: (3,), sent to 1 mm, at most ±32.767 m.
        rotation_rad: rotation vector (3,), sent to pi/32767 a component.

    """

    which: HandleName
    position_m: tuple[float, float, float]
    rotation_rad: tuple[float, float, float]

    def __post_init__(self) -> None:
        """Refuse what could not be encoded.

        Raises:
            BadMessage: an unknown handle or a number out of range.

        """
        self.encode()

    def encode(self) -> bytes:
        """Type, handle, then six 16-bit numbers."""
        which = index_of(self.which, HANDLES, self.topic)
        return self.marks + bytes([which]) + pack_pose(self.position_m, self.rotation_rad, self.topic)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``, to the resolution stated above."""
        body = body_of(cls, payload)
        (which,) = unpack_counts(body[:1], (len(HANDLES) - 1,), cls.topic)
        return cls(HANDLES[which], *unpack_pose(body[1:], cls.topic))
