"""Connected components, of pixels and of points, in plain numpy (importing scipy.ndimage costs a run 0.2 s)."""

from __future__ import annotations

from itertools import product

import numpy as np
import numpy.typing as npt

from teleop_sim.robot.perception.rays import Bools, Floats

Index = npt.NDArray[np.int64]


def components(count: int, edges: Index) -> Index:
    """Label the nodes of a graph.

    Args:
        count: number of nodes.
        edges: (m, 2) pairs of nodes.

    Returns:
        (count,) for each node the smallest node that it is connected to.

    Method: hook roots to smaller roots, then shorten all paths, until no edge joins two labels
    (Shiloach and Vishkin, J. Algorithms 3 (1982), 57-67).

    """
    label = np.arange(count)
    while True:
        ends = label[edges]
        low, high = ends.min(axis=1), ends.max(axis=1)
        if np.array_equal(low, high):
            return label
        np.minimum.at(label, high, low)
        while not np.array_equal(label[label], label):
            label = label[label]


def blobs(mask: Bools) -> list[Index]:
    """Pixels of each 8-connected blob of a mask (height, width): flat indices, ascending; largest blob first."""
    pixels = np.flatnonzero(mask)
    if not len(pixels):
        return []
    # A border spares tests at the image's edges.
    wide = mask.shape[1] + 2
    number = np.full((mask.shape[0] + 2) * wide, -1, np.int64)
    own = (pixels // mask.shape[1] + 1) * wide + pixels % mask.shape[1] + 1
    number[own] = np.arange(len(pixels))
    edges = []
    for step in (1, wide - 1, wide, wide + 1):
        other = number[own + step]
        edges.append(np.stack([np.flatnonzero(other >= 0), other[other >= 0]], axis=1))
    return [pixels[group] for group in _groups(components(len(pixels), np.concatenate(edges)))]


def clusters(points: Floats, gap_m: float) -> list[Floats]:
    """Points (n, 3) in groups that a cube grid of ``gap_m`` joins through touching cubes; largest group first."""
    if not len(points):
        return []
    cube = np.floor((points - points.min(axis=0)) / gap_m).astype(np.int64) + 1
    span = cube.max(axis=0) + 2
    code = (cube[:, 0] * span[1] + cube[:, 1]) * span[2] + cube[:, 2]
    cells, of_point = np.unique(code, return_inverse=True)
    edges = []
    for dx, dy, dz in product((-1, 0, 1), repeat=3):
        shift = (dx * span[1] + dy) * span[2] + dz
        if shift > 0:
            at = np.minimum(np.searchsorted(cells, cells + shift), len(cells) - 1)
            found = np.flatnonzero(cells[at] == cells + shift)
            edges.append(np.stack([found, at[found]], axis=1))
    label = components(len(cells), np.concatenate(edges))
    return [points[group] for group in _groups(label[of_point])]


def _groups(label: Index) -> list[Index]:
    """Members of each label, largest group first, then by label."""
    order = np.argsort(label, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    return sorted(parts, key=lambda part: (-len(part), int(part[0])))
