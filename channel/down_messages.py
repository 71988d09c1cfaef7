"""What the field site can say to the operator, but for pictures and clouds (``picture_messages.py``)."""

from __future__ import annotations

import math
from typing import ClassVar, Literal, Self

from teleop_sim.channel.codec import BadMessage, line_bytes, line_text, pack_counts, unpack_counts
from teleop_sim.channel.message import (
    LEVEL_MAX,
    UINT8_MAX,
    UINT16_MAX,
    UINT32_MAX,
    Counts,
    Message,
    Number,
    Sized,
    body_of,
    index_of,
    message,
    pack_number,
    unpack_number,
)
from teleop_sim.channel.quantise import Vector, pack_joints, pack_pose, unpack_joints, unpack_pose
from teleop_sim.core.records import MODES

RequestKind = Literal["confirm", "manual", "decide", "data", "act"]
HandleName = Literal["pitch", "yaw"]

REQUEST_KINDS: tuple[RequestKind, ...] = ("confirm", "manual", "decide", "data", "act")
HANDLES: tuple[HandleName, ...] = ("pitch", "yaw")

_LOG_TIME_CHARS, _LOG_SEPARATOR, _LOG_END = 13, " : ", "\r\n"


@message("down", "mirror", b"\x10")
class MirrorUpdate(Number):
    """The machine took an outcome: ``edge`` is its place in the machine's table, which both sites hold."""

    layout: ClassVar = "type, edge of the machine's table (1, above 255 2)"
    edge: int


@message("down", "mode", b"\x11")
class ModeIs(Counts):
    """The machine is in the mode ``MODES[mode]``."""

    layout: ClassVar = "type, mode"
    limits: ClassVar = (len(MODES) - 1,)
    mode: int


@message("down", "level", b"\x12")
class LevelIs(Counts):
    """The autonomy level in force at the field site, 0 (Off) to 3 (Full)."""

    layout: ClassVar = "type, level"
    limits: ClassVar = (LEVEL_MAX,)
    level: int


@message("down", "request", b"\x13")
class Request(Message):
    """The field site asks for an answer.

    Attributes:
        request: its number, which an answer names.
        kind: to ``confirm`` a suggested outcome, for an event (``manual``) or a decision (``decide``), for ``data``, or
            to ``act`` in lieu of a state.
        node: number of the state or container that asks, in the machine's table of nodes.
        edge: place of the suggested outcome in the machine's table, or -1.

    """

    layout: ClassVar = "type, request (2), kind, node, edge + 1 (1 each; 2 each where one is above 255)"
    request: int
    kind: RequestKind
    node: int
    edge: int = -1

    @classmethod
    def example(cls) -> Self:
        """May I?"""
        return cls(1, "confirm", 7, 2)

    def encode(self) -> bytes:
        """Type, request, kind, node, edge + 1."""
        if not isinstance(self.edge, int):
            raise BadMessage(self.topic, f"edge {self.edge!r} cannot be sent", "Give a whole number, or -1 for none.")
        kind = index_of(self.kind, REQUEST_KINDS, self.topic)
        narrow = isinstance(self.node, int) and max(self.node, self.edge + 1) <= UINT8_MAX
        limits = _request_limits(UINT8_MAX if narrow else UINT16_MAX)
        return self.marks + pack_counts((self.request, kind, self.node, self.edge + 1), limits, self.topic)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``."""
        body = body_of(cls, payload)
        limits = _request_limits(UINT8_MAX if len(body) <= _REQUEST_NARROW else UINT16_MAX)
        request, kind, node, edge = unpack_counts(body, limits, cls.topic)
        if len(body) > _REQUEST_NARROW and max(node, edge) <= UINT8_MAX:
            raise BadMessage(cls.topic, f"{node} and {edge} in two bytes each", "They have one each up to 255.")
        return cls(request, REQUEST_KINDS[kind], node, edge - 1)


_REQUEST_NARROW = 5
"""Bytes after the type byte when node and edge have one each."""


def _request_limits(most: int) -> tuple[int, ...]:
    return UINT16_MAX, len(REQUEST_KINDS) - 1, most, most


@message("down", "withdrawn", b"\x90")
class Withdrawn(Counts):
    """A request is over although its state was not left: nobody needs to answer it any more."""

    layout: ClassVar = "type, request (2)"
    limits: ClassVar = (UINT16_MAX,)
    request: int


@message("down", "paused", b"\x91")
class PausedIs(Counts):
    """The machine is paused (1) or goes on (0)."""

    layout: ClassVar = "type, paused"
    limits: ClassVar = (1,)
    paused: int


@message("down", "locked", b"\x92")
class LockedIs(Message):
    """A state or container, by its number, is locked (1) or no longer (0)."""

    layout: ClassVar = "type, locked, node (1, above 255 2)"
    node: int
    locked: int

    @classmethod
    def example(cls) -> Self:
        """Locked."""
        return cls(7, 1)

    def encode(self) -> bytes:
        """Type, locked, node."""
        return self.marks + pack_counts((self.locked,), (1,), self.topic) + pack_number(self.node, self.topic)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``."""
        body = body_of(cls, payload)
        (locked,) = unpack_counts(body[:1], (1,), cls.topic)
        return cls(unpack_number(body[1:], cls.topic), locked)


