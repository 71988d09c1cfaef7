"""The records of an MCAP file with their places, past damage: what checks, recovers and cuts logs reads with this.

Loading stops at the first damage; here a damaged chunk is passed over. Where even the lengths make no sense the next
chunk is searched for: its compression's name stands at a fixed place in it, and its checksum proves it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import zstandard
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC as MAGIC

from teleop_sim.log.scan import RECORD
from teleop_sim.log.unpack import CHUNK, claimed_bytes, unpack

_NAMED_ZSTD = b"\x04\x00\x00\x00zstd"
_BEFORE_NAME = RECORD.size + CHUNK.size - 4
"""From a chunk's first byte to the length of its compression's name."""


@dataclass(frozen=True)
class Piece:
    """One record of a file.

    Attributes:
        at: its first byte.
        opcode: what it is.
        content: its bytes without opcode and length.

    """

    at: int
    opcode: int
    content: memoryview

    @property
    def end(self) -> int:
        """The first byte behind it."""
        return self.at + RECORD.size + len(self.content)


@dataclass(frozen=True)
class Gap:
    """Bytes that make no sense: from where to where."""

    at: int
    end: int


def pieces(data: bytes | memoryview) -> Iterator[Piece | Gap]:
    """Everything between a file's first and last magic, in order; what makes no sense as gaps."""
    view = memoryview(data)
    at = len(MAGIC)
    while at < len(view):
        if view[at:] == MAGIC:
            return
        found = _piece(view, at)
        if found is None:
            end = _next_chunk(view, at)
            yield Gap(at, end)
            at = end
        else:
            yield found
            at = found.end


def inner_pieces(records: memoryview) -> Iterator[Piece | Gap]:
    """The records in a chunk, with their places in it."""
    at = 0
    while at < len(records):
        found = _piece(records, at)
        if found is None:
            yield Gap(at, len(records))
            return
        yield found
        at = found.end


def chunk_records(content: memoryview) -> memoryview | None:
    """The records in a chunk, unpacked; None: they do not unpack, or not to what their checksum says."""
    place = np.empty(claimed_bytes(content), dtype=np.uint8).data
    return place if unpack(content, place, zstandard.ZstdDecompressor()) else None


def _piece(view: memoryview, at: int) -> Piece | None:
    if at + RECORD.size > len(view):
        return None
    opcode, length = RECORD.unpack_from(view, at)
    start = at + RECORD.size
    # Opcodes from 128 on are anyone's own; from 1 on the format's.
    if opcode == 0 or length > len(view) - start:
        return None
    return Piece(at, opcode, view[start : start + length])


def _next_chunk(view: memoryview, at: int) -> int:
    """Where the next whole chunk begins; the end where there is none."""
    data = bytes(view[at:])
    place = data.find(_NAMED_ZSTD, _BEFORE_NAME + 1)
    while place >= 0:
        start = at + place - _BEFORE_NAME
        found = _piece(view, start)
        if found is not None and found.opcode == Opcode.CHUNK and chunk_records(found.content) is not None:
            return start
        place = data.find(_NAMED_ZSTD, place + 1)
    return len(view)
