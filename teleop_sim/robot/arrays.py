"""MuJoCo's arrays as the control law reads and writes them."""

from __future__ import annotations

import numpy as np

from teleop_sim.robot.law import Arrays
from teleop_sim.robot.spec import RobotSpec
from teleop_sim.world.belief import Belief
from teleop_sim.world.plant import Plant


def dofs(plant: Plant) -> dict[str, int]:
    """Place of each joint among the degrees of freedom."""
    return {name: int(plant.model.joint(name).dofadr[0]) for name in plant.joint_names}


def qpos_places(plant: Plant) -> np.ndarray:
    """(nv_robot,) place in ``qpos`` of each of the robot's degrees of freedom; the root's six are not used."""
    model = plant.model
    joints = [int(model.jnt_qposadr[model.dof_jntid[i]]) for i in range(6, plant.nv_robot)]
    return np.array([0] * 6 + joints, np.int64)


def law_arrays(spec: RobotSpec, plant: Plant, belief: Belief | None) -> Arrays:
    """Views of MuJoCo's arrays, cut to the robot, which comes first; they stay valid as long as their owners.

    Args:
        spec: names the legs. plant: is controlled, and read unless there is a belief. belief: read instead.
    """
    source: Plant | Belief = plant if belief is None else belief
    model, data, nv = source.model, source.data, plant.nv_robot
    dof, foot = dofs(plant), spec.model.description.sole
    sites = [model.site(f"{name}_sole").id for name in (foot.left, foot.right)]
    step = sites[1] - sites[0]
    # Left, then right, whichever the model has first.
    soles = slice(sites[0], sites[1] + (1 if step > 0 else -1) or None, step)
    return Arrays(
        legs=np.array([[dof[name] for name in leg] for leg in spec.legs], np.int64),
        upper=np.array([dof[name] for name in spec.upper], np.int64),
        m_rownnz=model.M_rownnz.astype(np.int64),
        m_rowadr=model.M_rowadr.astype(np.int64),
        m_colind=model.M_colind.astype(np.int64),
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
        touch=sole_loads(spec, plant) if belief is None else belief.touch,
        kp=plant.model.actuator_gainprm[: nv - 6, 0].copy(),
        kv=-plant.model.actuator_biasprm[: nv - 6, 2].copy(),
        control=plant.data.ctrl[: nv - 6],
    )


def sole_loads(spec: RobotSpec, plant: Plant) -> np.ndarray:
    """View of both soles' touch sensors (2,) [N], left and right."""
    foot = spec.model.description.sole
    first = int(plant.model.sensor(f"{foot.left}_touch").adr[0])
    loads: np.ndarray = plant.data.sensordata[first : first + 2]
    return loads
