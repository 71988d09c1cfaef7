"""Write a log anew: from all whole chunks of a damaged one, or only a span of time.

What is written is a whole, indexed MCAP file with the topics of the old one, foreign ones too; numbers and times of
messages stay. Not kept: attachments and metadata, which no log of teleop-sim has, and a publish time other than the
log's.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import IO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Schema
from mcap.writer import MCAP0_MAGIC as MAGIC

from teleop_sim.core.errors import BadInput, LogDamaged, Problem
from teleop_sim.core.records import RECORDS
from teleop_sim.log.mcap_file import McapFile
from teleop_sim.log.opening import no_log, read_bytes
from teleop_sim.log.pieces import Gap, Piece, chunk_records, inner_pieces, pieces
from teleop_sim.log.writer import COMPRESSION, PROFILE

NEEDED = frozenset({"run/started", "field/plant_names", "field/disturbance", "link/blackout"})
"""Topics without which a later part of a log makes no sense: all of their earlier messages go with a cut."""

MESSAGE = struct.Struct("<HIQQ")
"""A message's channel, sequence, time and publish time [ns]."""

_LOOSE = frozenset({Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL})

Keep = Callable[[str, int], bool]
"""Whether a message of a topic and time [ns] is wanted."""


@dataclass(frozen=True)
class Rewritten:
    """What was written anew.

    Attributes:
        out: the new file.
        messages: written.
        chunks: whole ones that were read.
        lost_chunks: damaged ones that were passed over.
        lost_bytes: of what made no sense, damaged chunks too.
        orphans: messages of which no whole chunk says what they are.
        last_s: time of the last message written [s]; None: none was.
        ended: the run's end is among them.

    """

    out: Path
    messages: int
    chunks: int
    lost_chunks: int
    lost_bytes: int
    orphans: int
    last_s: float | None
    ended: bool


def recover(path: Path, out: Path, force: bool = False) -> Rewritten:
    """Write a whole log from all whole chunks of one that is cut off or damaged.

    Of an undamaged log it writes the same bytes again.

    Args:
        path: of a ``.mcap`` or ``.mcap.part`` file.
        out: of the new one.
        force: write over ``out``.

    Raises:
        BadInput: ``out`` is ``path``, or there already, or cannot be written.
        LogDamaged: there is no such file, it is no MCAP file, or nothing in it is whole.
        OSError: the new file cannot be written.

    """
    done = _rewrite(path, out, force, lambda _topic, _time_ns: True)
    if done is None:
        raise LogDamaged(str(path), "nothing in it is whole")
    return done


def cut(path: Path, out: Path, from_s: float, to_s: float, force: bool = False) -> Rewritten:
    """Write the messages from one time to another, both included, and what is needed to make sense of them.

    That is: ``NEEDED`` topics from the start on, and foreign topics' messages at time 0 (the scene, the model).

    Args:
        path: of a ``.mcap`` or ``.mcap.part`` file.
        out: of the new one.
        from_s: first time wanted [s].
        to_s: last time wanted [s]; may be infinite.
        force: write over ``out``.

    Raises:
        BadInput: as of ``recover``; or the span is empty or holds no message.
        LogDamaged: as of ``recover``.
        OSError: the new file cannot be written.

    """
    if not from_s < to_s:
        hint = "Give a later end, or an earlier beginning."
        raise BadInput((Problem("--to", f"{to_s:g} s is not after {from_s:g} s", hint),))
    first_ns, last_ns = round(from_s * 1e9), float("inf") if to_s == float("inf") else round(to_s * 1e9)
    inside = 0

    def keep(topic: str, time_ns: int) -> bool:
        nonlocal inside
        if first_ns <= time_ns <= last_ns:
            inside += 1
            return True
        return time_ns < first_ns and (topic in NEEDED or (topic not in RECORDS and time_ns == 0))

    done = _rewrite(path, out, force, keep, lambda: inside > 0)
    if done is None:
        until = "on" if to_s == float("inf") else f"to {to_s:g} s"
        what = f"{path} has no message from {from_s:g} s {until}"
        raise BadInput((Problem("--from", what, "teleop-sim log info says how long it is."),))
    return done


def _rewrite(
    path: Path, out: Path, force: bool, keep: Keep, any_inside: Callable[[], bool] | None = None
) -> Rewritten | None:
    """Write what is to be kept; None, and no file: there is nothing."""
    data = read_bytes(path)
    if data[: len(MAGIC)] != MAGIC:
        raise no_log(path, data)
    problems = _out_problems(path, out, force)
    if problems:
        raise BadInput(problems)
    aside = out.with_name(f"{out.name}.{os.getpid()}.part")
    try:
        with _named(aside), aside.open("wb") as stream:
            copy = _Copy(stream, keep)
            copy.take(data)
            done = copy.finish(out)
            empty = not done.messages or (any_inside is not None and not any_inside())
            if not empty:
                stream.flush()
                os.fsync(stream.fileno())
        if empty:
            return None
        aside.replace(out)
    finally:
        with suppress(OSError):
            aside.unlink(missing_ok=True)
    return done


