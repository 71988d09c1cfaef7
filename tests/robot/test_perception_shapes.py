"""Shape fits and grouping against exact shapes and independent implementations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from teleop_sim.robot.perception import components, console_model, fine, shapes
from teleop_sim.world import console


def test_plane_through_exact_points_is_exact():
    rng = np.random.default_rng(0)
    for yaw in (-2.5, 0.0, 1.0):
        axis, zero, left = console_model.axes(yaw)
        u, v = rng.uniform(-0.2, 0.2, (2, 500))
        points = np.array([1.0, 2.0, 0.8]) + u[:, None] * zero + v[:, None] * left
        towards = -np.array([np.cos(yaw), np.sin(yaw)])
        plane = shapes.fit_sloped_plane(points, towards, rng)
        assert plane.normal == pytest.approx(axis, abs=1e-9)
        assert plane.offset_m == pytest.approx(axis @ [1.0, 2.0, 0.8], abs=1e-9)
        assert plane.share == 1.0
        # A face that slopes away from the robot is none.
        assert shapes.fit_sloped_plane(points, -towards, rng) is None


def test_plane_error_is_that_of_least_squares():
    rng = np.random.default_rng(1)
    axis, zero, left = console_model.axes(0.0)
    u, v = rng.uniform(-0.2, 0.2, (2, 3000))
    points = u[:, None] * zero + v[:, None] * left + rng.normal(0, 0.004, 3000)[:, None] * axis
    plane = shapes.fit_sloped_plane(points, np.array([-1.0, 0.0]), rng)
    # Slope of a regression: sd / (spread sqrt n) = 0.004 / (0.115 * 54.8) = 0.63 mrad; four of them.
    assert np.arccos(min(1.0, plane.normal @ axis)) < 4 * np.sqrt(2) * 0.004 / (0.4 / np.sqrt(12) * np.sqrt(3000))


def test_level_ground_is_no_sloping_face():
    rng = np.random.default_rng(0)
    ground = np.column_stack([rng.uniform(-1, 1, (500, 2)), np.zeros(500)])
    assert shapes.fit_sloped_plane(ground, np.array([-1.0, 0.0]), rng) is None


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_ball_from_the_side_that_is_seen_is_exact(seed):
    rng = np.random.default_rng(seed)
    centre, eye = rng.normal(0, 1, 3), rng.normal(0, 1, 3)
    eye = centre + 1.2 * (eye - centre) / np.linalg.norm(eye - centre)
    out = rng.normal(0, 1, (80, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    out = out[out @ (eye - centre) > 0.3]
    found = shapes.fit_ball(centre + console.KNOB_RADIUS_M * out, console.KNOB_RADIUS_M, eye, rounds=60)
    assert found == pytest.approx(centre, abs=1e-6)


def surface(pose, rng, n=1500):
    """Points of the console's face and discs, which all its fits lean on."""
    axis, zero, left = console_model.axes(pose[3])
    face = console.BLOCKS[3]
    c, s = np.cos(pose[3]), np.sin(pose[3])
    middle = pose[:3] + np.array([c * face.centre[0], s * face.centre[0], face.centre[2]]) + face.half[2] * axis
    u, v = rng.uniform(-1, 1, (2, n)) * np.array([[face.half[0]], [face.half[1]]])
    points = [middle + u[:, None] * zero + v[:, None] * left]
    for centre in console_model.wheel_centres(pose):
        r, a = console.WHEEL_RADIUS_M * np.sqrt(rng.random(n // 2)), rng.uniform(-np.pi, np.pi, n // 2)
        top = centre + console.WHEEL_HALF_THICKNESS_M * axis
        points.append(top + (r * np.cos(a))[:, None] * zero + (r * np.sin(a))[:, None] * left)
    points = np.concatenate(points)
    return points[console_model.distance(pose[None], points)[0] > -1e-6]


@pytest.mark.parametrize("yaw", [-2.0, 0.3])
def test_console_fit_finds_the_pose_that_exact_points_came_from(yaw):
    rng = np.random.default_rng(0)
    pose = np.array([1.0, -2.0, -0.1, yaw])
    points = surface(pose, rng)
    assert np.abs(console_model.distance(pose[None], points)).max() < 1e-9
    starts = pose + np.array([[0.04, -0.03, 0.02, 0.1], [-0.03, 0.02, 0.0, -0.2]])
    found, shares = shapes.fit_console(points, starts, (0.06, 0.03, 0.015), 8)
    # Numerical slopes with a step of 1e-4 leave a tenth of a millimetre.
    assert np.abs(found - pose).max() < 3e-4
    assert (shares == 1.0).all()


def test_distance_is_euclidean_outside_and_the_same_in_every_pose():
    pose = np.array([[0.5, 1.0, -0.1, 0.7]])
    c, s = np.cos(0.7), np.sin(0.7)

    def place(x, y, z):
        return np.array([[0.5 + c * x - s * y, 1.0 + s * x + c * y, z - 0.1]])

    assert console_model.distance(pose, place(0.424, 0.0, 0.5)) == pytest.approx(0.1)  # behind the back
    assert console_model.distance(pose, place(0.15, 0.476, 0.3)) == pytest.approx(0.1)  # beside it
    assert console_model.distance(pose, place(0.15, 0.376 + 0.3, -0.4)) == pytest.approx(0.5)  # 3-4-5 off an edge
    axis, _, _ = console_model.axes(0.7)
    over = console_model.wheel_centres(pose[0])[0] + (console.WHEEL_HALF_THICKNESS_M + 0.05) * axis
    assert console_model.distance(pose, over[None]) == pytest.approx(0.05)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 30), st.lists(st.tuples(st.integers(0, 29), st.integers(0, 29)), max_size=60))
