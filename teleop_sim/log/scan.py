"""Walk through the bytes of an MCAP file, whole or cut off, straight through its chunks.

The package's own reader visits messages one by one at 0.1 million a second and stops at a cut with an error. This one
notes in arrays where the messages of each chunk are, in file order, keeps what is whole, and never raises but for bytes
that are no MCAP.

Source: MCAP specification, https://mcap.dev/spec: records are opcode (1 byte), length (8 bytes), content.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from itertools import pairwise

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Schema
from mcap.writer import MCAP0_MAGIC as MAGIC

from teleop_sim.log.found import Block, Scan
from teleop_sim.log.loops import MESSAGE_BYTES, PASSED_OVER, UNKNOWN, Bytes, Longs, compiled, gather, outline, walk
from teleop_sim.log.unpack import claimed_bytes, unpack

BLOCK_BYTES = 1 << 23  # assumed: chunks are unpacked together up to so much, which costs little and bounds what is lost

RECORD = struct.Struct("<BQ")
BATCH_BYTES = 1 << 20  # assumed: a processor's cache holds it; unpacked and walked through by one thread
_THREADS_FROM_BYTES = 1 << 21  # assumed: less is read before threads have begun


class Cut(Exception):
    """The bytes end or stop making sense here."""


def _all(_topic: str) -> bool:
    return True


def scan(data: bytes | memoryview, wanted: Callable[[str], bool] = _all) -> Scan:
    """Read all that is whole.

    Args:
        data: the whole file.
        wanted: whether messages of a topic are asked for; others are passed over.

    Raises:
        ValueError: the bytes do not begin as MCAP does.

    """
    if data[: len(MAGIC)] != MAGIC:
        raise ValueError("not an MCAP file" if len(data) else "empty")
    found = Scan()
    with ExitStack() as closed:
        workers = min(4, os.cpu_count() or 1)
        pool = closed.enter_context(ThreadPoolExecutor(workers)) if len(data) > _THREADS_FROM_BYTES else None
        walker = _Walker(found, wanted, pool)
        try:
            for group in _grouped(_outlined(memoryview(data))):
                if group[0][0] == Opcode.CHUNK:
                    walker.take_chunks([content for _, content in group])
                else:
                    walker.take_loose(group)
        except Cut:
            return found
    found.whole = data[-len(MAGIC) :] == MAGIC and len(data) > len(MAGIC)
    return found


def records(data: memoryview, at: int) -> Iterator[tuple[int, memoryview]]:
    """Opcode and content of the records of a file or chunk, to the footer if there is one.

    Raises:
        Cut: a record is not whole. Those before it have been given.

    """
    while at < len(data):
        if at + RECORD.size > len(data):
            raise Cut
        opcode, length = RECORD.unpack_from(data, at)
        at += RECORD.size
        if length > len(data) - at:
            raise Cut
        if opcode == Opcode.FOOTER:
            return
        yield opcode, data[at : at + length]
        at += length


_Record = tuple[int, memoryview]


def _outlined(data: memoryview) -> Iterator[_Record]:
    """As ``records`` of a file, but only those that hold or declare messages: an index is as good as no record."""
    whole = np.frombuffer(data, dtype=np.uint8)
    out = np.empty((3, 1 << 10), dtype=np.int64)
    at, cut = len(MAGIC), False
    while at >= 0:
        n, at, cut = compiled(outline)(whole, at, out)
        for opcode, start, size in out[:, :n].T.tolist():
            yield opcode, data[start : start + size]
    if cut:
        raise Cut


def _grouped(found: Iterator[_Record]) -> Iterator[list[_Record]]:
    """Chunks together, as many as a block may hold; records outside of chunks together too."""
    group: list[_Record] = []
    size = 0
    try:
        for opcode, content in found:
            more = claimed_bytes(content) if opcode == Opcode.CHUNK else len(content)
            alike = bool(group) and (group[0][0] == Opcode.CHUNK) == (opcode == Opcode.CHUNK)
            if group and (not alike or size + more > BLOCK_BYTES):
                yield group
                group, size = [], 0
            group.append((opcode, content))
            size += more
    except Cut:
        if group:
            yield group
        raise
    if group:
        yield group


class _Walker:
    """Notes messages, chunk after chunk, by what the file has declared so far."""

    def __init__(self, found: Scan, wanted: Callable[[str], bool], pool: Executor | None) -> None:
        self.found = found
        self._wanted = wanted
        self._pool = pool
        self._keys: Longs = np.full(1 << 16, UNKNOWN, dtype=np.int64)
        self._scratch: Bytes = np.empty(0, dtype=np.uint8)

    def take_chunks(self, contents: list[memoryview]) -> None:
        """Note what is in some chunks; those before the first damaged one."""
        ends = np.cumsum([claimed_bytes(content) for content in contents])
        size = int(ends[-1])
        data = self._scratch if len(self._scratch) >= size else np.empty(max(size, len(self._scratch)), dtype=np.uint8)
        self._scratch, parts = data, _batches(ends)
        noted: list[Longs] = []
        try:
            # The first one declares, as a rule, what the others need.
            for batches in (parts[:1], parts[1:]):
                keys = self._keys
                work = partial(_unpack_and_walk, contents, data, ends, keys)
                for batch, done in zip(batches, (self._pool.map if self._pool else map)(work, batches), strict=True):
                    self._take(data, ends[batch], batch.start and ends[batch.start - 1], keys, done, noted)
        finally:
            self._keep(data, np.concatenate([_room(0)[:, :0], *noted], axis=1))

    def take_loose(self, group: list[_Record]) -> None:
        """Note what is outside of chunks."""
        data = b"".join(RECORD.pack(opcode, len(content)) + content for opcode, content in group)
        # A copy that may be written to, though nobody does: the loops are compiled for one sort of array.
        place = np.frombuffer(bytearray(data), dtype=np.uint8)
        noted: list[Longs] = []
        try:
            self._note(place, 0, np.array([len(data)]), noted)
        finally:
            if noted and noted[0].shape[1]:
                self.found.blocks.append(Block(place, noted[0]))

    def _keep(self, data: Bytes, notes: Longs) -> None:
        """Keep a block; where most of it was not asked for, only what was: views are nine tenths of a log's bytes."""
        wanted = int(notes[4].sum())
        if not notes.shape[1]:
            return
        if wanted < len(data) // 2:
            kept, offsets = np.empty(wanted, dtype=np.uint8), np.zeros(notes.shape[1] + 1, dtype=np.int32)
            compiled(gather)(data, notes[3], notes[4], kept, offsets)
            data, notes[3] = kept, offsets[:-1]
        else:
            self._scratch = np.empty(0, dtype=np.uint8)
        self.found.blocks.append(Block(data, notes))

    def _take(self, data: Bytes, ends: Longs, at: int, keys: Longs, done: _Done, noted: list[Longs]) -> None:
        """What was done ahead holds if nothing was declared meanwhile; else it is done again, in order."""
        if done.stopped_at == ends[-1] and keys is self._keys:
            noted.append(done.notes)
            return
        self._note(data, at, ends[: done.whole], noted)
        if done.whole < len(ends):
            raise Cut

    def _note(self, data: Bytes, at: int, ends: Longs, noted: list[Longs]) -> None:
        out = _room(int(ends[-1]) - at if len(ends) else 0)
        n = 0
        try:
            while len(ends) and at < ends[-1]:
                at, n = compiled(walk)(data, at, ends, self._keys, out, n)
                if at < ends[-1]:
                    at = self._other(data.data[: ends[np.searchsorted(ends, at, side="right")]], at)
        finally:
            noted.append(out[:, :n].copy())

    def _other(self, data: memoryview, at: int) -> int:
        """Take in what is no message, or one of no known channel; return where it ends."""
        opcode, content = next(records(data, at), (Opcode.FOOTER, data[:0]))
        if opcode in (Opcode.FOOTER, Opcode.MESSAGE):
            raise Cut
        try:
            if opcode == Opcode.SCHEMA:
                schema = Schema.read(ReadDataStream(BytesIO(content)))
                self.found.schemas[schema.id] = (schema.name, schema.data)
            elif opcode == Opcode.CHANNEL:
                declared = Channel.read(ReadDataStream(BytesIO(content)))
                self._declare(declared.id, (declared.topic, declared.schema_id))
        except (struct.error, UnicodeDecodeError, McapError) as error:
            raise Cut from error
        return at + RECORD.size + len(content)

    def _declare(self, number: int, kind: tuple[str, int]) -> None:
        self.found.channels[number] = kind
        key = PASSED_OVER
        if self._wanted(kind[0]):
            if kind not in self.found.kinds:
                self.found.kinds.append(kind)
            key = self.found.kinds.index(kind)
        if self._keys[number] != key:
            # A new array: others may be working with the old one.
            self._keys = self._keys.copy()
            self._keys[number] = key


