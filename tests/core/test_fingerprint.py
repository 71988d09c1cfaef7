"""A fingerprint tells values apart bit for bit, and is the same in every process."""

import enum
import math
import struct
import subprocess
import sys
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.core.fingerprint import fingerprint


@dataclass(frozen=True)
class Point:
    x: float
    y: float = 0.0


@dataclass(frozen=True)
class Other:
    x: float
    y: float = 0.0


@dataclass(frozen=True, slots=True)
class Slotted:
    x: float


class Plain:
    def __init__(self, x):
        self.x = x


class Colour(enum.Enum):
    RED = 1
    BLUE = 2


DIFFERENT = [
    None, True, False, 0, 1, 10, 0.0, -0.0, 1.0, math.inf, math.nan, math.nextafter(1.0, 2.0), "", "1", "None", b"",
    b"1", (), ((),), ((), ()), (1.0,), (1,), (1.0, 2.0), ((1.0,), 2.0), ("ab", "c"), ("a", "bc"), (b"ab",), {},
    {"a": 1},
    {"a": 2}, {"a": 1, "b": 2}, {"b": 1, "a": 2}, frozenset(), frozenset({1}), frozenset({1, 2}), Point(1.0), Point(1),
    Point(0.0, 1.0), Other(1.0), Slotted(1.0), Plain(1.0), Plain(2.0), Colour.RED, Colour.BLUE, Colour, Point, len,
    math.sqrt, np.zeros(2), np.zeros((2, 1)), np.zeros((1, 2)), np.zeros(2, np.float32), np.zeros(2, np.int64),
    np.array([0.0, -0.0]), np.array([]), np.float32(1.0), np.int64(1), np.bool_(True),
]  # fmt: skip


def test_what_differs_has_another_fingerprint():
    digests = [fingerprint(value) for value in DIFFERENT]
    assert len(set(digests)) == len(DIFFERENT)
    assert {len(digest) for digest in digests} == {32}


@pytest.mark.parametrize(
    ("one", "same"),
    [
        ([1.0, "a"], (1.0, "a")),
        (np.float64(0.1), 0.1),
        ((np.float64(0.1), 0.2), (0.1, 0.2)),
        ({"a": 1, "b": (2,)}, {"b": (2,), "a": 1}),
        ({3, 1, 2}, frozenset({1, 2, 3})),
        (np.arange(6.0).reshape(2, 3).T, np.array([[0.0, 3.0], [1.0, 4.0], [2.0, 5.0]])),
        (np.arange(10.0)[::2], np.array([0.0, 2.0, 4.0, 6.0, 8.0])),
    ],
)
def test_what_is_equal_has_the_same_fingerprint_however_it_is_stored(one, same):
    assert fingerprint(one) == fingerprint(same)


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text() | st.binary(),
    lambda parts: st.lists(parts, max_size=4).map(tuple) | st.dictionaries(st.text(max_size=3), parts, max_size=3),
    max_leaves=12,
)


def exact(value):
    """The value with its types and bits in plain sight."""
    if isinstance(value, tuple):
        return tuple(exact(x) for x in value)
    if isinstance(value, dict):
        return {key: exact(x) for key, x in value.items()}
    return (type(value), struct.pack("<d", value) if isinstance(value, float) else value)


@given(VALUES, VALUES)
def test_fingerprints_are_equal_exactly_if_values_are(a, b):
    assert (fingerprint(a) == fingerprint(b)) == (exact(a) == exact(b))
    assert fingerprint(a, b) != fingerprint((a, b))


@pytest.mark.parametrize(
    "value", [lambda: 0, (x for x in ()), np.array([None]), np.random.default_rng(1), object(), slice(1)]
)
def test_what_is_no_value_is_refused(value):
    with pytest.raises(TypeError, match="fingerprint"):
        fingerprint((1.0, value))


def test_another_process_finds_the_same():
    value = {"b": frozenset({"x", "y", "z"}), "a": (1.5, None, True)}
    code = "import sys; from teleop_sim.core.fingerprint import fingerprint; print(fingerprint(%r).hex())"
    there = subprocess.run([sys.executable, "-c", code % value], capture_output=True, text=True, check=True).stdout
    assert there.strip() == fingerprint(value).hex()
