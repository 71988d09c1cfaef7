"""The walkway's pieces: together they are the published tiles, and no two of them overlap."""

import math

import numpy as np
import pytest

from teleop_sim.world import dish_layout as lay
from teleop_sim.world.dish_ground import corners, cut, pieces
from teleop_sim.world.dish_layout import LAYOUT_IDS, Slab


def polygon(piece):
    return np.array(corners(piece) if isinstance(piece, Slab) else piece)


def area_m2(points):
    """Shoelace formula."""
    x, y = points.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def holds(points, spots, margin=0.0):
    """Which spots (n, 2) lie in a convex polygon listed anticlockwise, at least ``margin`` from its edges."""
    edges = np.roll(points, -1, axis=0) - points
    edges /= np.linalg.norm(edges, axis=1, keepdims=True)
    off = spots[:, None, :] - points[None]
    return (edges[:, 0] * off[..., 1] - edges[:, 1] * off[..., 0] > margin).all(1)


@pytest.mark.parametrize("layout_id", LAYOUT_IDS)
def test_pieces_cover_what_the_slabs_cover_and_nothing_twice(layout_id):
    layout = lay.layout(layout_id)
    found = [polygon(piece) for piece in pieces(layout)]
    assert len(found) == len(layout.slabs)
    assert min(area_m2(p) for p in found) > 0.3
    rng = np.random.default_rng(layout_id)
    low, high = np.vstack(found).min(0) - 0.5, np.vstack(found).max(0) + 0.5
    spots = rng.uniform(low, high, (20_000, 2))
    on_slab = np.zeros(len(spots), bool)
    for slab in layout.slabs:
        on_slab |= holds(polygon(slab), spots)
    on_piece = np.array([holds(p, spots) for p in found])
    assert np.array_equal(on_piece.any(0), on_slab)
    # A micrometre from the edges: neighbours share theirs.
    assert np.array([holds(p, spots, 1e-6) for p in found]).sum(0).max() <= 1


def test_a_square_cut_through_its_middle_leaves_half():
    square = corners(Slab((0.0, 0.0, 0.3), 1.0, 1.0))
    half = cut(square, (0.0, 0.0), (math.cos(1.1), math.sin(1.1)))
    assert area_m2(np.array(half)) == pytest.approx(2.0)
    assert cut(square, (5.0, 0.0), (1.0, 0.0)) == square
    assert cut(square, (-5.0, 0.0), (1.0, 0.0)) == ()
