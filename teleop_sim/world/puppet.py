"""A plant that is put into postures and never stepped: for looking at what has happened."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from teleop_sim.world.plant import Plant


class Puppet:
    """A plant with strings.

    Args:
        plant: is changed by every pose.
        names: joints, in the order in which ``pose`` gets their positions. Bodies that float freely, but for the
            robot's root, stay where they were built: no name says where they are.

    Raises:
        KeyError: the plant has no joint of one of the names.

    """

    def __init__(self, plant: Plant, names: Sequence[str]) -> None:
        self.plant = plant
        self._at = np.array([int(plant.model.joint(name).qposadr[0]) for name in names], dtype=int)

    def pose(self, pelvis: np.ndarray, joints: np.ndarray) -> None:
        """Put everything somewhere: kinematics only, no contacts and no forces.

        Args:
            pelvis: position [m] and quaternion w, x, y, z, (7,).
            joints: positions [rad or m], one a name.

        """
        model, data = self.plant.model, self.plant.data
        data.qpos[:7] = pelvis
        data.qpos[self._at] = joints
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_camlight(model, data)

    def bodies(self) -> dict[str, np.ndarray]:
        """Where every body is now: position [m] and quaternion w, x, y, z, (7,), by name."""
        model, data = self.plant.model, self.plant.data
        return {model.body(i).name: np.concatenate([data.xpos[i], data.xquat[i]]) for i in range(1, model.nbody)}

    def height_m(self) -> float:
        """How high the highest joint of the robot is now, over z = 0."""
        model, data = self.plant.model, self.plant.data
        return float(data.xpos[np.asarray(model.body_rootid) == 1, 2].max())
