"""Is a log as it should be? Everything that is wrong with its structure, each with its place in the file."""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

from google.protobuf.message import DecodeError
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, ChunkIndex, DataEnd, Footer, Header, MessageIndex, Schema, Statistics
from mcap.writer import MCAP0_MAGIC as MAGIC

from teleop_sim.core.errors import Problem
from teleop_sim.core.records import RECORDS
from teleop_sim.log.opening import no_log, read_bytes
from teleop_sim.log.pieces import Gap, Piece, chunk_records, inner_pieces, pieces
from teleop_sim.log.repair import MESSAGE
from teleop_sim.log.scan import RECORD
from teleop_sim.log.schema import decoder
from teleop_sim.log.store import Decode, Kind
from teleop_sim.log.unpack import CHUNK

_READ: dict[int, Any] = {
    Opcode.HEADER: Header,
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.CHUNK: Chunk,
    Opcode.MESSAGE_INDEX: MessageIndex,
    Opcode.CHUNK_INDEX: ChunkIndex,
    Opcode.STATISTICS: Statistics,
    Opcode.DATA_END: DataEnd,
    Opcode.FOOTER: Footer,
}


_RECOVER = "teleop-sim log recover saves what is whole."


@dataclass(frozen=True)
class Checked:
    """What a check found: everything that is wrong, and how much there was to be checked."""

    problems: tuple[Problem, ...]
    chunks: int
    messages: int
    size_bytes: int


def check(path: Path) -> Checked:
    """Check a log's structure: file, chunks, index, summary, schemas, order of records.

    Raises:
        LogDamaged: there is no such file, or it is no MCAP file.

    """
    data = read_bytes(path)
    if data[: len(MAGIC)] != MAGIC:
        raise no_log(path, data)
    checker = _Checker(str(path), data)
    checker.run()
    return Checked(tuple(checker.problems), len(checker.chunks), sum(checker.counts.values()), len(data))


@dataclass
class _Chunk:
    """A chunk as it is, for comparison with what the index says of it."""

    at: int
    end: int
    read: Any
    indexed: dict[int, list[tuple[int, int]]]
    """Channel to time and place of its messages."""
    told: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    places: dict[int, int] = field(default_factory=dict)


