"""The legs' forward kinematics against Pinocchio's, and the prints of made-up steps and of a run."""

import numpy as np
import pinocchio as pin
import pytest

from teleop_sim.reports.feet import SIDES, Track, description_of, prints, soles
from teleop_sim.robot.kinematics import kinematics_of
from teleop_sim.robot.robots import ROBOTS


@pytest.mark.parametrize("robot", sorted(ROBOTS))
def test_soles_are_where_pinocchio_has_them(robot):
    body, kinematics, rng = description_of(robot), kinematics_of(robot), np.random.default_rng(3)
    n = 20
    pelvis = np.column_stack([rng.uniform(-2.0, 2.0, (n, 3)), rng.normal(size=(n, 4))])
    pelvis[:, 3:] /= np.linalg.norm(pelvis[:, 3:], axis=1, keepdims=True)
    names = kinematics.joint_names
    angles = rng.uniform(-0.5, 0.5, (n, len(names)))
    tracks = soles(body, pelvis, dict(zip(names, angles.T, strict=True)))
    for i in range(n):
        w, x, y, z = pelvis[i, 3:]
        R = pin.Quaternion(w, x, y, z).toRotationMatrix()
        q = kinematics.assemble(R, pelvis[i, :3], kinematics.positions(names), angles[i])
        pin.forwardKinematics(kinematics.model, kinematics.data, q)
        for side, frame in zip(SIDES, kinematics.soles, strict=True):
            sole = pin.updateFramePlacement(kinematics.model, kinematics.data, frame)
            # Rounding of a chain of six joints some metres away.
            np.testing.assert_allclose(tracks[side].place[i], sole.translation, atol=1e-12)
            assert tracks[side].upright[i] == pytest.approx(sole.rotation[2, 2], abs=1e-12)
            assert tracks[side].yaw_rad[i] == pytest.approx(np.arctan2(*sole.rotation[1::-1, 0]), abs=1e-9)


def test_an_unknown_robot_has_no_feet():
    assert description_of("gundam") is None
    assert description_of("../robot/atlas") is None


def steps(count, length_m=0.3, stand=4, swing=3):
    """A foot that stands, swings ahead and stands again: x and z by sample."""
    x, z = [], []
    for i in range(count):
        x += [i * length_m] * stand + [(i + (k + 1) / (swing + 1)) * length_m for k in range(swing)]
        z += [0.0] * stand + [0.05] * swing
    return np.array([*x, count * length_m, count * length_m]), np.array([*z, 0.0, 0.0])


def test_each_stand_is_one_print():
    x, z = steps(5)
    flat = np.ones(len(x))
    walking = Track(np.column_stack([x, 0 * x, z]), 0.1 * flat, flat)
    standing = Track(np.column_stack([0 * x, 0 * x - 0.2, 0 * x]), 0 * flat, flat)
    found = prints(0.2 * np.arange(len(x)), {"left": walking, "right": standing})
    assert [p.x_m for p in found if p.side == "left"] == pytest.approx([0.3 * i for i in range(6)])
    assert [(p.x_m, p.y_m, p.since_s) for p in found if p.side == "right"] == [(0.0, -0.2, 0.0)]
    assert found[1].yaw_rad in (0.0, 0.1)


def test_a_foot_in_the_air_or_on_its_edge_leaves_none():
    flat, still = np.ones(9), np.zeros((9, 3))
    lifted = Track(still + np.array([0.0, 0.0, 0.2]), 0 * flat, flat)
    tipped = Track(still, 0 * flat, 0.5 * flat)
    assert prints(np.arange(9.0), {"left": lifted, "right": tipped}) == []
    assert prints(np.zeros(0), {"left": tipped, "right": tipped}) == []
