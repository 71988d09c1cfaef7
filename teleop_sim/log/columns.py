"""From encoded records to columns, without an object a record.

``Program`` is what is known of one topic in one file: which field number goes to which column. Compiled loops take the
fields out (``loops.decode``); text goes through Arrow. What is not plainly right is left to protobuf itself: then
``columns_of`` gives None, and the caller reads records one by one (``columns_from``) and gets the same columns, or the
error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from google.protobuf import descriptor_pb2
from google.protobuf.message import DecodeError
from numpy.typing import NDArray

from teleop_sim.core.records import RECORDS, Record
from teleop_sim.log.loops import (
    BOOL,
    DOUBLE,
    DOUBLES,
    INT,
    TEXT,
    Bytes,
    Longs,
    compiled,
    decode,
    gather,
    intern,
    shared,
    spread,
)
from teleop_sim.log.schema import KINDS, field_types

if TYPE_CHECKING:
    import pyarrow as pa

_Proto = descriptor_pb2.FieldDescriptorProto
_CODES: dict[Any, int] = {float: DOUBLE, int: INT, bool: BOOL, str: TEXT, tuple[float, ...]: DOUBLES}
_WORDS = 1024  # assumed: what has more different texts in one stretch has not few kinds
_HIGHEST_FIELD = 4096  # assumed: no class has more fields; a table of codes has a place for each number
_NAN = int(np.array([np.nan]).view(np.int64)[0])

_HARMLESS = frozenset(
    {_Proto.TYPE_DOUBLE, _Proto.TYPE_INT64, _Proto.TYPE_BOOL, _Proto.TYPE_STRING, _Proto.TYPE_BYTES}
    | {_Proto.TYPE_INT32, _Proto.TYPE_UINT32, _Proto.TYPE_UINT64, _Proto.TYPE_SINT32, _Proto.TYPE_SINT64}
    | {_Proto.TYPE_FIXED32, _Proto.TYPE_FIXED64, _Proto.TYPE_SFIXED32, _Proto.TYPE_SFIXED64, _Proto.TYPE_FLOAT}
)
"""Types of fields of which any value is right, so that they can be passed over; text must be UTF-8 and is checked."""


@dataclass(frozen=True)
class Stretch:
    """Some messages of one kind in one block of bytes."""

    data: Bytes
    starts: Longs
    sizes: Longs


@dataclass(frozen=True)
class Ragged:
    """A column of which each cell is some numbers: as bytes of doubles, wherever they are."""

    stretches: tuple[Stretch, ...]

    @property
    def counts(self) -> Longs:
        """How many numbers each cell has."""
        sizes = [stretch.sizes // 8 for stretch in self.stretches]
        return np.concatenate(sizes) if sizes else np.zeros(0, dtype=np.int64)

    @property
    def width(self) -> int:
        """The most numbers that a cell has."""
        return max((int(stretch.sizes.max(initial=0)) // 8 for stretch in self.stretches), default=0)

    def write(self, out: NDArray[np.float64], column: int, width: int) -> None:
        """Write the cells into a matrix, from a column on, so many numbers each; NaN where a cell is shorter."""
        bits = out.view(np.int64)

        def one(part: tuple[Stretch, int]) -> None:
            stretch, row = part
            if stretch.sizes.min(initial=8 * width) < 8 * width:
                out[row : row + len(stretch.starts), column : column + width] = np.nan
            compiled(spread)(stretch.data, stretch.starts, stretch.sizes, bits, row, column, width)

        shared(one, list(zip(self.stretches, _firsts(self.stretches), strict=True)))

    def tuples(self) -> list[tuple[float, ...]]:
        """The cells as tuples."""
        made: list[tuple[float, ...]] = []
        for part in self.stretches:
            joined = np.empty(int(part.sizes.sum()), dtype=np.uint8)
            offsets = np.zeros(len(part.starts) + 1, dtype=np.int32)
            compiled(gather)(part.data, part.starts, part.sizes, joined, offsets)
            flat = joined.view("<f8").tolist()
            made += (tuple(flat[start:end]) for start, end in pairwise((offsets // 8).tolist()))
        return made


@dataclass(frozen=True)
class Words:
    """A column of text of few kinds: the different ones, and which each cell has."""

    words: tuple[str, ...]
    codes: NDArray[np.int32]


Column = Any
"""A numpy array of float64, int64 or bool; Arrow's text, or ``Words``; or ``Ragged``."""


