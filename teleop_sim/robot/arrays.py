"""MuJoCo's arrays as the control law reads and writes them."""

from __future__ import annotations

import numpy as np

from teleop_sim.robot.law import Arrays
from teleop_sim.robot.spec import RobotSpec
from teleop_sim.world.plant import Plant


def dofs(plant: Plant) -> dict[str, int]:
    """Place of each joint among the degrees of freedom."""
    return {name: int(plant.model.joint(name).dofadr[0]) for name in plant.joint_names}


def qpos_places(plant: Plant) -> np.ndarray:
    """(nv_robot,) place in ``qpos`` of each of the robot's degrees of freedom; the root's six are not used."""
    model = plant.model
    joints = [int(model.jnt_qposadr[model.dof_jntid[i]]) for i in range(6, plant.nv_robot)]
    return np.array([0] * 6 + joints, np.int64)


def law_arrays(spec: RobotSpec, plant: Plant, touch: np.ndarray) -> Arrays:
    """Views of the plant's arrays, cut to the robot, which comes first; they stay valid as long as the plant.

    Args:
        spec: names the legs. plant: holds the arrays. touch: (2,) where the soles' loads will be written [N].
    """
    model, data, nv = plant.model, plant.data, plant.nv_robot
    dof, foot = dofs(plant), spec.model.description.sole
    sites = [model.site(f"{name}_sole").id for name in (foot.left, foot.right)]
    step = sites[1] - sites[0]
    # Left, then right, whichever the model has first.
    soles = slice(sites[0], sites[1] + (1 if step > 0 else -1) or None, step)
    return Arrays(
        legs=np.array([[dof[name] for name in leg] for leg in spec.legs], np.int64),
        upper=np.array([dof[name] for name in spec.upper], np.int64),
        m_rownnz=model.M_rownnz,
        m_rowadr=model.M_rowadr,
        m_colind=model.M_colind,
        inertia=data.M,
        bias=data.qfrc_bias[:nv],
        passive=data.qfrc_passive[:nv],
        qpos=data.qpos,
        qvel=data.qvel[:nv],
        qposadr=qpos_places(plant),
        com=data.subtree_com[1],
        cdof=data.cdof,
        cdof_dot=data.cdof_dot,
        sole=data.site_xpos[soles],
        sole_rotation=data.site_xmat[soles],
        touch=touch,
        kp=model.actuator_gainprm[: nv - 6, 0].copy(),
        kv=-model.actuator_biasprm[: nv - 6, 2].copy(),
        control=data.ctrl[: nv - 6],
    )