class _Checker:
    """Goes through a file once and keeps what it has seen."""

    def __init__(self, path: str, data: memoryview) -> None:
        self.path = path
        self.data = data
        self.problems: list[Problem] = []
        self.chunks: list[_Chunk] = []
        self.counts: Counter[int] = Counter()
        self.schemas: dict[int, Any] = {}
        self.channels: dict[int, Any] = {}
        self.decoders: dict[int, Decode | None] = {}
        self.topics: list[str] = []
        self.last_ns = -1
        self.data_ended = False
        self.footer: tuple[int, Any] | None = None

    def wrong(self, at: int, what: str, hint: str = "") -> None:
        """Note a problem at a byte."""
        self.problems.append(Problem(f"{self.path}: byte {at}", what, hint))

    def run(self) -> None:
        """Check everything."""
        summary: list[Piece] = []
        for piece in pieces(self.data):
            if isinstance(piece, Gap):
                cut = piece.end == len(self.data)
                what = "cut off" if cut else f"{piece.end - piece.at} bytes make no sense"
                self.wrong(piece.at, what, _RECOVER)
            elif piece.opcode == Opcode.FOOTER:
                self.footer = (piece.at, self._read(piece))
            elif self.data_ended:
                summary.append(piece)
            else:
                self._data(piece)
        self._index()
        self._end(summary)
        self._run()

    def _read(self, piece: Piece) -> Any:
        """A record of the format's own; None: it does not read."""
        try:
            return _READ[piece.opcode].read(ReadDataStream(BytesIO(piece.content)))
        except (struct.error, ValueError, OverflowError, McapError) as error:
            self.wrong(piece.at, f"a record of kind {piece.opcode} does not read: {error}")
            return None

    def _data(self, piece: Piece) -> None:
        if (piece.opcode == Opcode.HEADER) != (piece.at == len(MAGIC)):
            self.wrong(piece.at, "a header is where there should be none, or none where one should be")
        if piece.opcode == Opcode.HEADER:
            self._read(piece)
        elif piece.opcode == Opcode.CHUNK:
            self._chunk(piece)
        elif piece.opcode == Opcode.MESSAGE_INDEX:
            told = self._read(piece)
            if told is not None and self.chunks:
                self.chunks[-1].told[told.channel_id] = [(int(t), int(at)) for t, at in told.records]
                self.chunks[-1].places[told.channel_id] = piece.at
        elif piece.opcode == Opcode.DATA_END:
            self.data_ended = True
            told = self._read(piece)
            if (
                told is not None
                and told.data_section_crc
                and zlib.crc32(self.data[: piece.at]) != told.data_section_crc
            ):
                self.wrong(piece.at, "the data are not what their checksum says")
        else:
            self._record(piece, piece.at)

    def _chunk(self, piece: Piece) -> None:
        read, records = self._read(piece), chunk_records(piece.content)
        if read is None or records is None:
            self.wrong(piece.at, "a chunk does not unpack to what its checksum says", "Its messages are lost.")
            return
        before = CHUNK.size + len(read.compression.encode())
        if struct.unpack_from("<Q", piece.content, before)[0] != len(piece.content) - before - 8:
            self.wrong(piece.at, "the chunk says that its packed records have another length")
        made = _Chunk(piece.at, piece.end, read, {})
        self.chunks.append(made)
        for inner in inner_pieces(records):
            if isinstance(inner, Gap):
                self.wrong(piece.at, f"the chunk's records make no sense from its byte {inner.at} on")
                return
            where = self._record(inner, piece.at)
            if where is not None:
                made.indexed.setdefault(where[0], []).append((where[1], inner.at))

    def _record(self, piece: Piece, at: int) -> tuple[int, int] | None:
        """A schema, a channel or a message; of a message channel and time."""
        if piece.opcode == Opcode.MESSAGE:
            return self._message(piece.content, at)
        if piece.opcode not in (Opcode.SCHEMA, Opcode.CHANNEL):
            return None
        read = self._read(piece)
        if read is None:
            return None
        if piece.opcode == Opcode.SCHEMA:
            self.schemas[read.id] = read
        elif read.id not in self.channels:
            self.channels[read.id] = read
            self.decoders[read.id] = self._decoder(read, at)
        return None

    def _decoder(self, channel: Any, at: int) -> Decode | None:
        schema = self.schemas.get(channel.schema_id)
        if schema is None:
            if channel.schema_id:
                self.wrong(at, f"the schema of {channel.topic} is not declared")
            return None
        try:
            if channel.topic in RECORDS:
                return Kind(channel.topic, schema.name, schema.data).decode
            if schema.encoding == "protobuf":
                # Any class will do: what counts is that the declaration can be used.
                decoder(schema.data, schema.name, RECORDS["run/ended"])
        except ValueError as error:
            self.wrong(at, f"the schema of {channel.topic} cannot be used: {error}")
        return None

    def _message(self, content: memoryview, at: int) -> tuple[int, int] | None:
        if len(content) < MESSAGE.size:
            self.wrong(at, "a message is too short")
            return None
        number, _, time_ns, _ = MESSAGE.unpack_from(content)
        channel = self.channels.get(number)
        self.counts[number] += 1
        if channel is None:
            self.wrong(at, f"a message of channel {number}, which is not declared")
        elif channel.topic in RECORDS:
            self._ours(channel, time_ns, content, at)
        return number, time_ns

    def _ours(self, channel: Any, time_ns: int, content: memoryview, at: int) -> None:
        if time_ns < self.last_ns:
            what = (
                f"a record of {channel.topic} at {time_ns * 1e-9:.9f} s comes after one at {self.last_ns * 1e-9:.9f} s"
            )
            self.wrong(at, what)
        self.last_ns = max(self.last_ns, time_ns)
        self.topics.append(channel.topic)
        decode = self.decoders.get(channel.id)
        try:
            if decode is not None:
                decode(bytes(content[MESSAGE.size :]))
        except DecodeError:
            self.wrong(at, f"a record of {channel.topic} at {time_ns * 1e-9:.9f} s does not fit its schema")

    def _index(self) -> None:
        """What the message indexes behind a chunk say, against what is in it."""
        for chunk in self.chunks:
            for number, told in chunk.told.items():
                if sorted(told) != sorted(chunk.indexed.get(number, [])):
                    self.wrong(chunk.places[number], f"the index of channel {number} is not what its chunk holds")
            missing = sorted(set(chunk.indexed) - set(chunk.told))
            if missing:
                self.wrong(chunk.end, f"there is no index of the chunk's channels {', '.join(map(str, missing))}")
            times = [time_ns for index in chunk.indexed.values() for time_ns, _ in index]
            span = (chunk.read.message_start_time, chunk.read.message_end_time)
            if times and span != (min(times), max(times)):
                self.wrong(chunk.at, "the chunk's times are not those of its messages")

    def _end(self, summary: list[Piece]) -> None:
        """The file's end: magic, footer with its checksum, and the summary against what is in the file."""
        size = len(self.data)
        if self.footer is None:
            if not any(problem.what == "cut off" for problem in self.problems):
                self.wrong(size, "there is no end: the file is cut off or still being written", _RECOVER)
            return
        if self.data[-len(MAGIC) :] != MAGIC:
            self.wrong(size - len(MAGIC), "the file does not end as MCAP does")
        at, footer = self.footer
        if not self.data_ended:
            self.wrong(at, "the end of the data is not marked")
        if footer is None:
            return
        # The checksum covers the summary and the footer up to itself.
        covered = self.data[footer.summary_start or at : at + RECORD.size + 16]
        if footer.summary_crc and zlib.crc32(covered) != footer.summary_crc:
            self.wrong(at, "the summary is not what its checksum says")
        elif not footer.summary_start or not summary:
            self.wrong(at, "there is no summary: readers cannot jump in time", _RECOVER)
        else:
            self._summary(summary)

    def _summary(self, summary: list[Piece]) -> None:
        told = [(piece.at, self._read(piece)) for piece in summary if piece.opcode in _READ]
        listed = {read.chunk_start_offset: (at, read) for at, read in told if isinstance(read, ChunkIndex)}
        for chunk in self.chunks:
            at, read = listed.pop(chunk.at, (0, None))
            if read is None:
                self.wrong(chunk.at, "the summary does not list this chunk")
            elif read.chunk_length != chunk.end - chunk.at or set(read.message_index_offsets) != set(chunk.indexed):
                self.wrong(at, f"what the summary says of the chunk at byte {chunk.at} is not so")
            elif any(read.message_index_offsets.get(n) != place for n, place in chunk.places.items()):
                self.wrong(at, f"the summary has the indexes of the chunk at byte {chunk.at} elsewhere")
        for offset, (at, _) in sorted(listed.items()):
            self.wrong(at, f"the summary lists a chunk at byte {offset}, where there is none that is whole")
        for at, read in told:
            if isinstance(read, Statistics):
                self._statistics(at, read)

    def _statistics(self, at: int, read: Any) -> None:
        counted = {number: n for number, n in read.channel_message_counts.items() if n}
        if counted != dict(self.counts) or read.message_count != sum(self.counts.values()):
            said, found = read.message_count, sum(self.counts.values())
            self.wrong(at, f"the summary counts {said} messages, and there are {found}; or by channel they differ")
        if read.chunk_count != len(self.chunks):
            self.wrong(at, f"the summary counts {read.chunk_count} chunks, and there are {len(self.chunks)}")

    def _run(self) -> None:
        """One run from its start to its end."""
        size = len(self.data)
        if not self.topics:
            self.wrong(size, "none of the topics are teleop-sim's")
            return
        for topic, place, where in (("run/started", 0, "first"), ("run/ended", -1, "last")):
            count = self.topics.count(topic)
            if count > 1:
                self.wrong(size, f"{topic} is there {count} times: more than one run")
            elif count == 1 and self.topics[place] != topic:
                self.wrong(size, f"{topic} is not the {where} record")
            elif count == 0 and topic == "run/ended":
                self.wrong(size, "there is no run/ended: the run was interrupted")
            elif count == 0:
                self.wrong(size, "there is no run/started: what was run is not known")
