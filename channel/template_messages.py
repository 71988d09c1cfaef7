"""What the two template servers tell each other.

A change of the control station goes up as one message of its kind and carries the whole entry, so that no message needs
another one before it. What changes at the field site goes down as a ``TemplateState`` of one entry; a heartbeat tells
the hash; ``TemplateSync`` and ``TemplateState`` with all entries mend what was lost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, Self

from teleop_sim.channel.codec import BadMessage, pack_counts, unpack_counts
from teleop_sim.channel.command_messages import SIDES, Side
from teleop_sim.channel.message import UINT8_MAX, UINT16_MAX, UINT32_MAX, Counts, Message, body_of, index_of, message
from teleop_sim.channel.quantise import Vector, pack_pose, unpack_pose
from teleop_sim.templates.poses import Pose
from teleop_sim.templates.server import FRAMES, GONE, Entry, Server

_POSE = "1 mm up to ±32.767 m; 96 µrad up to ±pi"
_HEAD = (UINT8_MAX, UINT16_MAX, UINT8_MAX)
_HEAD_BYTES, _POSE_BYTES = 4, 12
_GONE_CODE = len(FRAMES)

ChangeKind = Literal["insert", "move", "attach", "detach", "remove"]


@dataclass(frozen=True)
class Placed(Message):
    """An instance and where it is now, in the odometry frame.

    Attributes:
        instance: its number.
        stamp: of this change; see ``templates/server.py``.
        template: type of its template.
        position_m: (3,), sent to 1 mm, at most ±32.767 m.
        rotation_rad: rotation vector (3,), sent to pi/32767 a component.

    """

    layout: ClassVar = "type, instance, stamp (2), template, position (6), rotation vector (6)"
    resolution: ClassVar = _POSE

    instance: int
    stamp: int
    template: int
    position_m: Vector
    rotation_rad: Vector

    @classmethod
    def example(cls) -> Self:
        """A valve in front of the robot."""
        return cls(0, 2, 29, (1.2, 0.0, 1.1), (0.0, 0.0, 0.3))

    def encode(self) -> bytes:
        """Type, instance, stamp, template, pose."""
        head = pack_counts((self.instance, self.stamp, self.template), _HEAD, self.topic)
        return self.marks + head + pack_pose(self.position_m, self.rotation_rad, self.topic)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``, to the resolution stated above."""
        body = body_of(cls, payload)
        instance, stamp, template = unpack_counts(body[:_HEAD_BYTES], _HEAD, cls.topic)
        return cls(instance, stamp, template, *unpack_pose(body[_HEAD_BYTES:], cls.topic))

    @property
    def entries(self) -> tuple[Entry, ...]:
        """What the other server merges."""
        pose = Pose(self.position_m, self.rotation_rad)
        return (Entry(self.instance, self.stamp, self.template, "odometry", pose),)


@message("up", "template_insert", b"\xa0")
class TemplateInsert(Placed):
    """The operator puts a new instance of a template somewhere."""


@message("up", "template_move", b"\xa1")
class TemplateMove(Placed):
    """The operator moves an instance, as in aligning it."""


@message("up", "template_detach", b"\xa2")
class TemplateDetach(Placed):
    """The operator says that a hand no longer holds this, and where it is."""


@message("up", "template_remove", b"\xa3")
class TemplateRemove(Counts):
    """The operator takes an instance away."""

    layout: ClassVar = "type, instance, stamp (2)"
    limits: ClassVar = (UINT8_MAX, UINT16_MAX)
    instance: int
    stamp: int

    @property
    def entries(self) -> tuple[Entry, ...]:
        """What the other server merges."""
        return (Entry(self.instance, self.stamp, GONE),)


@message("up", "template_attach", b"\xa4")
class TemplateAttach(Message):
    """The operator says that a hand holds this.

    Attributes:
        instance, stamp, template: as for ``TemplateInsert``.
        side: of the hand.
        position_m, rotation_rad: of the template in the hand's frame.

    """

    layout: ClassVar = "type, instance, stamp (2), template, side, position (6), rotation vector (6)"
    resolution: ClassVar = _POSE

    instance: int
    stamp: int
    template: int
    side: Side
    position_m: Vector
    rotation_rad: Vector

    @classmethod
    def example(cls) -> Self:
        """A drill in the right hand."""
        return cls(0, 4, 17, "right", (0.0, 0.07, 0.0), (0.0, 3.1, 0.0))

    def encode(self) -> bytes:
        """Type, instance, stamp, template, side, pose."""
        side = index_of(self.side, SIDES, self.topic)
        numbers = (self.instance, self.stamp, self.template, side)
        head = pack_counts(numbers, (*_HEAD, len(SIDES) - 1), self.topic)
        return self.marks + head + pack_pose(self.position_m, self.rotation_rad, self.topic)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``, to the resolution stated above."""
        body, at = body_of(cls, payload), _HEAD_BYTES + 1
        instance, stamp, template, side = unpack_counts(body[:at], (*_HEAD, len(SIDES) - 1), cls.topic)
        return cls(instance, stamp, template, SIDES[side], *unpack_pose(body[at:], cls.topic))

    @property
    def entries(self) -> tuple[Entry, ...]:
        """What the other server merges."""
        pose = Pose(self.position_m, self.rotation_rad)
        return (Entry(self.instance, self.stamp, self.template, self.side, pose),)


@dataclass(frozen=True)
class Entries(Message):
    """Some or all entries of a server.

    Attributes:
        listed: see ``pack_entries``.

    """

    layout: ClassVar = "type, then for each: instance, stamp (2), frame, and unless removed template, pose (12)"
    resolution: ClassVar = _POSE

    listed: bytes

    @classmethod
    def example(cls) -> Self:
        """A door, and a drill in a hand."""
        door, drill = TemplateInsert.example(), TemplateAttach.example()
        return cls(pack_entries((*door.entries, *drill.entries), cls.topic))

    def encode(self) -> bytes:
        """The type byte and the entries."""
        unpack_entries(self.listed, self.topic)
        return self.marks + self.listed

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``."""
        return cls(body_of(cls, payload))

    @property
    def entries(self) -> tuple[Entry, ...]:
        """What the other server merges."""
        return unpack_entries(self.listed, self.topic)


