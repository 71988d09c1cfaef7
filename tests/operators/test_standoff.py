"""A panel with a handle: where points stand off, and nowhere else."""

from __future__ import annotations

import math

import numpy as np
import pytest

from teleop_sim.channel.messages import VoxelCloud, encode_voxels
from teleop_sim.operators.alignment import LEAST_BORNE, align
from teleop_sim.operators.borne_math import borne_out
from teleop_sim.operators.fitting import fit_template, prepared
from teleop_sim.operators.standoff import borne_share, handle_of
from teleop_sim.templates.library import library
from teleop_sim.templates.poses import Pose, pose_of, rotation
from teleop_sim.templates.shapes import signed

EYE_M = (0.0, 0.0, 1.5)
DOOR = library().named("door")
HANDLE = np.array((-0.06, -0.06, 0.0))


def face(rng, count=3000):
    """Points of the door's face within 0.6 m of the lever's axis, in the door's frame."""
    y, z = rng.uniform((-0.6, -0.6), (0.06, 0.6), (count, 2)).T
    inside = np.hypot(y, z) < 0.6
    return np.stack([np.zeros(count), y, z], axis=1)[inside]


def lever(rng, truth, count=60):
    """Points of the lever's rod that face the eye, in the door's frame; the eye is above and before."""
    way = np.array(EYE_M) - truth.place(HANDLE)
    way = truth.matrix.T @ way
    angle, along = rng.uniform(0.0, math.tau, 4 * count), rng.uniform(-0.12, 0.0, 4 * count)
    normal = np.stack([np.cos(angle), np.zeros(4 * count), np.sin(angle)], axis=1)
    points = np.array((-0.06, 0.0, 0.0)) + 0.01 * normal + np.outer(along, (0.0, 1.0, 0.0))
    return points[normal @ way > 0.0][:count]


def cloud(truth, noise_m, rng, voxel_m=0.02, with_lever=True):
    """As it arrives; errors along the rays."""
    parts = [face(rng), lever(rng, truth)] if with_lever else [face(rng)]
    points = truth.place(np.concatenate(parts))
    rays = points - np.array(EYE_M)
    points = points + noise_m * rng.standard_normal((len(points), 1)) * rays / np.linalg.norm(rays, axis=1)[:, None]
    return VoxelCloud.decode(encode_voxels(points, voxel_m).encode())


def drawn(rng):
    """A door as the laboratory has it: 0.7 m ahead, a little to the left."""
    x, y = rng.uniform((0.65, 0.2), (0.75, 0.35))
    return Pose((float(x), float(y), 1.016), (0.0, 0.0, float(rng.uniform(-0.1, 0.1))))


@pytest.mark.parametrize("voxel_m", [0.01, 0.02])
def test_every_door_is_laid_on_its_lever(voxel_m):
    for seed in range(25):
        rng = np.random.default_rng([11, seed])
        truth = drawn(rng)
        laid = align(DOOR, cloud(truth, 0.01, rng, voxel_m), EYE_M, rng)
        # What a grasp forgives; a person's own residual is half a centimetre in each direction.
        assert np.linalg.norm(laid.pose.place(HANDLE) - truth.place(HANDLE)) < 0.03, seed
        assert math.acos(min(1.0, float(laid.pose.matrix[:, 0] @ truth.matrix[:, 0]))) < math.radians(5.0)
        assert laid.fit.borne >= LEAST_BORNE


def test_the_face_lies_where_its_points_are_and_not_before_them():
    # Points behind the face belong to it: else they would draw the panel's back, 4 cm behind, to them.
    errors = []
    for seed in range(20):
        rng = np.random.default_rng([12, seed])
        truth = drawn(rng)
        seen = prepared(DOOR, cloud(truth, 0.01, rng).centres_m(), 0.02, rng, EYE_M)
        errors.append(truth.inverse().place(fit_template(DOOR, seen, truth).pose.place(HANDLE))[0] - HANDLE[0])
    # 2,000 points of 1 cm and a voxel's 0.6 cm: 0.03 cm; how voxels lie along the face adds to it.
    assert abs(float(np.mean(errors))) < 0.001
    assert float(np.std(errors)) < 0.002


