"""Tables round a handle's circle, remembered: reaching for it, turning it and gripping it anew need the same one.

A table is a function of the robot's name and of numbers (the stance on a grid, the circle, the postures drawn to), so
remembering it changes nothing but time. Bounded: the oldest unused goes first.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from teleop_sim.robot.chain_ik import Stance
from teleop_sim.robot.circle_table import CircleTable, circle_table
from teleop_sim.robot.commands import CircularAffordance, Side
from teleop_sim.robot.kinematics import kinematics_of

REMEMBERED = 64
"""Tables kept: 48 postures and as many rows of torques are 40 kB (assumed: a mission needs two to six)."""


@dataclass(frozen=True)
class _Key:
    robot: str
    side: Side
    affordance: CircularAffordance
    stance: bytes
    rest: bytes


def handle_table(
    robot: str, side: Side, stance: Stance, rest: np.ndarray, affordance: CircularAffordance
) -> CircleTable:
    """``circle_table`` for a robot by name, remembered. The stance should be on a grid; the angle does not matter."""
    numbers = [*(foot.homogeneous.ravel() for foot in stance.feet), stance.com, stance.pelvis.ravel()]
    # Adding zero makes -0.0 and 0.0 one: bytes tell them apart.
    kept, drawn = (np.concatenate(numbers) + 0.0).tobytes(), (rest + 0.0).tobytes()
    key = _Key(robot, side, replace(affordance, angle_rad=0.0), kept, drawn)
    return _made(key)


@functools.lru_cache(maxsize=REMEMBERED)
def _made(key: _Key) -> CircleTable:
    numbers = np.frombuffer(key.stance)
    feet = [pin.SE3(numbers[16 * i : 16 * i + 16].reshape(4, 4).copy()) for i in (0, 1)]
    stance = Stance((feet[0], feet[1]), numbers[32:35].copy(), numbers[35:44].reshape(3, 3).copy())
    rest = np.frombuffer(key.rest).copy()
    return circle_table(kinematics_of(key.robot), key.side, stance, rest, key.affordance)


def forget() -> None:
    """Empty the memory: for measuring what a table costs."""
    _made.cache_clear()
