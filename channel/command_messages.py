"""What an operator can ask for by hand: an outcome, a place for a template, a step, a walk, a hand, joints."""

from __future__ import annotations

import struct
from typing import ClassVar, Literal, Self

from teleop_sim.channel.codec import BadMessage, pack_counts, unpack_counts
from teleop_sim.channel.message import (
    UINT8_MAX,
    UINT16_MAX,
    Message,
    body_of,
    index_of,
    message,
    pack_number,
    unpack_number,
)
from teleop_sim.channel.quantise import (
    GROUND,
    ROTATION,
    Vector,
    pack_joints,
    pack_pose,
    unpack_joints,
    unpack_pose,
)

Side = Literal["left", "right"]
JointGroup = Literal["left_arm", "right_arm", "left_leg", "right_leg", "torso", "neck", "left_hand", "right_hand"]

SIDES: tuple[Side, ...] = ("left", "right")
JOINT_GROUPS: tuple[JointGroup, ...] = (
    "left_arm", "right_arm", "left_leg", "right_leg", "torso", "neck", "left_hand", "right_hand",
)  # fmt: skip

_POSE = "1 mm up to ±32.767 m; 96 µrad up to ±pi"
_WALK = struct.Struct(">fff?f")


@message("up", "force", b"\x05")
class Force(Message):
    """The operator forces an outcome.

    The edge names its state, and ``seen`` the visit to it that the operator means, so that the field site can tell a
    command in time from one that is late, doubled or repeated (``machines/ledger.py``): none is executed twice. A
    repeat is the same bytes.

    Attributes:
        edge: place of the outcome in the machine's table, which both sites hold.
        seen: how many transitions the control station had seen, modulo 65536.

    Source of the idea: Schillinger, Kohlbrecher, von Stryk, ICRA 2016, 2796-2802 (FlexBE's forced outcomes).

    """

    layout: ClassVar = "type, transitions seen (2), edge of the machine's table (1, above 255 2)"
    edge: int
    seen: int

    @classmethod
    def example(cls) -> Self:
        """Of a table of at most 256 edges."""
        return cls(UINT8_MAX, 1000)

    def encode(self) -> bytes:
        """Type, transitions seen, edge."""
        return self.marks + pack_counts((self.seen,), (UINT16_MAX,), self.topic) + pack_number(self.edge, self.topic)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``."""
        body = body_of(cls, payload)
        (seen,) = unpack_counts(body[:2], (UINT16_MAX,), cls.topic)
        return cls(unpack_number(body[2:], cls.topic), seen)


@message("up", "template_pose", b"\x06")
class TemplatePose(Message):
    """Where the operator has placed an object template, in the odometry frame.

    Attributes:
        template: number in the list of templates, which both sites hold, 0 to 255.
        position_m: (3,), sent to 1 mm, at most ±32.767 m.
        rotation_rad: rotation vector (3,), sent to pi/32767 a component.

    """

    layout: ClassVar = "type, template, position (6), rotation vector (6)"
    resolution: ClassVar = _POSE

    template: int
    position_m: Vector
    rotation_rad: Vector

    @classmethod
    def example(cls) -> Self:
        """A valve in front of the robot."""
        return cls(3, (1.2, 0.0, 1.1), (0.0, 1.5, 0.0))

    def encode(self) -> bytes:
        """Type, template, then six 16-bit numbers."""
        head = pack_counts((self.template,), (UINT8_MAX,), self.topic)
        return self.marks + head + pack_pose(self.position_m, self.rotation_rad, self.topic)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``, to the resolution stated above."""
        body = body_of(cls, payload)
        (template,) = unpack_counts(body[:1], (UINT8_MAX,), cls.topic)
        return cls(template, *unpack_pose(body[1:], cls.topic))


