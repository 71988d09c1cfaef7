"""Force-torque sensors and the inertial unit, computed when asked: as MuJoCo's own sensors they would cost every step.

All are of the last physics step, exact and without noise; those that read them add it.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from teleop_sim.world.plant import Plant


@dataclass(frozen=True)
class Wrench:
    """What a link gets from the one that carries it, at its joint, in its own axes: force [N], moment [N m]: (3,)."""

    force_n: np.ndarray
    moment_nm: np.ndarray


@dataclass(frozen=True)
class Inertial:
    """Reading of an inertial unit at a link's origin, in its axes: rates (3,) [rad/s], specific force (3,) [m/s^2]."""

    rate_rad_s: np.ndarray
    force_m_s2: np.ndarray


def wrenches(plant: Plant, links: tuple[str, ...]) -> tuple[Wrench, ...]:
    """Force-torque sensors at the joints of these links: feet, wrists."""
    model, data = plant.model, plant.data
    mujoco.mj_rnePostConstraint(model, data)
    found = []
    for name in links:
        body = model.body(name).id
        moment, force = data.cfrc_int[body, :3].copy(), data.cfrc_int[body, 3:].copy()
        # MuJoCo's are about the centre of mass of the whole tree.
        lever = data.subtree_com[model.body_rootid[body]] - data.xpos[body]
        axes = data.xmat[body].reshape(3, 3)
        found.append(Wrench(axes.T @ force, axes.T @ (moment + np.cross(lever, force))))
    return tuple(found)


def inertial(plant: Plant, link: str) -> Inertial:
    """The inertial unit on a link. At rest it feels gravity as 9.81 m/s^2 upwards."""
    model, data = plant.model, plant.data
    mujoco.mj_rnePostConstraint(model, data)
    body, rate, push = model.body(link).id, np.zeros(6), np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, rate, 1)
    mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, push, 1)
    return Inertial(rate[:3].copy(), push[3:].copy())
