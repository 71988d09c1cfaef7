"""Unpack a chunk, and see that it is what its checksum says.

Source: MCAP specification, *Chunk* (mcap.dev/spec).
"""

from __future__ import annotations

import struct
import zlib

import zstandard

CHUNK_LIMIT_BYTES = 1 << 30  # assumed: a damaged length must not fill the memory

CHUNK = struct.Struct("<QQQII")
"""Times of the first and last message, size and checksum of the records, length of the compression's name."""


def claimed_bytes(content: memoryview) -> int:
    """The size that a chunk says its records have; 0 where that cannot be right."""
    if len(content) < CHUNK.size:
        return 0
    size = int(CHUNK.unpack_from(content)[2])
    return size if size <= CHUNK_LIMIT_BYTES else 0


def unpack(content: memoryview, place: memoryview, unpacker: zstandard.ZstdDecompressor) -> bool:
    """Unpack a chunk's records into a place of the size that they claim; false where anything is wrong with them.

    Their checksum is checked, if the chunk has one.
    """
    if len(content) < CHUNK.size:
        return False
    _, _, size, crc, name_length = CHUNK.unpack_from(content)
    start = CHUNK.size + name_length
    name, packed = bytes(content[CHUNK.size : start]), content[start + 8 :]
    if size != len(place) or not _decompress(name, packed, place, unpacker):
        return False
    return not crc or zlib.crc32(place) == crc


def _decompress(name: bytes, packed: memoryview, place: memoryview, unpacker: zstandard.ZstdDecompressor) -> bool:
    if name == b"" and len(packed) == len(place):
        place[:] = packed
        return True
    if name != b"zstd":
        return False
    try:
        # Streamed, for the frame's own claim of its size may be damaged.
        with unpacker.stream_reader(packed) as stream:
            return _filled(stream, place) and not stream.read(1)
    except zstandard.ZstdError:
        return False


def _filled(stream: zstandard.ZstdDecompressionReader, place: memoryview) -> bool:
    at = 0
    while at < len(place):
        more = stream.readinto(place[at:])
        if not more:
            return False
        at += more
    return True