@message("up", "footstep_goal", b"\x07")
class FootstepGoal(Message):
    """Where the robot is to stand, in the odometry frame; the field site plans the steps.

    Attributes:
        x_m: sent to 5 mm, at most ±163.835 m.
        y_m: likewise.
        yaw_rad: anticlockwise, sent to pi/32767, at most ±pi.

    """

    layout: ClassVar = "type, x (2), y (2), yaw (2)"
    resolution: ClassVar = "5 mm up to ±163.835 m; 96 µrad up to ±pi"

    x_m: float
    y_m: float
    yaw_rad: float

    @classmethod
    def example(cls) -> Self:
        """Before the console."""
        return cls(2.5, -0.4, 0.3)

    def encode(self) -> bytes:
        """Type, then three 16-bit numbers."""
        return self.marks + GROUND.pack((self.x_m, self.y_m), self.topic) + ROTATION.pack((self.yaw_rad,), self.topic)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``, to the resolution stated above."""
        body = body_of(cls, payload)
        x_m, y_m = GROUND.unpack(body[:4], 2, cls.topic)
        (yaw_rad,) = ROTATION.unpack(body[4:], 1, cls.topic)
        return cls(x_m, y_m, yaw_rad)


@message("up", "cartesian_target", b"\x08")
class CartesianTarget(Message):
    """Where a hand is to go, in the odometry frame.

    Attributes:
        side: of the hand.
        position_m: (3,), sent to 1 mm, at most ±32.767 m.
        rotation_rad: rotation vector (3,), sent to pi/32767 a component.

    """

    layout: ClassVar = "type, side, position (6), rotation vector (6)"
    resolution: ClassVar = _POSE

    side: Side
    position_m: Vector
    rotation_rad: Vector

    @classmethod
    def example(cls) -> Self:
        """The right hand over a handle."""
        return cls("right", (0.6, -0.2, 1.0), (0.0, 1.2, 0.1))

    def encode(self) -> bytes:
        """Type, side, then six 16-bit numbers."""
        side = index_of(self.side, SIDES, self.topic)
        return self.marks + bytes([side]) + pack_pose(self.position_m, self.rotation_rad, self.topic)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``, to the resolution stated above."""
        body = body_of(cls, payload)
        (side,) = unpack_counts(body[:1], (len(SIDES) - 1,), cls.topic)
        return cls(SIDES[side], *unpack_pose(body[1:], cls.topic))


@message("up", "joint_targets", b"\x09")
class JointTargets(Message):
    """Where the joints of a group are to go.

    Attributes:
        group: of joints.
        angles_rad: of all its joints, at most 255, in the robot's order; sent to pi/2047 (1.53 mrad), at most ±pi.

    """

    layout: ClassVar = "type, group, count n, angles (1.5 n, rounded up)"
    resolution: ClassVar = "1.53 mrad up to ±pi"

    group: JointGroup
    angles_rad: tuple[float, ...]

    @classmethod
    def example(cls) -> Self:
        """Seven joints of an arm."""
        return cls("right_arm", (0.1, 1.2, 0.3, 1.5, 0.0, -0.2, 0.2))

    def encode(self) -> bytes:
        """Type, group, count, then 12 bits a joint."""
        group = index_of(self.group, JOINT_GROUPS, self.topic)
        return self.marks + bytes([group]) + pack_joints(self.angles_rad, self.topic)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``, to the resolution stated above."""
        body = body_of(cls, payload)
        (group,) = unpack_counts(body[:1], (len(JOINT_GROUPS) - 1,), cls.topic)
        return cls(JOINT_GROUPS[group], unpack_joints(body[1:], cls.topic))


@message("up", "walk", b"\x0a")
class WalkCommand(Message):
    """Walk and turn, as Team ZARJ's command: 18 bytes, four 4-byte floats and a flag.

    Attributes:
        distance_m: forward.
        turn_rad: anticlockwise, before walking (unit and order assumed).
        offset_m: to the left (assumed).
        dead: walk without looking (assumed from ZARJ's name, deadwalk).
        snap_rad: headings are snapped to multiples of this; 0 for none (assumed from ZARJ's name, snapto).

    Source of the layout: ZarjRobotics/srcsim2017 @aa6fa12, lib/zarjcomm/message.py, ZarjWalkCommand.

    """

    layout: ClassVar = "type, distance (4), turn (4), offset (4), flag, snap (4)"
    resolution: ClassVar = "single precision: 1 in 1.7e7"
    source: ClassVar = "ZARJ, message.py"

    distance_m: float
    turn_rad: float
    offset_m: float
    dead: bool
    snap_rad: float

    @classmethod
    def example(cls) -> Self:
        """Two metres straight on."""
        return cls(2.0, 0.0, 0.0, False, 0.0)

    def encode(self) -> bytes:
        """Type, distance, turn, offset, flag, snap."""
        numbers = (self.distance_m, self.turn_rad, self.offset_m, self.snap_rad)
        # Infinities and NaN fail too; a flag of 2 would come back as True.
        if not all(abs(number) <= _FLOAT_MAX for number in numbers) or not isinstance(self.dead, bool):
            raise BadMessage(self.topic, f"{numbers}, {self.dead!r} cannot be sent", "Give finite numbers and a bool.")
        return self.marks + _WALK.pack(self.distance_m, self.turn_rad, self.offset_m, self.dead, self.snap_rad)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``."""
        body = body_of(cls, payload)
        if len(body) != _WALK.size or body[12] > 1:
            raise BadMessage(cls.topic, f"{body.hex()} is no walk", "17 bytes follow the type; a flag is 0 or 1.")
        return cls(*_WALK.unpack(body))


_FLOAT_MAX = 3.4028234663852886e38
"""Greatest number in single precision (IEEE 754)."""
