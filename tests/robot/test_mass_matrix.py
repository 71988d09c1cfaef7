"""Two libraries, one robot: MuJoCo's and Pinocchio's dynamics of the same description agree.

MuJoCo moves the robot, Pinocchio plans for it. Joints are matched by name. MuJoCo gives the pelvis' linear velocity in
the world's axes, Pinocchio in the pelvis' own; both give its angular velocity in the pelvis' axes. With R the pelvis'
rotation, v_pin = T v_mj, T = diag(R', 1, permutation), so M_mj = T' M_pin T.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from teleop_sim.robot.kinematics import Kinematics, build
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.spec import RobotSpec
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import Plant

NAMES = sorted(ROBOTS)
POSTURES = 10
AGREE = 1e-8
"""The issue's bound, on entries up to some 180 kg or kg m^2: rounding of double precision leaves 1e-13."""


@dataclass(frozen=True)
class Twins:
    """One robot in both libraries."""

    spec: RobotSpec
    plant: Plant
    kinematics: Kinematics

    @classmethod
    def of(cls, spec: RobotSpec) -> Twins:
        return cls(spec, Plant(spec.model, BareFloor()), build(spec))

    @property
    def dofs(self) -> np.ndarray:
        """MuJoCo's degrees of freedom in Pinocchio's order; a jaw has none there."""
        joints = [int(self.plant.model.joint(name).dofadr[0]) for name in self.kinematics.joint_names]
        return np.array([*range(6), *joints])

    def pose(self, rng: np.random.Generator, speed: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Put both into one random posture anywhere within the joints' limits; Pinocchio's q and v."""
        data, kin = self.plant.data, self.kinematics
        quat = rng.normal(size=4)
        quat /= np.linalg.norm(quat)
        angles = rng.uniform(kin.lower, kin.upper)
        position = rng.uniform(-2.0, 2.0, 3)
        data.qpos[:7] = [*position, *quat]
        for name, angle in zip(kin.joint_names, angles, strict=True):
            self.plant.set_angle(name, float(angle))
        data.qvel[:] = 0.0
        data.qvel[self.dofs] = speed * rng.normal(size=len(self.dofs))
        mujoco.mj_forward(self.plant.model, data)
        rotation = pin.Quaternion(np.array([*quat[1:], quat[0]])).toRotationMatrix()
        q = kin.assemble(rotation, position, kin.positions(kin.joint_names), angles)
        return q, self.to_pin(rotation) @ data.qvel[self.dofs]

    def to_pin(self, rotation: np.ndarray) -> np.ndarray:
        """T of the docstring above."""
        T = np.eye(len(self.dofs))
        T[:3, :3] = rotation.T
        return T

    def mass_matrix(self) -> np.ndarray:
        """MuJoCo's, in Pinocchio's order, without the motors' armature, which Pinocchio is not told."""
        model, data = self.plant.model, self.plant.data
        full = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, full)
        full -= np.diag(model.dof_armature)
        return full[np.ix_(self.dofs, self.dofs)]


@pytest.fixture(scope="module", params=NAMES)
def bare(request) -> Twins:
    """The robot without its hands, whose four bars Pinocchio takes for one cylinder."""
    spec = ROBOTS[request.param]()
    return Twins.of(replace(spec, model=replace(spec.model, hands=())))


@pytest.fixture(scope="module", params=NAMES)
def whole(request) -> Twins:
    return Twins.of(ROBOTS[request.param]())


def rotation_of(twins: Twins) -> np.ndarray:
    return twins.plant.data.body(1).xmat.reshape(3, 3).copy()


def pin_mass_matrix(kin: Kinematics, q: np.ndarray) -> np.ndarray:
    M = pin.crba(kin.model, kin.data, q)
    return np.triu(M) + np.triu(M, 1).T


@pytest.mark.parametrize("seed", range(POSTURES))
def test_mass_matrices_agree(bare, seed):
    q, _ = bare.pose(np.random.default_rng(seed))
    T = bare.to_pin(rotation_of(bare))
    expected = T.T @ pin_mass_matrix(bare.kinematics, q) @ T
    assert np.abs(bare.mass_matrix() - expected).max() < AGREE


@pytest.mark.parametrize("seed", range(POSTURES))
def test_centres_of_mass_agree(whole, seed):
    q, _ = whole.pose(np.random.default_rng(seed))
    com = whole.kinematics.centre_of_mass(q)
    assert np.abs(whole.plant.data.subtree_com[1] - com).max() < AGREE


@pytest.mark.parametrize("seed", range(POSTURES))
def test_gravity_torques_agree(whole, seed):
    q, _ = whole.pose(np.random.default_rng(seed))
    kin, T = whole.kinematics, whole.to_pin(rotation_of(whole))
    expected = T.T @ pin.computeGeneralizedGravity(kin.model, kin.data, q)
    # At rest MuJoCo's bias is gravity alone; a jaw of the open cage weighs on its own slide only.
    assert np.abs(whole.plant.data.qfrc_bias[whole.dofs] - expected).max() < AGREE


@pytest.mark.parametrize("seed", range(POSTURES))
def test_centrifugal_and_coriolis_torques_agree(bare, seed):
    q, v = bare.pose(np.random.default_rng(seed), speed=0.5)
    kin, T = bare.kinematics, bare.to_pin(rotation_of(bare))
    # With no acceleration in MuJoCo's coordinates, Pinocchio's still has that of its turning axes.
    turning = np.zeros(len(v))
    turning[:3] = -np.cross(v[3:6], v[:3])
    expected = T.T @ pin.rnea(kin.model, kin.data, q, v, turning)
    assert np.abs(bare.plant.data.qfrc_bias[bare.dofs] - expected).max() < AGREE


@pytest.mark.parametrize("seed", range(3))
def test_frames_agree(whole, seed):
    q, _ = whole.pose(np.random.default_rng(seed))
    kin, plant = whole.kinematics, whole.plant
    pin.forwardKinematics(kin.model, kin.data, q)
    sole = whole.spec.model.description.sole
    for foot, frame in zip((sole.left, sole.right), kin.soles, strict=True):
        placement = pin.updateFramePlacement(kin.model, kin.data, frame)
        assert np.abs(plant.site(f"{foot}_sole").position - placement.translation).max() < AGREE
    for side in kin.tools:
        rotation, position = kin.tool_pose(q, side)
        assert np.abs(plant.site(f"{side}Tcp").position - position).max() < AGREE
        assert np.abs(plant.site(f"{side}Tcp").rotation - rotation).max() < AGREE


@pytest.mark.parametrize("seed", range(3))
def test_a_hand_taken_for_a_cylinder_changes_next_to_nothing(whole, seed):
    """Pinocchio sees a cage's four bars as one cylinder: right in mass and centre, a little off in inertia."""
    q, _ = whole.pose(np.random.default_rng(seed))
    T = whole.to_pin(rotation_of(whole))
    off = np.abs(whole.mass_matrix() - T.T @ pin_mass_matrix(whole.kinematics, q) @ T)
    # Measured 3.4e-4 kg m^2: four bars of 20 g some 6 cm from their middle are 2.9e-4.
    assert off.max() < 5e-4