@dataclass(frozen=True)
class _Done:
    """Some chunks unpacked into their block: how many are whole, where the walk through them stopped, its notes."""

    whole: int
    stopped_at: int
    notes: Longs


def _unpack_and_walk(contents: list[memoryview], data: Bytes, ends: Longs, keys: Longs, batch: slice) -> _Done:
    unpacker = zstandard.ZstdDecompressor()
    begin = at = int(ends[batch.start - 1]) if batch.start else 0
    whole = 0
    for content, end in zip(contents[batch], ends[batch].tolist(), strict=True):
        if not unpack(content, data.data[at:end], unpacker):
            break
        at, whole = end, whole + 1
    out = _room(at - begin)
    stopped_at, n = compiled(walk)(data, begin, ends[batch][:whole], keys, out, 0)
    return _Done(whole, stopped_at, out[:, :n].copy())


def _room(size: int) -> Longs:
    """For the notes of so many bytes."""
    return np.empty((5, size // MESSAGE_BYTES + 1), dtype=np.int64)


def _batches(ends: Longs) -> list[slice]:
    """Neighbours whose records are about so many bytes, small enough for a processor's cache."""
    groups = np.searchsorted(ends, np.arange(BATCH_BYTES, int(ends[-1]) + BATCH_BYTES, BATCH_BYTES))
    edges = np.unique([0, *np.minimum(groups + 1, len(ends)), len(ends)]).tolist()
    return [slice(start, end) for start, end in pairwise(edges)]
