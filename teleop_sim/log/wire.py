"""Pieces of protobuf's encoding, for messages that are too many for the package's own classes.

Source: protobuf.dev, *Encoding*.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from functools import cache

VARINT, DOUBLE, BYTES = 0, 1, 2
"""Wire types: a whole number, eight bytes, or a length and as many bytes."""

_DOUBLE = struct.Struct("<d")


@cache
def tag(number: int, kind: int) -> bytes:
    """What stands before a field."""
    return varint(number << 3 | kind)


def varint(value: int) -> bytes:
    """A whole number that is not negative, seven bits a byte, the lowest first."""
    if value < 0x80:
        return bytes((value,))
    made = bytearray()
    while value > 0x7F:
        made.append(value & 0x7F | 0x80)
        value >>= 7
    made.append(value)
    return bytes(made)


def whole(number: int, value: int) -> bytes:
    """A field with a whole number that is not negative; nothing for zero."""
    return tag(number, VARINT) + varint(value) if value else b""


def double(number: int, value: float) -> bytes:
    """A field with a number; nothing for zero, but minus zero is stored."""
    if value or math.copysign(1.0, value) < 0.0:
        return tag(number, DOUBLE) + _DOUBLE.pack(value)
    return b""


def doubles(number: int, values: Sequence[float]) -> bytes:
    """A field with a row of numbers; nothing for none."""
    if not values:
        return b""
    count = len(values)
    return tag(number, BYTES) + varint(8 * count) + struct.pack(f"<{count}d", *values)


def nested(number: int, data: bytes) -> bytes:
    """A field with a message or with bytes, also if there are none."""
    return tag(number, BYTES) + varint(len(data)) + data


def text(number: int, words: str) -> bytes:
    """A field with a text; nothing for an empty one."""
    return nested(number, words.encode()) if words else b""


def timestamp(number: int, time_ns: int) -> bytes:
    """A field with a ``google.protobuf.Timestamp``."""
    seconds, nanos = divmod(time_ns, 10**9)
    return nested(number, whole(1, seconds) + whole(2, nanos))