@message("down", "sync_state", b"\x93")
class SyncState(Sized):
    """The whole state of the machine, in answer to ``SyncRequest`` or ``Attach``, or when no other message can tell it.

    Attributes:
        data: as ``machines/sync.py`` packs it; neither the link nor this message looks into it.

    """

    layout: ClassVar = "type, count n (2), packed state (n)"
    data: bytes

    @classmethod
    def example(cls) -> Self:
        """One active state and one open request; the length is what counts."""
        return cls(bytes(30))


@message("down", "log", b"0123456789")
class LogLine(Message):
    """A line of the field computer's log, as WPI's chat shows it: 13-character time, 3 separators, text, 2 end bytes.

    Attributes:
        time_s: of the line, zero or more; sent with three decimals (1 ms; the format within 13 characters is assumed).
        text: one line; UTF-8, so plain ASCII takes a byte a character.

    Source of the size: WPI-Humanoid-Robotics-Lab/SpaceRoboticsChallenge @ea36ad7, src_bringup/scripts/message_parser.py
    and broadcast_server.py. Not modelled: the 14 to 20 characters of sender address that each reader got.

    """

    layout: ClassVar = '13-character time, " : ", text in UTF-8, CR LF'
    resolution: ClassVar = "time 1 ms"
    source: ClassVar = "WPI, message_parser.py"

    time_s: float
    text: str

    @classmethod
    def example(cls) -> Self:
        """57 characters, WPI's typical line."""
        return cls(285.4, "Handles detected: pitch 0.61 0.22 0.93, yaw 0.58 -0.2 0.9")

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


@message("down", "handle_pose", b"\x15")
class HandlePose(Message):
    """Where the robot believes a handle to be, in the odometry frame.

    Attributes:
        which: handle.
        position_m: (3,), sent to 1 mm, at most ±32.767 m.
        rotation_rad: rotation vector (3,), sent to pi/32767 a component.

    """

    layout: ClassVar = "type, handle, position (6), rotation vector (6)"
    resolution: ClassVar = "1 mm up to ±32.767 m; 96 µrad up to ±pi"

    which: HandleName
    position_m: Vector
    rotation_rad: Vector

    @classmethod
    def example(cls) -> Self:
        """The yaw handle in front of the robot."""
        return cls("yaw", (0.6, 0.1, 0.9), (0.0, 0.4, 0.0))

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


@message("down", "sync_hash", b"\x16")
class SyncHash(Counts):
    """The heartbeat: which machine runs, and its state's hash for the control station to compare with its mirror's.

    Attributes:
        behaviour: checksum of the machine that runs.
        crc32: of the state's bytes, whose form both sites agree on. Two states whose bytes differ within 32 bits in a
            row never hash alike; two that have nothing to do with each other do with probability 2**-32 = 2.3e-10.

    Source of the hash: ITU-T V.42, 8.1.1.6.2 (the polynomial), as zlib computes it; the same in every process.

    """

    layout: ClassVar = "type, checksum of the machine (4), CRC-32 of the state (4)"
    limits: ClassVar = (UINT32_MAX, UINT32_MAX)
    behaviour: int
    crc32: int


@message("down", "joint_state", b"\x17")
class JointState(Message):
    """Where the joints are.

    Attributes:
        angles_rad: at most 255, in the robot's order, which both sites hold; sent to pi/2047 (1.53 mrad), at most ±pi.

    """

    layout: ClassVar = "type, count n, angles (1.5 n, rounded up)"
    resolution: ClassVar = "1.53 mrad up to ±pi"

    angles_rad: tuple[float, ...]

    @classmethod
    def example(cls) -> Self:
        """Valkyrie's 32 joints without fingers."""
        return cls(tuple(0.05 * joint - 0.8 for joint in range(32)))

    def encode(self) -> bytes:
        """Type, count, then 12 bits a joint."""
        return self.marks + pack_joints(self.angles_rad, self.topic)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``, to the resolution stated above."""
        return cls(unpack_joints(body_of(cls, payload), cls.topic))
