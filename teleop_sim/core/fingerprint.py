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
    kind: Any = type(value)
    _way(kind)(update, value)


@cache
def _way(kind: Any) -> Callable[[Update, Any], None]:
    """How values of a type are written."""
    ways: tuple[tuple[type | tuple[type, ...], Callable[[Update, Any], None]], ...] = (
        (float, _feed_float),
        ((tuple, list), _feed_row),
        (bytes, _feed_bytes),
        (str, _feed_str),
        (Enum, _feed_enum),
        ((type(None), int), _feed_plain),
        ((np.ndarray, np.generic), _feed_array),
        (Mapping, _feed_mapping),
        (Set, _feed_set),
    )
    return next((way for kinds, way in ways if issubclass(kind, kinds)), _feed_object)


def _feed_float(update: Update, value: float) -> None:
    update(b"=" + struct.pack("<d", value))


def _feed_bytes(update: Update, value: bytes) -> None:
    _head(update, "bytes", len(value))
    update(value)


def _feed_str(update: Update, value: str) -> None:
    data = value.encode()
    _head(update, "str", len(data))
    update(data)


def _feed_enum(update: Update, value: Enum) -> None:
    _named(update, type(value), value.name)


def _feed_plain(update: Update, value: object) -> None:
    _head(update, f"{type(value).__name__}={value}", 0)


def _feed_mapping(update: Update, value: Mapping[Any, Any]) -> None:
    _feed_unordered(update, "mapping", [fingerprint(k, v) for k, v in value.items()])


def _feed_set(update: Update, value: Set[Any]) -> None:
    _feed_unordered(update, "set", [fingerprint(member) for member in value])


def _head(update: Update, kind: str, length: int) -> None:
    update(f"{kind}:{length};".encode())


def _feed_row(update: Update, row: tuple[object, ...] | list[object]) -> None:
    # A state has some hundred floats in rows: all at once is six times as fast.
    if row and isinstance(row[0], float) and all(issubclass(kind, float) for kind in set(map(type, row))):
        update(struct.pack(f"<7sq{len(row)}d", b"floats:", len(row), *row))
        return
    _head(update, "row", len(row))
    for member in row:
        _feed(update, member)


def _feed_array(update: Update, value: np.ndarray | np.generic) -> None:
    array = np.asarray(value)
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
