"""The robot as its controller believes it: a second model, fed with what the joints feel, and never stepped.

It is needed only where belief and truth differ, or while a hand carries something; otherwise the controller reads the
plant's own arrays, which say the same. The feel is exact but late: pose and rates of ``delay`` ticks ago. Not modelled:
noise on it, drift of odometry.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import mujoco
import numpy as np

from teleop_sim.world.robot_model import RobotModel, add_robot


@dataclass(frozen=True)
class Load:
    """Something that a link carries, as its controller was told: a solid ball fixed to the link.

    ``at_m``: its centre in the link's frame. Not modelled: that it swings, slips or is not round.
    """

    link: str
    mass_kg: float
    at_m: tuple[float, float, float]
    radius_m: float = 0.1


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
        m = self.model
        self._unladen = tuple(
            x.copy() for x in (m.body_mass, m.body_subtreemass, m.body_ipos, m.body_iquat, m.body_inertia)
        )
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

    def bear(self, loads: tuple[Load, ...]) -> None:
        """Take these to be all that the robot carries, beside its own links."""
        model = self.model
        parts = (model.body_mass, model.body_subtreemass, model.body_ipos, model.body_iquat, model.body_inertia)
        for part, unladen in zip(parts, self._unladen, strict=True):
            part[:] = unladen
        for load in loads:
            _add(model, load)

    def save(self) -> bytes:
        """What is still under way from the joints to the controller."""
        return b"" if not self._delay else b"".join(x.tobytes() for x in self._late)

    def load(self, under_way: bytes) -> None:
        """Go back to what ``save`` gave."""
        self._late.clear()
        width = self.model.nq + self.model.nv + 2
        for at in range(0, len(under_way), 8 * width):
            self._late.append(np.frombuffer(under_way, count=width, offset=at))


def _add(model: mujoco.MjModel, load: Load) -> None:
    """Parallel-axis theorem; a solid ball has 2/5 m r^2 about its centre."""
    body = model.body(load.link).id
    own_kg, at, turned = float(model.body_mass[body]), model.body_ipos[body].copy(), np.zeros(9)
    mujoco.mju_quat2Mat(turned, model.body_iquat[body])
    axes = turned.reshape(3, 3)
    total = axes @ np.diag(model.body_inertia[body]) @ axes.T + 0.4 * load.mass_kg * load.radius_m**2 * np.eye(3)
    mass_kg = own_kg + load.mass_kg
    com = (own_kg * at + load.mass_kg * np.array(load.at_m)) / mass_kg
    for part_kg, place in ((own_kg, at), (load.mass_kg, np.array(load.at_m))):
        d = place - com
        total = total + part_kg * (d @ d * np.eye(3) - np.outer(d, d))
    principal, axes = np.linalg.eigh(total)
    if np.linalg.det(axes) < 0:
        axes[:, 0] *= -1.0
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(axes).ravel())
    model.body_mass[body], model.body_ipos[body] = mass_kg, com
    model.body_inertia[body], model.body_iquat[body] = principal, quat
    while body > 0:
        model.body_subtreemass[body] += load.mass_kg
        body = int(model.body_parentid[body])
