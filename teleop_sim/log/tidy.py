"""Columns made tidy: pandas types, times as timedeltas, text of few kinds as categories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from teleop_sim.log.columns import Column, Ragged, Words

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

FREE_TEXT = frozenset({"text", "note", "cause", "scenario_toml", "versions", "field/episode.command"})
"""Fields of text that may be anything; all others have few kinds and become categories."""

PARTS = {
    "pelvis": ("pelvis_x", "pelvis_y", "pelvis_z", "pelvis_qw", "pelvis_qx", "pelvis_qy", "pelvis_qz"),
    "claimed": ("claimed_x_m", "claimed_y_m", "claimed_z_m"),
    "true": ("true_x_m", "true_y_m", "true_z_m"),
}
"""Fields of numbers that become a column a number. Others keep a tuple a cell."""

_NANOSECONDS = 1e9
_LONGEST_NS = float(2**62)
"""146 years: of two times within it the difference is a timedelta too."""


def free_fields(topic: str) -> frozenset[str]:
    """Names of a topic's fields of text that may be anything, so that they stay text."""
    return FREE_TEXT | {name.removeprefix(f"{topic}.") for name in FREE_TEXT}


def tidy(topic: str, columns: Mapping[str, Column], times_ns: NDArray[np.int64]) -> pd.DataFrame:
    """A frame of one row a record, in the order of the log.

    Columns: the record's fields in their order; after ``t_s`` also ``t``, the log's time, exact; after ``start_s`` also
    ``took``, the time from then to ``t_s``.
    """
    import pandas as pd

    made: dict[str, Any] = {}
    free = free_fields(topic)
    for name, column in columns.items():
        if isinstance(column, Ragged):
            made |= _parted(name, column)
        elif isinstance(column, np.ndarray):
            made[name] = column
        else:
            made[name] = free_text(column) if name in free else categories(column)
        if name == "t_s":
            made["t"] = timedeltas(times_ns)
        elif name == "start_s":
            made["took"] = lasted(column, columns["t_s"])
    return pd.DataFrame(made, copy=False)


def timedeltas(times_ns: NDArray[np.int64]) -> NDArray[np.timedelta64]:
    """Times of messages as timedeltas; beyond 292 years: not a time."""
    made = times_ns.view("timedelta64[ns]")
    return np.where(times_ns < 0, np.timedelta64("NaT", "ns"), made) if (times_ns < 0).any() else made


def lasted(start_s: NDArray[np.float64], end_s: NDArray[np.float64]) -> NDArray[np.timedelta64]:
    """From start to end, each to the nanosecond; not a time where either is unknown."""
    return from_seconds(end_s) - from_seconds(start_s)


def from_seconds(times_s: NDArray[np.float64]) -> NDArray[np.timedelta64]:
    """Seconds as timedeltas, rounded to the nanosecond as the log's times are; what is no time is NaT."""
    with np.errstate(over="ignore"):
        ns = np.rint(times_s * _NANOSECONDS)
    known = np.abs(ns) < _LONGEST_NS  # false for NaN
    whole = np.where(known, ns, 0.0).astype(np.int64).view("timedelta64[ns]")
    return np.where(known, whole, np.timedelta64("NaT", "ns"))


def free_text(column: pa.ChunkedArray) -> Any:
    """Text as it is."""
    import pandas as pd

    return pd.array(column, dtype="str")


def categories(column: Words | pa.ChunkedArray) -> pd.Categorical:
    """Text of few kinds: categories in the order of the alphabet."""
    import pandas as pd

    made = column if isinstance(column, Words) else _counted_out(column)
    order = sorted(range(len(made.words)), key=made.words.__getitem__)
    place = np.empty(len(order), dtype=np.int32)
    place[order] = np.arange(len(order))
    dtype = pd.CategoricalDtype(pd.Index([made.words[i] for i in order], dtype="str"))
    return pd.Categorical.from_codes(place[made.codes], dtype=dtype, validate=False)


def _counted_out(column: pa.ChunkedArray) -> Words:
    encoded = column.dictionary_encode()
    words = encoded.chunk(0).dictionary.to_pylist() if encoded.num_chunks else []
    codes = [np.asarray(chunk.indices) for chunk in encoded.chunks]
    return Words(tuple(words), np.concatenate(codes) if codes else np.zeros(0, dtype=np.int32))


def matrix(parts: Sequence[tuple[Ragged, int]], rows: int, before: int = 0) -> NDArray[np.float64]:
    """Columns of numbers side by side, so many of each; ``before`` columns are left for others."""
    made = np.empty((rows, before + sum(width for _, width in parts)), dtype=np.float64)
    at = before
    for column, width in parts:
        column.write(made, at, width)
        at += width
    return made


def _parted(name: str, column: Ragged) -> dict[str, Any]:
    if name not in PARTS:
        cells = np.empty(len(column.counts), dtype=object)
        cells[:] = column.tuples()
        return {name: cells}
    names = PARTS[name]
    values = matrix([(column, len(names))], len(column.counts))
    return dict(zip(names, values.T, strict=True))
