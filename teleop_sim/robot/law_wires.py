"""The law's arrays by address: one argument instead of twenty-two.

Numba looks at every array of every call: type, shape, a counted reference; 72 ns each (measured, numba 0.68), and again
wherever compiled code hands it on. MuJoCo's arrays never move, so compiled code is told once where they are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import types
from numba.extending import intrinsic, register_jitable
from numba.np.numpy_support import carray

from teleop_sim.robot.law_layout import Arrays, Gains

_ONE_BY_ONE = ("sole", "sole_rotation")
"""Arrays whose two rows stand in the table one by one: the right foot may lie before the left in memory."""

_WHOLE = tuple(name for name in Arrays._fields if name not in _ONE_BY_ONE)


class Wires(NamedTuple):
    """``table``: (n, 2) addresses and sizes: valid as long as ``kept``, the views that it was made of, are."""

    table: np.ndarray
    kept: tuple[np.ndarray, ...]


def wire(gains: np.ndarray, memory: np.ndarray, arrays: Arrays) -> Wires:
    """Tell where gains, memory, both soles' rows and all other arrays are, in this order.

    Raises:
        ValueError: an array that compiled code could not read as it lies in memory.
    """
    rows = [getattr(arrays, name)[i] for name in _ONE_BY_ONE for i in range(2)]
    kept = (gains, memory, *rows, *(getattr(arrays, name) for name in _WHOLE))
    for array in kept:
        if not array.flags.c_contiguous or array.dtype not in (np.float64, np.int64):
            raise ValueError(
                f"the law reads float64 and int64 without gaps, not {array.dtype}, strides {array.strides}"
            )
    return Wires(np.array([(array.ctypes.data, array.size) for array in kept], np.int64), kept)


def _pointer_to(kind):
    """Compiled code's cast from an address to a pointer."""

    @intrinsic
    def cast(_typing, address):
        def generate(context, builder, signature, values):
            return builder.inttoptr(values[0], context.get_value_type(signature.return_type))

        return types.CPointer(kind)(address), generate

    return cast


_to_floats, _to_ints = _pointer_to(types.float64), _pointer_to(types.int64)


@register_jitable
def _floats(table, i):
    """Line i of a table as (size,) floats."""
    return carray(_to_floats(table[i, 0]), (table[i, 1],))


@register_jitable
def _rows(table, i):
    """Line i of a table as (size / 6, 6) floats."""
    return carray(_to_floats(table[i, 0]), (table[i, 1] // 6, 6))


@register_jitable
def _ints(table, i):
    """Line i of a table as (size,) integers."""
    return carray(_to_ints(table[i, 0]), (table[i, 1],))


@register_jitable
def unwire(table):
    """Gains, memory and Arrays of a table; the soles' are copies."""
    k = _floats(table, 0)
    g = Gains(
        k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7], k[8], k[9], k[10], k[11], k[12], k[13], k[14], k[15], k[16],
        k[17], k[18],
    )  # fmt: skip
    sole, turned = np.empty((2, 3)), np.empty((2, 9))
    for i in range(2):
        sole[i], turned[i] = _floats(table, 2 + i), _floats(table, 4 + i)
    a = Arrays(
        carray(_to_ints(table[6, 0]), (2, 6)), _ints(table, 7), _ints(table, 8), _ints(table, 9), _ints(table, 10),
        _floats(table, 11), _floats(table, 12), _floats(table, 13), _floats(table, 14), _floats(table, 15),
        _ints(table, 16), _floats(table, 17), _rows(table, 18), _rows(table, 19), sole, turned,
        _floats(table, 20), _floats(table, 21), _floats(table, 22), _floats(table, 23),
    )  # fmt: skip
    return g, _floats(table, 1), a
