"""Numbers with a unit as whole multiples of a step: resolution, reach and bytes.

What comes back is within half a step of what was sent; what does not fit is refused. Big-endian.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from teleop_sim.channel.codec import BadMessage

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Grid:
    """Codes ``-code_max`` to ``code_max`` of ``bits`` bits, two's complement; the one code below is never sent.

    Attributes:
        step: of the value [unit]. Error of a round trip: at most half of it.
        bits: of a code, 2 to 32.
        unit: for messages to people.

    """

    step: float
    bits: int
    unit: str

    @property
    def code_max(self) -> int:
        """The greatest code."""
        return (1 << (self.bits - 1)) - 1

    @property
    def reach(self) -> float:
        """The greatest value that comes back [unit]."""
        return self.code_max * self.step

    def size_bytes(self, count: int) -> int:
        """Bytes of ``count`` numbers: whole ones, the last filled up with zero bits."""
        return -(-self.bits * count // 8)

    def pack(self, values: Sequence[float], where: str) -> bytes:
        """The nearest codes, first number in the highest bits.

        Raises:
            BadMessage: a number that is not finite or more than half a step beyond the reach.

        """
        packed = 0
        for value in values:
            packed = packed << self.bits | self._code(value, where) & ((1 << self.bits) - 1)
        size = self.size_bytes(len(values))
        return (packed << (8 * size - self.bits * len(values))).to_bytes(size, "big")

    def unpack(self, data: bytes, count: int, where: str) -> tuple[float, ...]:
        """Inverse of ``pack``: ``count`` numbers, each within half a step.

        Raises:
            BadMessage: another number of bytes, the code that is never sent, or filling bits that are set.

        """
        if len(data) != self.size_bytes(count):
            raise BadMessage(where, f"{len(data)} bytes for {count} numbers", f"They have {self.size_bytes(count)}.")
        packed, spare = int.from_bytes(data, "big"), 8 * len(data) - self.bits * count
        if packed & ((1 << spare) - 1):
            raise BadMessage(where, f"{data.hex()} has bits set after the last number", "Send it again.")
        shifts = range(8 * len(data) - self.bits, spare - 1, -self.bits)
        return tuple(self._value(packed >> shift & ((1 << self.bits) - 1), where) for shift in shifts)

    def _code(self, value: float, where: str) -> int:
        # Dividing before rounding: a huge finite value over a small step may be inf, which round() cannot take.
        if not math.isfinite(value / self.step) or abs(round(value / self.step)) > self.code_max:
            raise BadMessage(where, f"{value!r} {self.unit} cannot be sent", f"At most ±{self.reach:.4g} fits.")
        return round(value / self.step)

    def _value(self, code: int, where: str) -> float:
        if code == self.code_max + 1:
            raise BadMessage(where, "a number is out of range", f"Codes go from {-self.code_max} to {self.code_max}.")
        return (code if code <= self.code_max else code - (1 << self.bits)) * self.step


POSITION = Grid(0.001, 16, "m")
"""1 mm up to ±32.767 m (assumed: a tenth of a detector's error)."""

ROTATION = Grid(math.pi / 32767, 16, "rad")
"""A component of a rotation vector, or a yaw: 96 µrad a step up to ±pi."""

GROUND = Grid(0.005, 16, "m")
"""A place on the ground: 5 mm up to ±163.8 m (assumed: a fiftieth of a foot's length, and every SRC field)."""

JOINT = Grid(math.pi / 2047, 12, "rad")
"""A joint's angle: 1.53 mrad up to ±pi (assumed: half a step is 0.6 mm at the hand of an outstretched 0.75 m arm)."""


def pack_pose(position_m: Sequence[float], rotation_rad: Sequence[float], where: str) -> bytes:
    """Position (3,) [m] and rotation vector (3,) [rad] in 12 bytes, rounded to the nearest step.

    Raises:
        BadMessage: a number that is not finite or out of range, or not three of each.

    """
    if len(position_m) != 3 or len(rotation_rad) != 3:
        raise BadMessage(where, "a pose has 3 + 3 numbers", "Give a position and a rotation vector.")
    return POSITION.pack(position_m, where) + ROTATION.pack(rotation_rad, where)


def unpack_pose(data: bytes, where: str) -> tuple[Vector, Vector]:
    """Inverse of ``pack_pose``: within half a step of what was packed.

    Raises:
        BadMessage: not 12 bytes, or the one 16-bit code that is never packed.

    """
    if len(data) != 12:
        raise BadMessage(where, f"{len(data)} bytes of pose", "A pose has 12.")
    x, y, z = POSITION.unpack(data[:6], 3, where)
    a, b, c = ROTATION.unpack(data[6:], 3, where)
    return (x, y, z), (a, b, c)


def pack_joints(angles_rad: Sequence[float], where: str) -> bytes:
    """How many, then 12 bits an angle.

    Raises:
        BadMessage: more than 255 angles, or one that is not finite or out of range.

    """
    if len(angles_rad) > 255:
        raise BadMessage(where, f"{len(angles_rad)} joints", "At most 255 fit.")
    return bytes([len(angles_rad)]) + JOINT.pack(angles_rad, where)


def unpack_joints(data: bytes, where: str) -> tuple[float, ...]:
    """Inverse of ``pack_joints``: within half a step.

    Raises:
        BadMessage: bytes that hold no such list.

    """
    if not data:
        raise BadMessage(where, "no count of joints", "It follows the type.")
    return JOINT.unpack(data[1:], data[0], where)
