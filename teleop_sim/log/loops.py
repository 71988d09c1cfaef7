"""The inner loops of reading a log: over the records of a chunk, and over the fields of protobuf messages.

They are plain Python that numba compiles when a log is first read (kept on disk: 0.1 s to load, some seconds to compile
once). Nothing here raises: where bytes make no sense a loop stops and says where, and the caller decides.

Sources: MCAP specification, *Records* (mcap.dev/spec); Protocol Buffers, *Encoding*
(protobuf.dev/programming-guides/encoding).
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T")
R = TypeVar("R")
Bytes = NDArray[np.uint8]
Longs = NDArray[np.int64]

MESSAGE_BYTES = 31
"""Bytes of a message's record before its data: opcode, length, channel, sequence and two times."""

UNKNOWN, PASSED_OVER = -1, -2
"""Of a channel's number: not declared; declared, but not asked for."""

DOUBLE, INT, BOOL, TEXT, DOUBLES = 1, 2, 3, 4, 5
"""What a field holds. A field's code is this and its place among the fields of its sort, times 8."""


@cache
def compiled(function: Callable[..., Any]) -> Any:
    """The function compiled by numba, kept on disk where that can be."""
    # Half of the time that it takes to load; `import teleop_sim` and the command line's help do without.
    from numba import njit

    _start()
    try:
        return njit(cache=True, nogil=True)(function)
    except RuntimeError:
        # An installation that may not be written and no home to write to: compile anew in every process.
        return njit(nogil=True)(function)


def shared(work: Callable[[T], R], items: Sequence[T]) -> list[R]:
    """The work on each item, in order, by as many threads as help: the loops let others run meanwhile."""
    workers = min(4, os.cpu_count() or 1, len(items))
    if workers < 2:
        return list(map(work, items))
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(work, items))


_LINEAR_ALGEBRA = "scipy.linalg.cython_blas"


@cache
def _start() -> None:
    """Load numba's runtime without scipy, which it asks for linear algebra: none is done here (0.1 s, not 0.3 s)."""
    if "numba.np.arraymath" in sys.modules or _LINEAR_ALGEBRA in sys.modules:
        return
    modules = cast(dict[str, Any], sys.modules)
    # What stands as None among the modules cannot be imported (Python documentation, *The import system*).
    modules[_LINEAR_ALGEBRA] = None
    try:
        import numba.np.arraymath  # noqa: F401
    finally:
        del modules[_LINEAR_ALGEBRA]


def outline(data: Bytes, at: int, out: Longs) -> tuple[int, int, bool]:
    """List a file's records that hold or declare messages, from a place on, to the footer or as many as there is room.

    Args:
        data: bytes of the file.
        at: where to begin.
        out: three rows, written: opcode, start and size of the content.

    Returns:
        how many are listed, where to go on (-1: no further), and whether the bytes are cut there.

    """
    n = 0
    while at < len(data):
        if len(data) - at < 9:
            return n, -1, True
        size = np.int64(0)
        for k in range(8):
            size |= np.int64(data[at + 1 + k]) << (8 * k)
        if size < 0 or size > len(data) - at - 9:
            return n, -1, True
        if data[at] == 2:
            return n, -1, False
        if 3 <= data[at] <= 6:
            if n == out.shape[1]:
                return n, at, False
            out[0, n] = data[at]
            out[1, n] = at + 9
            out[2, n] = size
            n += 1
        at += 9 + int(size)
    return n, -1, False


def walk(data: Bytes, at: int, ends: Longs, keys: Longs, out: Longs, n: int) -> tuple[int, int]:
    """Note the messages from ``at`` on, until the end or the first record that is no message of a known channel.

    Args:
        data: bytes of chunks' records.
        at: where to begin.
        ends: where the records of each chunk end, in order; one may begin before ``at``.
        keys: number of a channel to what it is noted under; ``UNKNOWN`` or ``PASSED_OVER``.
        out: five rows, written from column ``n`` on: key, time [ns], sequence, start and size of the data.
        n: messages noted so far.

    Returns:
        where it stopped, and the messages noted.

    """
    for end in ends:
        while at < end:
            if end - at < MESSAGE_BYTES or data[at] != 5:
                return at, n
            size = np.int64(0)
            for k in range(8):
                size |= np.int64(data[at + 1 + k]) << (8 * k)
            if size < MESSAGE_BYTES - 9 or size > end - at - 9:
                return at, n
            key = keys[np.int64(data[at + 9]) | np.int64(data[at + 10]) << 8]
            if key == UNKNOWN:
                return at, n
            if key >= 0:
                sequence, time_ns = np.int64(0), np.int64(0)
                for k in range(4):
                    sequence |= np.int64(data[at + 11 + k]) << (8 * k)
                for k in range(8):
                    time_ns |= np.int64(data[at + 15 + k]) << (8 * k)
                out[0, n] = key
                out[1, n] = time_ns
                out[2, n] = sequence
                out[3, n] = at + MESSAGE_BYTES
                out[4, n] = size - (MESSAGE_BYTES - 9)
                n += 1
            at += 9 + int(size)
    return at, n