@message("up", "template_sync", b"\xa5")
class TemplateSync(Entries):
    """The control station's server is another than the field site's: all that it holds; the answer is a whole state."""


@message("down", "template_state", b"\xb1")
class TemplateState(Entries):
    """What the field site's server holds: one entry that was changed there, or all in answer to ``TemplateSync``."""


@message("down", "template_hash", b"\xb0")
class TemplateHash(Counts):
    """The heartbeat of the field site's template server: CRC-32 of all its entries (``templates/server.py``)."""

    layout: ClassVar = "type, CRC-32 of the entries (4)"
    limits: ClassVar = (UINT32_MAX,)
    crc32: int


TemplateChange = TemplateInsert | TemplateMove | TemplateDetach | TemplateRemove | TemplateAttach
TemplateMessage = TemplateChange | TemplateSync | TemplateState | TemplateHash


def change_message(kind: ChangeKind, entry: Entry) -> TemplateChange:
    """The message that tells the field site of a change made at the control station.

    Raises:
        BadMessage: an entry that is not what such a change leaves behind.

    """
    pose = entry.pose.position_m, entry.pose.rotation_rad
    if kind == "remove" and entry.template == GONE:
        return TemplateRemove(entry.instance, entry.stamp)
    if kind == "attach" and entry.frame != "odometry":
        return TemplateAttach(entry.instance, entry.stamp, entry.template, entry.frame, *pose)
    kinds: dict[str, type[TemplateInsert | TemplateMove | TemplateDetach]] = {
        "insert": TemplateInsert,
        "move": TemplateMove,
        "detach": TemplateDetach,
    }
    # What moves in a hand is attached to it anew.
    if kind == "move" and entry.frame != "odometry":
        return change_message("attach", entry)
    if kind not in kinds or entry.frame != "odometry":
        raise BadMessage(f"template {kind}", f"{entry}", "Tell the entry that the change gave.")
    return kinds[kind](entry.instance, entry.stamp, entry.template, *pose)


def whole_sync(server: Server) -> TemplateSync:
    """All that the control station's server holds."""
    return TemplateSync(pack_entries(server.entries, TemplateSync.topic))


def state_message(entries: Sequence[Entry]) -> TemplateState:
    """Some or all entries of the field site's server."""
    return TemplateState(pack_entries(entries, TemplateState.topic))


def pack_entries(entries: Sequence[Entry], where: str) -> bytes:
    """Each: instance, stamp (2), frame; then template and pose (12), but of what was removed nothing more.

    Raises:
        BadMessage: a number out of range.

    """
    return b"".join(_pack_entry(e, where) for e in entries)


def unpack_entries(data: bytes, where: str) -> tuple[Entry, ...]:
    """Inverse of ``pack_entries``.

    Raises:
        BadMessage: bytes that are no such list.

    """
    entries, at = list[Entry](), 0
    while at < len(data):
        head = data[at : at + _HEAD_BYTES]
        instance, stamp, frame = unpack_counts(head, (UINT8_MAX, UINT16_MAX, _GONE_CODE), where)
        at += _HEAD_BYTES
        if frame == _GONE_CODE:
            entries.append(Entry(instance, stamp, GONE))
            continue
        end = at + 1 + _POSE_BYTES
        if end > len(data):
            raise BadMessage(where, f"an entry of {len(data) - at} bytes", "A template and a pose have 13.")
        pose = Pose(*unpack_pose(data[at + 1 : end], where))
        entries.append(Entry(instance, stamp, data[at], FRAMES[frame], pose))
        at = end
    return tuple(entries)


def _pack_entry(entry: Entry, where: str) -> bytes:
    gone = entry.template == GONE
    frame = _GONE_CODE if gone else FRAMES.index(entry.frame)
    head = pack_counts((entry.instance, entry.stamp, frame), (UINT8_MAX, UINT16_MAX, _GONE_CODE), where)
    if gone:
        return head
    template = pack_counts((entry.template,), (UINT8_MAX,), where)
    return head + template + pack_pose(entry.pose.position_m, entry.pose.rotation_rad, where)
