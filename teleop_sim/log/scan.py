"""Walk through the bytes of an MCAP file, whole or cut off, straight through its chunks.

The package's own reader visits messages one by one at 0.1 million a second and stops at a cut with an error. This one
takes messages from each chunk in file order, keeps what is whole, and never raises but for bytes that are no MCAP.

Source: MCAP specification, https://mcap.dev/spec: records are opcode (1 byte), length (8 bytes), content.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Schema
from mcap.writer import MCAP0_MAGIC as MAGIC

CHUNK_LIMIT_BYTES = 1 << 30  # assumed: a damaged length must not fill the memory

_RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_CHUNK = struct.Struct("<QQQII")


@dataclass(frozen=True)
class RawMessage:
    """One message as stored: topic, sequence number, time [ns], the file's schema id and the encoded record."""

    topic: str
    schema_id: int
    sequence: int
    time_ns: int
    data: bytes


@dataclass
class Scan:
    """What a file holds.

    Attributes:
        schemas: schema id to (name of the message type, its declaration).
        messages: all messages that are whole, in file order.
        whole: the file's end was reached; otherwise it is cut or damaged after the last message.

    """

    schemas: dict[int, tuple[str, bytes]] = field(default_factory=dict)
    channels: dict[int, tuple[str, int]] = field(default_factory=dict)
    messages: list[RawMessage] = field(default_factory=list)
    whole: bool = False


class _Cut(Exception):
    """The bytes end or stop making sense here."""


def scan(data: bytes) -> Scan:
    """Read all that is whole.

    Raises:
        ValueError: the bytes do not begin as MCAP does.

    """
    if not data.startswith(MAGIC):
        raise ValueError("not an MCAP file" if data else "empty")
    found = Scan()
    try:
        for opcode, content in _records(memoryview(data), len(MAGIC)):
            if opcode == Opcode.FOOTER:
                break
            if opcode == Opcode.CHUNK:
                for inner, inner_content in _records(memoryview(_unpack(content)), 0):
                    _take(found, inner, inner_content)
            else:
                _take(found, opcode, content)
    except _Cut:
        return found
    found.whole = data.endswith(MAGIC) and len(data) > len(MAGIC)
    return found


def _records(data: memoryview, at: int) -> Iterator[tuple[int, memoryview]]:
    while at < len(data):
        if at + _RECORD.size > len(data):
            raise _Cut
        opcode, length = _RECORD.unpack_from(data, at)
        at += _RECORD.size
        if length > len(data) - at:
            raise _Cut
        yield opcode, data[at : at + length]
        at += length


def _take(found: Scan, opcode: int, content: memoryview) -> None:
    try:
        if opcode == Opcode.MESSAGE:
            channel, sequence, time_ns, _ = _MESSAGE.unpack_from(content)
            if channel not in found.channels:
                raise _Cut
            topic, schema_id = found.channels[channel]
            found.messages.append(RawMessage(topic, schema_id, sequence, time_ns, bytes(content[_MESSAGE.size :])))
        elif opcode == Opcode.SCHEMA:
            schema = Schema.read(ReadDataStream(BytesIO(content)))
            found.schemas[schema.id] = (schema.name, schema.data)
        elif opcode == Opcode.CHANNEL:
            declared = Channel.read(ReadDataStream(BytesIO(content)))
            found.channels[declared.id] = (declared.topic, declared.schema_id)
    except (struct.error, UnicodeDecodeError, McapError) as error:
        raise _Cut from error


def _unpack(content: memoryview) -> bytes:
    """The records in a chunk, checked against its CRC."""
    try:
        _, _, size, crc, name_length = _CHUNK.unpack_from(content)
        start = _CHUNK.size + name_length
        name = bytes(content[_CHUNK.size : start]).decode()
        packed = content[start + 8 :]
        records = _decompress(name, bytes(packed), size)
    except (struct.error, UnicodeDecodeError, zstandard.ZstdError) as error:
        raise _Cut from error
    if len(records) != size or (crc and zlib.crc32(records) != crc):
        raise _Cut
    return records


def _decompress(name: str, packed: bytes, size: int) -> bytes:
    if name == "":
        return packed
    if name != "zstd" or size > CHUNK_LIMIT_BYTES:
        raise _Cut
    # Streamed, for the frame's own claim of its size may be damaged.
    with zstandard.ZstdDecompressor().stream_reader(packed) as stream:
        return bytes(stream.read(size + 1))
