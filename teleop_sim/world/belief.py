"""The robot as its controller believes it: a second model, fed with what the joints feel, and never stepped.

It is needed only where belief and truth differ; otherwise the controller reads the plant's own arrays, which say the
same. The feel is exact but late: pose and rates of ``delay`` ticks ago. Not modelled: noise on it, drift of odometry.
"""

from __future__ import annotations

from collections import deque

import mujoco
import numpy as np

from teleop_sim.world.robot_model import RobotModel, add_robot


class Belief:
    """Scratch: ``feel`` fills ``data`` with kinematics, inertia and bias forces of the believed robot.

    Attributes:
        model, data: of the robot alone; its degrees of freedom are the plant's first.
        touch: (2,) loads of the soles [N] as felt.
    """

    def __init__(self, robot: RobotModel, gravity_m_s2: float, delay_ticks: int) -> None:
        spec = mujoco.MjSpec()
        spec.compiler.degree = False
        spec.compiler.autolimits = False
        spec.option.gravity = [0.0, 0.0, -gravity_m_s2]
        add_robot(spec, robot)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.touch = np.zeros(2)
        self._delay = delay_ticks
        self._late: deque[np.ndarray] = deque(maxlen=delay_ticks + 1)

    def feel(self, qpos: np.ndarray, qvel: np.ndarray, touch: np.ndarray) -> None:
        """Take in the plant's state (its arrays may be longer) and work out what the control law reads."""
        model, data = self.model, self.data
        nq, nv = model.nq, model.nv
        self._late.append(np.concatenate([qpos[:nq], qvel[:nv], touch]))
        felt = self._late[0]
        data.qpos[:], data.qvel[:], self.touch[:] = felt[:nq], felt[nq : nq + nv], felt[nq + nv :]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_makeM(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_passive(model, data)
        mujoco.mj_rne(model, data, 0, data.qfrc_bias)

    def save(self) -> bytes:
        """What is still under way from the joints to the controller."""
        return b"" if not self._delay else b"".join(x.tobytes() for x in self._late)

    def load(self, under_way: bytes) -> None:
        """Go back to what ``save`` gave."""
        self._late.clear()
        width = self.model.nq + self.model.nv + 2
        for at in range(0, len(under_way), 8 * width):
            self._late.append(np.frombuffer(under_way, count=width, offset=at))