@dataclass(frozen=True)
class Program:
    """Where the fields of a file's message type go.

    Attributes:
        codes: field number to code, see ``loops.decode``; places are those of ``cell_fields`` and ``span_fields``.
        lacking: places of doubles that the file's type lacks.
        checked: how many fields of text only the file knows; it must be UTF-8. Their places are behind the others.

    """

    codes: Longs
    lacking: tuple[int, ...]
    checked: int


@cache
def hints_of(topic: str) -> dict[str, Any]:
    """Names and types of a topic's fields, in order."""
    return field_types(RECORDS[topic])


@cache
def cell_fields(topic: str) -> tuple[str, ...]:
    """Fields that are one number each."""
    return tuple(name for name, hint in hints_of(topic).items() if _CODES[hint] < TEXT)


@cache
def span_fields(topic: str) -> tuple[str, ...]:
    """Fields that are text or numbers, wherever their bytes are."""
    return tuple(name for name, hint in hints_of(topic).items() if _CODES[hint] >= TEXT)


@lru_cache(maxsize=256)
def program(data: bytes, name: str, topic: str) -> Program | None:
    """What to do with messages of a file's type; None: only protobuf can say what they mean.

    Args:
        data: serialised ``FileDescriptorSet`` from the file.
        name: full name of the message type in it.
        topic: of the records whose fields are asked for.

    """
    declared = _plain(data, name)
    if declared is None:
        return None
    hints, cells, spans = hints_of(topic), cell_fields(topic), span_fields(topic)
    codes = np.zeros(max((f.number for f in declared), default=0) + 1, dtype=np.int64)
    found: set[str] = set()
    checked = 0
    for field in declared:
        kind = KINDS.get(hints.get(field.name))
        if kind is not None and (kind.number, kind.repeated) == (field.type, _repeated(field)):
            found.add(field.name)
            place = cells.index(field.name) if field.name in cells else spans.index(field.name)
            codes[field.number] = _CODES[hints[field.name]] + 8 * place
        elif field.type == _Proto.TYPE_STRING:
            codes[field.number] = TEXT + 8 * (len(spans) + checked)
            checked += 1
    lacking = (place for place, name in enumerate(cells) if name not in found and hints[name] is float)
    return Program(codes, tuple(lacking), checked)


def columns_of(topic: str, parts: Sequence[tuple[Program, Stretch]], free: frozenset[str]) -> dict[str, Column] | None:
    """The columns of messages; None: one of them is not plainly right.

    Args:
        topic: of them.
        parts: the messages, in order, and what to do with them.
        free: fields of text that are expected to differ from row to row; others are counted out as ``Words``.

    """
    hints, names = hints_of(topic), cell_fields(topic)
    firsts = _firsts([stretch for _, stretch in parts])
    cells = np.zeros((len(names), sum(len(stretch.starts) for _, stretch in parts)), dtype=np.int64)
    taken = shared(partial(_taken, topic, free, cells), list(zip(parts, firsts, strict=True)))
    if any(part is None for part in taken):
        return None
    found: dict[str, Column] = {name: _typed(cells[at], hints[name]) for at, name in enumerate(names)}
    for at, name in enumerate(span_fields(topic)):
        found[name] = _together([part[at] for part in taken if part is not None], hints[name])
    return {name: found[name] for name in hints}


def _taken(
    topic: str, free: frozenset[str], cells: Longs, work: tuple[tuple[Program, Stretch], int]
) -> list[Words | pa.StringArray | Stretch] | None:
    """The fields of one stretch: numbers into their cells; the others as a list, in the order of ``span_fields``."""
    import pyarrow as pa

    (made, stretch), first = work
    hints, names = hints_of(topic), span_fields(topic)
    spans = np.zeros((2 * (len(names) + made.checked), len(stretch.starts)), dtype=np.int64)
    cells[made.lacking, first : first + len(stretch.starts)] = _NAN
    if compiled(decode)(stretch.data, stretch.starts, stretch.sizes, made.codes, cells, spans, first) >= 0:
        return None
    where = [Stretch(stretch.data, *spans[at : at + 2]) for at in range(0, len(spans), 2)]
    taken: list[Words | pa.StringArray | Stretch] = []
    try:
        for name, part in zip(names, where, strict=False):
            taken.append(part if hints[name] is not str else (None if name in free else _words(part)) or _text(part))
        for part in where[len(names) :]:
            _text(part)
    except (pa.ArrowInvalid, UnicodeDecodeError):
        return None
    return taken