def decode(data: Bytes, starts: Longs, sizes: Longs, codes: Longs, cells: Longs, spans: Longs, first: int) -> int:
    """Take the fields out of messages of one type.

    Args:
        data: bytes in which the messages are.
        starts: of each message.
        sizes: of each message.
        codes: number of a field to its code; 0: passed over.
        cells: written: a row a number's field, a column a message; the bits of a double.
        spans: written: two rows a field of text or doubles: start and size of its bytes. Zero: not there.
        first: column of ``cells`` for the first message.

    Returns:
        the first message that is not plainly right, or -1. protobuf itself must say what that one means.

    """
    for i in range(len(starts)):
        at, end = starts[i], starts[i] + sizes[i]
        while at < end:
            tag = np.int64(0)
            shift = 0
            while True:
                if at >= end or shift > 28:
                    return i
                byte = np.int64(data[at])
                at += 1
                tag |= (byte & 127) << shift
                shift += 7
                if byte < 128:
                    break
            if tag >> 32 != 0:
                return i
            wire, number = tag & 7, tag >> 3
            code = codes[number] if number < len(codes) else 0
            kind, place = code & 7, code >> 3
            if wire == 1:
                if number == 0 or kind == 5 or end - at < 8:
                    return i
                if kind == 1:
                    value = np.int64(0)
                    for k in range(8):
                        value |= np.int64(data[at + k]) << (8 * k)
                    cells[place, first + i] = value
                at += 8
                continue
            if number == 0 or (wire != 0 and wire != 2):
                return i
            value = np.int64(0)
            shift = 0
            while True:
                if at >= end or shift > 63:
                    return i
                byte = np.int64(data[at])
                at += 1
                value |= (byte & 127) << shift
                if byte < 128:
                    break
                shift += 7
            if shift == 63 and byte > 1:
                return i
            if wire == 0:
                if kind == 2:
                    cells[place, first + i] = value
                elif kind == 3:
                    cells[place, first + i] = value != 0
                continue
            if value < 0 or value > end - at or (kind == 5 and value % 8 != 0):
                return i
            if kind >= 4:
                if spans[2 * place, i] != 0:
                    return i
                spans[2 * place, i] = at
                spans[2 * place + 1, i] = value
            at += value
    return -1


def intern(data: Bytes, starts: Longs, sizes: Longs, table: Longs, firsts: Longs, codes: NDArray[np.int32]) -> int:
    """Number the different texts among some, in the order in which they appear.

    Args:
        data: bytes in which the texts are.
        starts: of each text.
        sizes: of each text.
        table: zeros, a power of two of them, at least twice as many as ``firsts`` has.
        firsts: written: of each different text, where among all it comes first.
        codes: written: of each text, its number.

    Returns:
        how many different ones there are, or -1: more than ``firsts`` has room for.

    """
    n, mask = 0, len(table) - 1
    for i in range(len(starts)):
        at, size = starts[i], sizes[i]
        # Its beginning, middle and end: texts alike in these are told apart below.
        mixed = np.int64(size)
        if size >= 8:
            for part in range(3):
                word, first = np.int64(0), at + part * (size - 8) // 2
                for k in range(8):
                    word |= np.int64(data[first + k]) << (8 * k)
                mixed = (mixed ^ word) * np.int64(0x9E3779B97F4A7C15 - 2**64)
                mixed ^= mixed >> 32
        else:
            for k in range(size):
                mixed = (mixed << 8) ^ (mixed >> 56) ^ np.int64(data[at + k])
            mixed *= np.int64(0x9E3779B97F4A7C15 - 2**64)
            mixed ^= mixed >> 32
        place = mixed & mask
        while True:
            code = table[place] - 1
            if code < 0:
                if n == len(firsts):
                    return -1
                firsts[n] = i
                n += 1
                table[place] = n
                code = n - 1
                break
            other = starts[firsts[code]]
            if sizes[firsts[code]] == size:
                k = 0
                while k < size and data[at + k] == data[other + k]:
                    k += 1
                if k == size:
                    break
            place = (place + 1) & mask
        codes[i] = code
    return n


def gather(data: Bytes, starts: Longs, sizes: Longs, out: Bytes, offsets: NDArray[np.int32]) -> None:
    """Put stretches of bytes one behind another; ``offsets[i + 1]`` is where the i-th ends."""
    to = 0
    for i in range(len(starts)):
        at = starts[i]
        for k in range(sizes[i]):
            out[to + k] = data[at + k]
        to += sizes[i]
        offsets[i + 1] = to


def spread(data: Bytes, starts: Longs, sizes: Longs, out: Longs, row: int, column: int, width: int) -> None:
    """Write stretches of doubles as rows of a matrix of their bits, from a place on.

    At most ``width`` numbers a row; where there are fewer, the rest of the row is left as it is.
    """
    for i in range(len(starts)):
        at, n = starts[i], min(sizes[i] // 8, width)
        out[row + i, column : column + n] = data[at : at + 8 * n].view(np.int64)
