"""A digest of values: equal values give equal digests in any process, other values other ones.

Numbers count bit for bit. Nothing is rounded, nothing depends on ``hash()`` or on the order of a set.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Set
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from hashlib import blake2b
from typing import Any

import numpy as np

Update = Callable[[bytes], object]

SIZE_BYTES = 32
"""Two of n different values share a digest with a chance of n^2 / 2^257: never, for any n that fits a computer."""


def fingerprint(*values: object) -> bytes:
    """BLAKE2b digest (32 bytes) of values.

    Understood are None, bool, int, float, str, bytes, NumPy arrays and scalars, tuples, lists, mappings (in any order),
    sets, enumerations, dataclasses, classes and functions of a module (by name), and objects by their class and
    attributes. ``1`` and ``1.0`` differ, and so do ``0.0`` and ``-0.0``; a list equals a tuple.

    Raises:
        TypeError: something else is in it, such as a lambda, a generator or an array of objects.
        RecursionError: a value that contains itself.

    Source: RFC 7693 (BLAKE2).
    """
    parts: list[bytes] = []
    _feed(parts.append, values)
    return blake2b(b"".join(parts), digest_size=SIZE_BYTES).digest()


def _feed(update: Update, value: object) -> None:
    """Write a value so that no two different ones can be written alike: kind, length, contents."""
    if isinstance(value, float):
        update(b"=" + struct.pack("<d", value))
    elif isinstance(value, (tuple, list)):
        _feed_row(update, value)
    elif isinstance(value, (bytes, str)):
        data = value if isinstance(value, bytes) else value.encode()
        _head(update, "bytes" if isinstance(value, bytes) else "str", len(data))
        update(data)
    elif isinstance(value, Enum):
        _named(update, type(value), value.name)
    elif value is None or isinstance(value, int):
        _head(update, f"{type(value).__name__}={value}", 0)
    elif isinstance(value, (np.ndarray, np.generic)):
        _feed_array(update, np.asarray(value))
    elif isinstance(value, Mapping):
        _feed_unordered(update, "mapping", [fingerprint(k, v) for k, v in value.items()])
    elif isinstance(value, Set):
        _feed_unordered(update, "set", [fingerprint(member) for member in value])
    else:
        _feed_object(update, value)


def _head(update: Update, kind: str, length: int) -> None:
    update(f"{kind}:{length};".encode())


def _feed_row(update: Update, row: tuple[object, ...] | list[object]) -> None:
    # A state has some hundred floats in rows: all at once is six times as fast.
    if row and isinstance(row[0], float) and all(isinstance(x, float) for x in row):
        update(struct.pack(f"<7sq{len(row)}d", b"floats:", len(row), *row))
        return
    _head(update, "row", len(row))
    for member in row:
        _feed(update, member)


def _feed_array(update: Update, array: np.ndarray) -> None:
    if array.dtype.hasobject:
        raise TypeError(f"an array of {array.dtype} has no fingerprint; give one of numbers")
    _head(update, f"array {array.dtype.str} {array.shape}", array.nbytes)
    update(array.tobytes())


def _feed_unordered(update: Update, kind: str, digests: list[bytes]) -> None:
    _head(update, kind, len(digests))
    for digest in sorted(digests):
        update(digest)


def _named(update: Update, of: type | Callable[..., object], what: str) -> None:
    name = f"{of.__module__}.{of.__qualname__}"
    # A lambda or a function in a function has no name of its own.
    if "<" in name:
        raise TypeError(f"{name} has no fingerprint; give a class or function of a module")
    _feed(update, (name, what))


def _feed_object(update: Update, value: object) -> None:
    if isinstance(value, type) or (callable(value) and hasattr(value, "__qualname__")):
        _named(update, value, "itself")
        return
    kind: Any = type(value)
    if is_dataclass(value):
        head, names = _dataclass_head(kind)
        update(head)
        for name in names:
            _feed(update, getattr(value, name))
    elif hasattr(value, "__dict__") and not hasattr(kind, "__slots__"):
        _head(update, f"object {kind.__module__}.{kind.__qualname__}", len(vars(value)))
        _feed(update, vars(value))
    else:
        raise TypeError(f"{kind.__name__} has no fingerprint; give plain values, arrays or dataclasses")


@cache
def _dataclass_head(kind: Any) -> tuple[bytes, tuple[str, ...]]:
    """How a dataclass begins, and its fields' names."""
    names = tuple(f.name for f in fields(kind))
    return f"dataclass {kind.__module__}.{kind.__qualname__}({','.join(names)})".encode(), names