def columns_from(topic: str, records: Sequence[Record]) -> dict[str, Column]:
    """The same columns from records, one by one."""
    return {name: _column([getattr(r, name) for r in records], hint) for name, hint in hints_of(topic).items()}


def _column(values: list[Any], hint: Any) -> Column:
    import pyarrow as pa

    if hint is str:
        return pa.chunked_array([pa.array(values, type=pa.string())])
    if hint in (float, int, bool):
        return np.array(values, dtype=hint)
    sizes = np.array([8 * len(value) for value in values], dtype=np.int64)
    data = np.array([number for value in values for number in value], dtype="<f8").view(np.uint8)
    return Ragged((Stretch(data, np.cumsum(sizes) - sizes, sizes),))


def _typed(bits: Longs, hint: Any) -> Column:
    if hint is float:
        return bits.view(np.float64)
    return bits.astype(np.bool_) if hint is bool else bits


def _text(part: Stretch) -> pa.StringArray:
    """Text from wherever it is.

    Raises:
        ArrowInvalid: it is not UTF-8.

    """
    import pyarrow as pa

    n = len(part.starts)
    joined = np.empty(int(part.sizes.sum()), dtype=np.uint8)
    offsets = np.zeros(n + 1, dtype=np.int32)
    compiled(gather)(part.data, part.starts, part.sizes, joined, offsets)
    made = pa.StringArray.from_buffers(n, pa.py_buffer(offsets), pa.py_buffer(joined))
    made.validate(full=True)
    return made


def _words(part: Stretch) -> Words | None:
    """Text of few kinds; None: of too many.

    Raises:
        UnicodeDecodeError: it is not UTF-8.

    """
    firsts = np.empty(_WORDS, dtype=np.int64)
    codes = np.empty(len(part.starts), dtype=np.int32)
    table = np.zeros(4 * _WORDS, dtype=np.int64)
    n = compiled(intern)(part.data, part.starts, part.sizes, table, firsts, codes)
    if n < 0:
        return None
    places = zip(part.starts[firsts[:n]].tolist(), part.sizes[firsts[:n]].tolist(), strict=True)
    return Words(tuple(part.data[start : start + size].tobytes().decode() for start, size in places), codes)


def _together(parts: Sequence[Any], hint: Any) -> Column:
    """One column of its stretches' parts."""
    import pyarrow as pa

    if hint is not str:
        return Ragged(tuple(parts))
    if any(not isinstance(part, Words) for part in parts) or not parts:
        return pa.chunked_array([_spelled(part) for part in parts], type=pa.string())
    if len(parts) == 1:
        return parts[0]
    numbers: dict[str, int] = {}
    codes = []
    for part in parts:
        ours = np.array([numbers.setdefault(word, len(numbers)) for word in part.words], dtype=np.int32)
        codes.append(ours[part.codes] if len(part.words) else part.codes)
    return Words(tuple(numbers), np.concatenate(codes))


def _spelled(part: Words | pa.StringArray) -> pa.StringArray:
    import pyarrow as pa

    return pa.array(part.words, type=pa.string()).take(pa.array(part.codes)) if isinstance(part, Words) else part


def _firsts(stretches: Sequence[Stretch]) -> list[int]:
    """Where each begins among all."""
    counts = [len(stretch.starts) for stretch in stretches]
    return [0, *accumulate(counts)][: len(counts)]


def _repeated(field: descriptor_pb2.FieldDescriptorProto) -> bool:
    return field.label == _Proto.LABEL_REPEATED


def _plain(data: bytes, name: str) -> tuple[descriptor_pb2.FieldDescriptorProto, ...] | None:
    """The fields of a message type, if a message of it can be read field by field: proto3, no groups, no choices."""
    try:
        files = descriptor_pb2.FileDescriptorSet.FromString(data).file
    except DecodeError:
        return None
    made = [(file, m) for file in files for m in file.message_type if f"{file.package}.{m.name}".strip(".") == name]
    if len(made) != 1 or made[0][0].syntax != "proto3" or made[0][1].oneof_decl:
        return None
    fields = tuple(made[0][1].field)
    simple = all(f.type in _HARMLESS and 0 < f.number <= _HIGHEST_FIELD for f in fields)
    # Packed numbers that only the file knows may be damaged within.
    known = all(not _repeated(f) or f.type == _Proto.TYPE_DOUBLE for f in fields)
    return fields if simple and known else None