def test_components_equal_scipys(count, edges):
    edges = np.array([(a % count, b % count) for a, b in edges], np.int64).reshape(-1, 2)
    ours = components.components(count, edges)
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), (count, count))
    theirs = connected_components(graph, directed=False)[1]
    assert ((ours[:, None] == ours) == (theirs[:, None] == theirs)).all()


def test_blobs_equal_scipys():
    rng = np.random.default_rng(0)
    for share in (0.05, 0.3, 0.5):
        mask = rng.random((40, 60)) < share
        label, n = ndimage.label(mask, np.ones((3, 3)))
        ours = components.blobs(mask)
        assert sorted(tuple(b) for b in ours) == sorted(tuple(np.flatnonzero(label == i + 1)) for i in range(n))
        assert [len(b) for b in ours] == sorted((len(b) for b in ours), reverse=True)
    assert components.blobs(np.zeros((4, 4), np.bool_)) == []


def test_clusters_join_touching_cubes_and_keep_gaps_of_two_apart():
    rng = np.random.default_rng(0)
    heaps = [at + rng.uniform(0, 0.05, (n, 3)) for at, n in ((0.0, 30), (0.13, 50), (0.3, 10))]
    found = components.clusters(np.concatenate(heaps), 0.03)
    assert [len(c) for c in found] == [50, 30, 10]
    line = np.column_stack([np.arange(100) * 0.029, np.zeros((100, 2))])
    assert len(components.clusters(line, 0.03)) == 1
    assert components.clusters(np.empty((0, 3)), 0.03) == []


def test_few_points_and_no_face_are_said():
    rng = np.random.default_rng(0)
    region, eye = (0.8, 0.8, 0.8), (-1.0, 0.8, 1.6)
    assert fine.detect(np.full((100, 3), 0.8), region, eye, rng) == (None, "few points")
    level = np.column_stack([rng.uniform(0.3, 1.3, (2000, 2)), np.full(2000, 0.8)])
    assert fine.detect(level, region, eye, rng) == (None, "no sloped plane")