def test_a_door_that_is_seen_from_the_side_is_laid_parallel_to_its_face():
    for seed in range(10):
        rng = np.random.default_rng([18, seed])
        truth = Pose((1.5, float(rng.uniform(-0.2, 0.2)), 1.016), (0.0, 0.0, 0.4 if seed % 2 else -0.4))
        laid = align(DOOR, cloud(truth, 0.01, rng), EYE_M, rng)
        assert np.linalg.norm(laid.pose.place(HANDLE) - truth.place(HANDLE)) < 0.03, seed
        assert math.acos(min(1.0, float(laid.pose.matrix[:, 0] @ truth.matrix[:, 0]))) < math.radians(5.0)


def test_a_door_without_a_lever_is_not_borne_out():
    for seed in range(10):
        rng = np.random.default_rng([13, seed])
        laid = align(DOOR, cloud(drawn(rng), 0.003, rng, with_lever=False), EYE_M, rng)
        assert laid.fit.borne < LEAST_BORNE


def test_the_pose_follows_the_cloud_wherever_it_is():
    # A sensor that is mounted wrong shifts and turns all that it sees; nothing else is known.
    for seed in range(10):
        rng = np.random.default_rng([14, seed])
        truth = drawn(rng)
        wrong = pose_of(np.array((0.05, -0.04, 0.03)), rotation((0.0, 0.0, 0.05)))
        points = wrong.place(cloud(truth, 0.003, rng, 0.01).centres_m())
        laid = align(DOOR, VoxelCloud.decode(encode_voxels(points, 0.01).encode()), EYE_M, rng)
        assert np.linalg.norm(laid.pose.place(HANDLE) - wrong.place(truth.place(HANDLE))) < 0.03


def test_a_laying_far_beside_the_lever_is_taken_to_it():
    rng = np.random.default_rng(15)
    truth = drawn(rng)
    near = pose_of(truth.place(np.array((0.0, 0.3, 0.3))), truth.matrix)
    laid = align(DOOR, cloud(truth, 0.003, rng), EYE_M, rng, near=near)
    assert np.linalg.norm(laid.pose.place(HANDLE) - truth.place(HANDLE)) < 0.03


def test_only_panels_with_a_handle_have_one():
    assert [t.name for t in library().templates if handle_of(t) is not None] == ["door"]


def test_samples_lie_on_the_handle_clear_of_the_face():
    handle = handle_of(DOOR)
    distance, _ = signed(DOOR.shapes[1:], handle.points)
    np.testing.assert_allclose(distance, 0.0, atol=1e-9)
    # Outward: a step along them is a step away.
    away = signed(DOOR.shapes[1:], handle.points + 1e-3 * handle.normals)[0]
    assert away.min() > 0.0
    # But where one rod meets the other.
    assert np.mean(np.abs(away - 1e-3) < 1e-6) > 0.95
    assert signed(DOOR.shapes[:1], handle.points)[0].min() > 0.03
    assert 50 <= len(handle.points) <= 64


def test_bearing_out_is_the_plain_formula():
    rng = np.random.default_rng(16)
    samples, points, shift = rng.uniform(-1, 1, (20, 3)), rng.uniform(-1, 1, (15, 3)), np.array((0.1, 0.0, -0.2))
    normals = rng.standard_normal((20, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    matrix, eye, scale_m = rotation((0.4, -0.3, 0.8)), np.array((0.0, -3.0, 1.0)), 0.4
    placed, facing = samples @ matrix.T + shift, normals @ matrix.T
    placed = placed[np.einsum("ij,ij->i", facing, eye - placed) > 0.0]
    apart = np.linalg.norm(placed[:, None] - points[None], axis=2)
    far = [(apart.min(axis=k) / scale_m) ** 2 for k in (1, 0)]
    plain = [float(np.mean(f / (1.0 + f))) for f in far]
    found = borne_out(samples, normals, points, matrix, shift, eye, scale_m)
    # Sums of some twenty numbers below 1.
    assert found == pytest.approx((*plain, float(np.mean(apart.min(axis=1) <= scale_m))), abs=1e-13)
    assert borne_out(samples, normals, np.zeros((0, 3)), matrix, shift, eye, scale_m) == (1.0, 1.0, 0.0)


def test_a_handle_in_its_points_is_all_there():
    rng = np.random.default_rng(17)
    truth = drawn(rng)
    seen = prepared(DOOR, cloud(truth, 0.0, rng, 0.01).centres_m(), 0.01, rng, EYE_M)
    assert borne_share(handle_of(DOOR), seen, truth) == 1.0
    beside = pose_of(truth.place(np.array((0.0, -0.3, 0.0))), truth.matrix)
    assert borne_share(handle_of(DOOR), seen, beside) == 0.0
