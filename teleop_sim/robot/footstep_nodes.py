"""What a footstep search has met, compiled: states by number, found again through a hash table."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from teleop_sim.robot.law_math import compiled

FIRST_NODES = 4096
"""Few expansions touch few states: the tables begin small and grow by doubling."""


class Nodes(NamedTuple):
    """States met so far, by number, and a hash table of them.

    ``g``: cost of the best way to each; ``v``: what it was when last expanded; ``h``: bound on what is left; ``hint``:
    guess at it; ``closed``: the round in which it was last expanded.
    """

    table: np.ndarray
    keys: np.ndarray
    parent: np.ndarray
    closed: np.ndarray
    g: np.ndarray
    v: np.ndarray
    h: np.ndarray
    hint: np.ndarray


class Found(NamedTuple):
    """How far a search is: states met; the goal's number, -1 if it was not met, and the cost of the way there [s];
    states expanded.
    """

    used: int
    goal_node: int
    best: float
    expanded: int


@compiled
def key_of(i: int, j: int, k: int, foot: int, nj: int, bins: int) -> int:
    """A state as one number."""
    return ((i * nj + j) * bins + k) * 2 + foot


@compiled
def state_of(key: int, nj: int, bins: int) -> tuple[int, int, int, int]:
    """The state i, j, k, foot that a number stands for."""
    return key // (2 * bins * nj), key // (2 * bins) % nj, key // 2 % bins, key % 2


@compiled
def no_nodes() -> Nodes:
    """Room for the first states."""
    n = FIRST_NODES
    return Nodes(
        np.full(4 * n, -1, np.int64), np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64),
        np.empty(n), np.empty(n), np.empty(n), np.empty(n),
    )  # fmt: skip


@compiled
def add(nodes: Nodes, at: int, node: int, key: int, least: float) -> None:
    """A new state in its slot of the hash table, never expanded."""
    nodes.table[at], nodes.keys[node], nodes.v[node], nodes.closed[node], nodes.h[node] = node, key, np.inf, -1, least


@compiled
def slot(table: np.ndarray, keys: np.ndarray, key: int) -> int:
    """Where in the hash table a key is or belongs."""
    mask = table.size - 1
    at = (key * 0x9E3779B1) & mask
    while table[at] >= 0 and keys[table[at]] != key:
        at = (at + 1) & mask
    return at


@compiled
def _hashed(keys: np.ndarray, used: int, size: int) -> np.ndarray:
    """A hash table of so many keys."""
    table = np.full(size, -1, np.int64)
    for n in range(used):
        table[slot(table, keys, keys[n])] = n
    return table


@compiled
def way_to(node: int, nodes: Nodes, nj: int, bins: int) -> np.ndarray:
    """States (m, 4) from the first to the node: i, j, k, foot."""
    length, at = 0, node
    while at >= 0:
        length += 1
        at = nodes.parent[at]
    way = np.empty((length, 4), np.int64)
    at = node
    while at >= 0:
        length -= 1
        way[length, 0], way[length, 1], way[length, 2], way[length, 3] = state_of(nodes.keys[at], nj, bins)
        at = nodes.parent[at]
    return way


@compiled
def grown(nodes: Nodes, used: int) -> Nodes:
    """The same nodes with room for twice as many."""
    size = 2 * nodes.keys.size
    keys = _grown_i8(nodes.keys, size)
    return Nodes(
        _hashed(keys, used, 4 * size), keys, _grown_i8(nodes.parent, size), _grown_i8(nodes.closed, size),
        _grown_f8(nodes.g, size), _grown_f8(nodes.v, size), _grown_f8(nodes.h, size), _grown_f8(nodes.hint, size),
    )  # fmt: skip


@compiled
def _grown_i8(values: np.ndarray, size: int) -> np.ndarray:
    bigger = np.empty(size, np.int64)
    bigger[: values.size] = values
    return bigger


@compiled
def _grown_f8(values: np.ndarray, size: int) -> np.ndarray:
    bigger = np.empty(size)
    bigger[: values.size] = values
    return bigger
