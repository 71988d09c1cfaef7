"""Sets of voxels as bytes: breadth-first octree occupancy, then raw deflate.

Why deflate (``zlib``, level 9, no header) and not Zstandard: on clouds of one region the two come within 4 % of each
other (tests/channel/test_voxels.py has the surface), Zstandard's frame costs 6 bytes or more that a 10-byte cloud
would not want, and zlib is in the standard library.

Bits are never damaged on this link, so there is no checksum; bytes that are no octree are told apart all the same.

Source of the method: Meagher, Computer Graphics and Image Processing 19 (1982), 129-147 (octree encoding); one byte
of occupancy a node, breadth first, as in Schnabel and Klein, Symp. Point-Based Graphics (2006), 111-120, without their
prediction.
"""

from __future__ import annotations

import zlib

import numpy as np

from teleop_sim.channel.codec import BadMessage

DEPTH_MAX = 16
"""Levels of the tree: a cloud is at most 65,536 voxels long."""

OCCUPANCY_MAX = 1 << 18
"""Most occupancy bytes: a short message cannot unpack to gigabytes (assumed: more than a room at 1 cm)."""

_BITS = np.arange(8)


def voxel_indices(points_m: np.ndarray, voxel_m: float) -> np.ndarray:
    """Distinct voxels (v, 3) int64 that hold points (n, 3) [m]; voxel ``k`` spans ``k`` to ``k + 1`` voxel sizes.

    Raises:
        BadMessage: points of another shape, or not finite.

    """
    if points_m.ndim != 2 or points_m.shape[1] != 3:
        raise BadMessage("voxel_cloud", f"points of shape {points_m.shape}", "Give points of shape (n, 3).")
    # 2**31 voxels are far outside every message; beyond 2**63 the conversion would not be defined.
    if not np.all(np.abs(points_m) < voxel_m * 2.0**31):
        raise BadMessage("voxel_cloud", "a point is not finite or too far away", "Give finite points near the origin.")
    return np.unique(np.floor(points_m / voxel_m).astype(np.int64), axis=0).reshape(-1, 3)


def depth_of(cells: np.ndarray) -> int:
    """Levels that an octree needs for cells (v, 3) >= 0: none without cells, one for a single cell."""
    return max(int(cells.max()).bit_length(), 1) if len(cells) else 0


def octree_bytes(cells: np.ndarray, depth: int) -> bytes:
    """Occupancy of an octree, breadth first: a byte a node, whose bit ``i`` says that child ``i`` holds cells.

    Args:
        cells: (v, 3) int64, from 0 to ``2**depth - 1``; child ``i`` has x in bit 0, y in bit 1, z in bit 2.
        depth: levels.

    """
    codes = _morton(cells, depth)
    levels = [_level(codes >> (3 * (depth - level - 1))) for level in range(depth)]
    return b"".join(levels)


def octree_cells(occupancy: bytes, depth: int, where: str) -> np.ndarray:
    """Inverse of ``octree_bytes``: the cells (v, 3) int64 in Morton order.

    Raises:
        BadMessage: no octree of this depth: a byte too few or too many, or a node without children.

    """
    codes, at = np.zeros(min(depth, 1), np.int64), 0
    for _ in range(depth):
        node = np.frombuffer(occupancy[at : at + len(codes)], np.uint8)
        if len(node) < len(codes) or not node.all():
            raise BadMessage(where, f"{len(occupancy)} bytes are no octree of depth {depth}", "Use encode_voxels.")
        at += len(node)
        codes = (codes[:, None] * 8 + _BITS)[(node[:, None] >> _BITS) & 1 == 1]
    if at != len(occupancy):
        raise BadMessage(where, f"{len(occupancy) - at} bytes after an octree of depth {depth}", "Use encode_voxels.")
    return _unmorton(codes, depth)


def deflate(data: bytes) -> bytes:
    """Raw deflate at its best level; the same bytes for one build of zlib."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS, 9)
    return packer.compress(data) + packer.flush()


def inflate(data: bytes, where: str) -> bytes:
    """Inverse of ``deflate``.

    Raises:
        BadMessage: the bytes are cut off, damaged, followed by more, or unpack to over ``OCCUPANCY_MAX`` bytes.

    """
    unpacker = zlib.decompressobj(-zlib.MAX_WBITS)
    try:
        # One more: at the limit itself the decompressor has not yet seen the end.
        unpacked = unpacker.decompress(data, OCCUPANCY_MAX + 1)
    except zlib.error as error:
        raise BadMessage(where, f"{len(data)} bytes do not unpack: {error}", "Send it again.") from None
    if len(unpacked) > OCCUPANCY_MAX:
        raise BadMessage(where, f"an octree of more than {OCCUPANCY_MAX} bytes", "Cut it, or take larger voxels.")
    if not unpacker.eof or unpacker.unused_data:
        raise BadMessage(where, f"{len(data)} bytes are not one packed whole", "Send it again.")
    return unpacked


def sample_points() -> np.ndarray:
    """Points (n, 3) [m] on a desk with a wheel, 7 mm apart, for examples and tables; drawn by formula.

    The desk is 1.2 x 0.5 m, tilted by 30°, and has a front. Heights are off by up to 5 mm, as if at random: the error
    of a laser (uniform, of the standard deviation of 3 mm; assumed).
    """
    x, v = (w.ravel() for w in np.meshgrid(np.arange(-0.6, 0.6, 0.007), np.arange(0.0, 0.7, 0.007)))
    # Fract of a steep sine: scatter without a random generator, so the same everywhere.
    tilted, lift = v > 0.2, 0.01 * ((np.sin(x * 1299.8 + v * 7823.3) * 43758.5) % 1.0 - 0.5)
    y = np.where(tilted, (v - 0.2) - 0.25, -0.25)
    z = np.where(tilted, 0.75 + (v - 0.2) * 0.577, 0.55 + v) + lift
    a, b = (w.ravel() for w in np.meshgrid(np.arange(0.0, 6.28, 0.05), np.arange(0.0, 6.28, 0.5)))
    ring = 0.15 + 0.02 * np.cos(b)
    wheel = np.stack([ring * np.cos(a), ring * np.sin(a), 1.0 + 0.02 * np.sin(b)], axis=1)
    return np.concatenate([np.stack([x, y, z], axis=1), wheel])


def _level(codes: np.ndarray) -> bytes:
    """Occupancy bytes of the nodes above these sorted codes."""
    below = np.unique(codes)
    _, first = np.unique(below >> 3, return_index=True)
    return np.bitwise_or.reduceat((1 << (below & 7)).astype(np.uint8), first).tobytes()


def _morton(cells: np.ndarray, depth: int) -> np.ndarray:
    """Interleave the bits of x, y, z, sorted."""
    codes = np.zeros(len(cells), np.int64)
    for bit in range(depth):
        for axis in range(3):
            codes |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.sort(codes)


def _unmorton(codes: np.ndarray, depth: int) -> np.ndarray:
    cells = np.zeros((len(codes), 3), np.int64)
    for bit in range(depth):
        for axis in range(3):
            cells[:, axis] |= ((codes >> (3 * bit + axis)) & 1) << bit
    return cells
