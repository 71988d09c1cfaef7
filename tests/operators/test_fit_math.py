"""The compiled loops against the plain ones."""

from __future__ import annotations

import numpy as np
import pytest

from teleop_sim.operators.fit_math import distances, equations, packed, solved, turned, votes
from teleop_sim.templates.library import library
from teleop_sim.templates.poses import rotation
from teleop_sim.templates.shapes import Box, Disc, Ring, Rod, signed

SOLIDS = {
    "box": (Box((0.1, 0.2, -0.1), (0.3, 0.2, 0.1), (0.3, -0.2, 0.5)),),
    "rod": (Rod((0.0, -0.2, 0.0), (0.1, 0.2, 0.3), 0.05),),
    "ring": (Ring((0.0, 0.1, 0.0), (0.6, 0.0, 0.8), 0.2, 0.03),),
    "disc": (Disc((0.0, 0.1, 0.0), (0.6, 0.0, 0.8), 0.2, 0.03),),
    "all": (
        Box((0.1, 0.2, -0.1), (0.3, 0.2, 0.1)),
        Rod((0.0, -0.2, 0.0), (0.1, 0.2, 0.3), 0.05),
        Ring((0.0, 0.1, 0.0), (0.0, 0.0, 1.0), 0.2, 0.03),
        Disc((0.0, 0.1, 0.0), (1.0, 0.0, 0.0), 0.2, 0.03),
    ),
} | {name: library().named(name).shapes for name in ("DRC_valve", "door", "dish_console", "DRC_drill")}


def points(count=2000):
    """Inside, at and outside of everything."""
    return np.random.default_rng(3).uniform(-1.0, 1.0, (count, 3))


@pytest.mark.parametrize("name", SOLIDS)
def test_distances_are_those_of_the_shapes(name):
    matrix, pivot, middle = rotation((0.4, -0.3, 0.8)), np.array((0.2, 0.1, -0.3)), np.array((0.05, 0.0, 0.1))
    plain, _ = signed(SOLIDS[name], (points() - pivot) @ matrix + middle)
    # Sums of three products of numbers below 2: some ten roundings of 2e-16.
    np.testing.assert_allclose(distances(packed(SOLIDS[name]), points(), matrix, pivot, middle), plain, atol=1e-14)


@pytest.mark.parametrize("name", SOLIDS)
def test_normal_equations_are_the_gradient_s(name):
    shapes, weights = SOLIDS[name], np.linspace(0.5, 2.0, 2000)
    matrix, pivot, middle, scale_m = rotation((0.4, -0.3, 0.8)), np.array((0.2, 0.1, -0.3)), np.zeros(3), 0.05
    off = points() - pivot
    error, way = signed(shapes, off @ matrix + middle)
    slope = -np.concatenate([np.cross(off, way @ matrix.T), way @ matrix.T], axis=1)
    weight = weights / (1.0 + (error / scale_m) ** 2) ** 2
    square, right = equations(packed(shapes), points(), weights, matrix, pivot, middle, scale_m)
    # Sums of 2,000 terms of size 1: rounding grows like their number, 2000 * 2e-16. Where two solids are equally
    # near, either normal is right, and rounding chooses: none of these points is.
    np.testing.assert_allclose(square, (slope * weight[:, None]).T @ slope, atol=1e-12 * 2000)
    np.testing.assert_allclose(right, slope.T @ (weight * error), atol=1e-12 * 2000)


def test_every_plane_gets_the_votes_of_the_points_near_it():
    rng = np.random.default_rng(1)
    normals = rng.standard_normal((20, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    offsets = rng.uniform(-0.5, 0.5, 20)
    plain = (np.abs(points() @ normals.T - offsets) < 0.05).sum(axis=0)
    assert votes(points(), normals, offsets, 0.05).tolist() == plain.tolist()


def test_equations_are_solved_as_by_gauss():
    rows = np.random.default_rng(2).standard_normal((30, 6))
    square, right = rows.T @ rows, np.arange(6.0)
    # A condition below 10: a few roundings.
    np.testing.assert_allclose(solved(square.copy(), right), np.linalg.solve(square, right), rtol=1e-12)


@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.1, -0.2, 0.05), (2.0, 1.0, -1.0)])
def test_a_matrix_is_turned_by_rodrigues(turn):
    matrix = rotation((0.4, -0.3, 0.8))
    np.testing.assert_allclose(turned(np.array(turn), matrix), rotation(turn) @ matrix, atol=1e-15)
