"""The messages of one log or of many, and their decoding topic by topic."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from google.protobuf.message import DecodeError

from teleop_sim.core.errors import LogDamaged
from teleop_sim.core.records import RECORDS, Record
from teleop_sim.log.columns import Column, Program, Stretch, columns_from, columns_of, program
from teleop_sim.log.found import Block
from teleop_sim.log.loops import Longs
from teleop_sim.log.schema import SCHEMAS, decoder
from teleop_sim.log.tidy import free_fields

Decode = Callable[[bytes], Record]


@dataclass(frozen=True)
class Kind:
    """A topic as a file declares it: name and declaration of its message type."""

    topic: str
    name: str
    data: bytes

    @property
    def decode(self) -> Decode:
        """From message bytes to a record.

        Raises:
            ValueError: the declaration cannot be used.

        """
        ours = SCHEMAS[self.topic]
        return ours.decode if self.data == ours.data else _foreign(self.data, self.name, self.topic)


@lru_cache(maxsize=256)
def _foreign(data: bytes, name: str, topic: str) -> Decode:
    return decoder(data, name, RECORDS[topic])


@dataclass(frozen=True, eq=False)
class Messages:
    """Messages of our topics.

    Attributes:
        kinds: what a block's numbers of kinds stand for.
        blocks: in the order of the file, or file by file.
        sources: for each block, which file each message is from.

    """

    kinds: tuple[Kind, ...]
    blocks: tuple[Block, ...]
    sources: tuple[Longs, ...]

    def rows(self, numbers: Sequence[int]) -> list[Longs]:
        """Block by block, the rows of some kinds, in order."""
        if len(numbers) == 1:
            return [rows[numbers[0]] for rows in self._sorted]
        return [np.sort(_joined([rows[number] for number in numbers])) for rows in self._sorted]

    def numbers(self, topic: str) -> list[int]:
        """The kinds of a topic of which there are messages."""
        ours = (number for number, kind in enumerate(self.kinds) if kind.topic == topic)
        return [number for number in ours if any(len(rows[number]) for rows in self._sorted)]

    def without(self, sources: set[int]) -> Messages:
        """Those of other files."""
        rows = [~np.isin(own, sorted(sources)) for own in self.sources]
        blocks = (replace(block, notes=block.notes[:, kept]) for block, kept in zip(self.blocks, rows, strict=True))
        return Messages(self.kinds, tuple(blocks), tuple(o[k] for o, k in zip(self.sources, rows, strict=True)))

    @cached_property
    def _sorted(self) -> tuple[tuple[Longs, ...], ...]:
        """Of each block, the rows of each kind."""
        made = []
        for block in self.blocks:
            order = np.argsort(block.kinds.astype(np.uint16), kind="stable")
            counts = np.bincount(block.kinds, minlength=len(self.kinds))
            made.append(tuple(np.split(order, np.cumsum(counts)[:-1])))
        return tuple(made)


@dataclass(frozen=True, eq=False)
class Table:
    """One topic's messages as columns, with the time of each [ns] and the number of the file that it is from."""

    columns: dict[str, Column]
    times_ns: Longs
    sources: Longs


def table(messages: Messages, topic: str, where: str) -> Table:
    """One topic as columns.

    Args:
        messages: of one file or more.
        topic: one of ``RECORDS``.
        where: what to call the file in an error.

    Raises:
        LogDamaged: a record does not fit its schema.

    """
    numbers = messages.numbers(topic)
    rows = messages.rows(numbers)
    columns = _columns(messages, topic, rows)
    if columns is None:
        columns = columns_from(topic, list(records(messages, where, topic)))
    times_ns = _joined([block.times_ns[own] for block, own in zip(messages.blocks, rows, strict=True)])
    return Table(columns, times_ns, _joined([each[own] for each, own in zip(messages.sources, rows, strict=True)]))


def _columns(messages: Messages, topic: str, rows: list[Longs]) -> dict[str, Column] | None:
    """Neighbours of one kind at once: a file has one kind a topic, files of several versions have a few."""
    parts: list[tuple[Program, Stretch]] = []
    for block, own in zip(messages.blocks, rows, strict=True):
        kinds = block.kinds[own]
        edges = np.flatnonzero(np.diff(kinds)) + 1
        for here in np.split(own, edges) if len(own) else []:
            kind = messages.kinds[block.kinds[here[0]]]
            made = program(kind.data, kind.name, topic)
            if made is None:
                return None
            parts.append((made, Stretch(block.data, block.notes[3][here], block.notes[4][here])))
    return columns_of(topic, parts, free_fields(topic))


def records(messages: Messages, where: str, topic: str | None = None) -> Iterator[Record]:
    """All records, or those of one topic, in order.

    Raises:
        LogDamaged: a record does not fit its schema.

    """
    ours = None if topic is None else messages.rows(messages.numbers(topic))
    for place, block in enumerate(messages.blocks):
        notes = block.notes if ours is None else block.notes[:, ours[place]]
        for number, _, _, start, size in zip(*notes.tolist(), strict=True):
            kind = messages.kinds[number]
            try:
                yield kind.decode(block.data[start : start + size].tobytes())
            except (DecodeError, ValueError) as error:
                raise LogDamaged(where, f"a record of {kind.topic} does not fit its schema") from error


def misfits(messages: Messages, topic: str) -> set[int]:
    """The files of which a record of a topic does not fit its schema."""
    found: set[int] = set()
    rows = messages.rows(messages.numbers(topic))
    for block, sources, own in zip(messages.blocks, messages.sources, rows, strict=True):
        for (number, _, _, start, size), source in zip(block.notes.T[own].tolist(), sources[own].tolist(), strict=True):
            try:
                messages.kinds[number].decode(block.data[start : start + size].tobytes())
            except DecodeError:
                found.add(source)
    return found


def _joined(parts: list[Longs]) -> Longs:
    return np.concatenate(parts) if parts else np.zeros(0, dtype=np.int64)