class _Copy:
    """Copies messages from pieces of a file into a new one, chunk by chunk."""

    def __init__(self, stream: IO[bytes], keep: Keep) -> None:
        self._file = McapFile(stream, PROFILE, COMPRESSION)
        self._keep = keep
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, tuple[Channel, int]] = {}
        # Of a chunk that is lost the summary may still tell what it declared.
        self._told: dict[int, Channel] = {}
        self._messages = self._chunks = self._lost_chunks = self._lost_bytes = self._orphans = 0
        self._last_ns: int | None = None
        self._ended = False

    def take(self, data: memoryview) -> None:
        """Copy all that is whole."""
        found = list(pieces(data))
        self._hear(found)
        for piece in found:
            if isinstance(piece, Gap):
                self._lost_bytes += piece.end - piece.at
            elif piece.opcode == Opcode.CHUNK:
                self._take_chunk(piece)
            elif piece.opcode in _LOOSE:
                self._take_piece(piece)
        self._file.flush()

    def finish(self, out: Path) -> Rewritten:
        """End the file, and say what became of it."""
        self._file.finish()
        last_s = None if self._last_ns is None else self._last_ns / 1e9
        counts = (self._messages, self._chunks, self._lost_chunks, self._lost_bytes, self._orphans)
        return Rewritten(out, *counts, last_s, self._ended)

    def _hear(self, found: list[Piece | Gap]) -> None:
        for piece in found:
            if isinstance(piece, Piece) and piece.opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                declared = _declaration(piece)
                if isinstance(declared, Schema):
                    self._schemas.setdefault(declared.id, declared)
                elif declared is not None:
                    self._told.setdefault(declared.id, declared)

    def _take_chunk(self, piece: Piece) -> None:
        records = chunk_records(piece.content)
        if records is None:
            self._lost_chunks += 1
            self._lost_bytes += piece.end - piece.at
            return
        self._chunks += 1
        for inner in inner_pieces(records):
            if isinstance(inner, Piece):
                self._take_piece(inner)
        self._file.flush()

    def _take_piece(self, piece: Piece) -> None:
        if piece.opcode == Opcode.MESSAGE:
            self._take_message(piece.content)
            return
        declared = _declaration(piece)
        if isinstance(declared, Schema):
            self._schemas[declared.id] = declared
        elif declared is not None:
            self._number(declared)

    def _take_message(self, content: memoryview) -> None:
        if len(content) < MESSAGE.size:
            self._orphans += 1
            return
        channel, sequence, time_ns, _ = MESSAGE.unpack_from(content)
        known = self._channels[channel][0] if channel in self._channels else self._told.get(channel)
        if known is None:
            self._orphans += 1
        elif self._keep(known.topic, time_ns):
            self._file.add(self._number(known), time_ns, content[MESSAGE.size :], sequence)
            self._messages += 1
            self._last_ns = max(self._last_ns or 0, time_ns)
            self._ended = self._ended or known.topic == "run/ended"

    def _number(self, declared: Channel) -> int:
        """The number of a channel in the new file."""
        known = self._channels.get(declared.id)
        if known is not None and known[0] == declared:
            return known[1]
        schema = self._schemas.get(declared.schema_id) or Schema(id=0, name="", encoding="", data=b"")
        number = self._file.register(
            declared.topic, schema.name, schema.data, schema.encoding, declared.message_encoding
        )
        self._channels[declared.id] = (declared, number)
        return number


def _declaration(piece: Piece) -> Schema | Channel | None:
    """A schema or channel; None: of no sense, or anything else."""
    try:
        if piece.opcode == Opcode.SCHEMA:
            schema: Schema = Schema.read(ReadDataStream(BytesIO(piece.content)))
            return schema
        if piece.opcode == Opcode.CHANNEL:
            channel: Channel = Channel.read(ReadDataStream(BytesIO(piece.content)))
            return channel
    except (struct.error, UnicodeDecodeError, McapError):
        return None
    return None


def _out_problems(path: Path, out: Path, force: bool) -> tuple[Problem, ...]:
    if out.exists() and path.exists() and out.samefile(path):
        return (Problem("--out", f"{out} is the log itself", "Give another file: the log stays as it is."),)
    if out.is_dir():
        return (Problem("--out", f"{out} is a directory", "Give a file, such as recovered.mcap."),)
    if not out.parent.is_dir():
        return (Problem("--out", f"there is no directory {out.parent}", "Make it, or give another file."),)
    if out.exists() and not force:
        return (Problem("--out", f"{out} is there already", "Give another file, or --force to write over it."),)
    if not os.access(out.parent, os.W_OK | os.X_OK):
        return (Problem("--out", f"{out.parent} cannot be written to", "Give another directory."),)
    return ()


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """A full disk names no file by itself."""
    try:
        yield
    except OSError as error:
        error.filename = error.filename or str(path)
        raise
