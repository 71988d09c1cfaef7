"""How values become bytes: small whole numbers and text lines. Numbers are big-endian.

Nothing here knows what a message means; ``messages.py`` does. Quantised numbers are in ``quantise.py``, pictures in
``pictures.py``, clouds in ``voxels.py``.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from functools import cache

from teleop_sim.core.errors import TeleopError


class BadMessage(TeleopError, ValueError):
    """A message that cannot be encoded, or bytes and text that are none.

    Attributes (in ``args``): ``where`` (which message or field), ``what`` (came), ``hint`` (what would do).
    """

    def __init__(self, where: str, what: str, hint: str = "") -> None:
        super().__init__(where, what, hint)

    def __str__(self) -> str:
        where, what, hint = self.args
        return f"{where}: {what}" + (f"\n  {hint}" if hint else "")


def pack_counts(values: Sequence[int], limits: Sequence[int], where: str) -> bytes:
    """Whole numbers from 0 to their limit, each in one byte, or in two or four where the limit needs it.

    Raises:
        BadMessage: a value that is no whole number or is out of range.

    """
    for value, limit in zip(values, limits, strict=True):
        if not isinstance(value, int) or not 0 <= value <= limit:
            raise BadMessage(where, f"{value!r} cannot be sent", f"Give a whole number from 0 to {limit}.")
    return _layout(tuple(limits)).pack(*values)


def unpack_counts(data: bytes, limits: Sequence[int], where: str) -> tuple[int, ...]:
    """Inverse of ``pack_counts``.

    Raises:
        BadMessage: too few or too many bytes, or a value above its limit.

    """
    layout = _layout(tuple(limits))
    if len(data) != layout.size:
        raise BadMessage(where, f"{len(data)} bytes after the type byte", f"It has {layout.size}.")
    values = layout.unpack(data)
    for value, limit in zip(values, limits, strict=True):
        if value > limit:
            raise BadMessage(where, f"value {value} in {data.hex()}", f"At most {limit} is possible.")
    return values


@cache
def _layout(limits: tuple[int, ...]) -> struct.Struct:
    return struct.Struct(">" + "".join("B" if limit < 256 else "H" if limit < 65536 else "I" for limit in limits))


def line_bytes(text: str, encoding: str, where: str) -> bytes:
    """One line of text without its end as bytes.

    Raises:
        BadMessage: the text is empty, holds a line end, or has characters outside ``encoding``.

    """
    if not text or "\n" in text or "\r" in text:
        raise BadMessage(where, f"{text!r} is not one line of text", "Give some text without line ends.")
    try:
        return text.encode(encoding)
    except UnicodeEncodeError as error:
        raise BadMessage(where, f"{text!r} cannot be written as {encoding}", str(error)) from None


def line_text(data: bytes, encoding: str, where: str) -> str:
    """Inverse of ``line_bytes``.

    Raises:
        BadMessage: the bytes are not one line in ``encoding``.

    """
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        raise BadMessage(where, f"bytes {data.hex()} are not {encoding} text", str(error)) from None
    line_bytes(text, encoding, where)
    return text
