"""What the control law works on: the columns of a plan's row, its memory, its gains and MuJoCo's arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# Columns of a plan's row. FOOT + 12 i: sole position 3, velocity 3, acceleration 3, yaw, yaw rate, descending.
# LEAN: rotation of the pelvis about its own forward axis, over the standing foot.
XI, ZMP, STANCE, YAW, YAW_RATE, HEIGHT, LIFT, LEAN, FOOT = 0, 2, 4, 5, 6, 7, 8, 9, 10
COLUMNS = FOOT + 24
BOTH = 2.0
"""Value of STANCE with both feet on the ground; else the index of the standing foot."""

# Columns of the law's memory: ground's height; landed flags; sole heights; last centre of pressure; DCM error.
GROUND, LANDED, SOLE_Z, COP, ERROR = 0, 1, 3, 5, 7
MEMORY = 9


class Gains(NamedTuple):
    """Parameters of the law, measured in trials (docs/physics.md). The defaults are those of every robot whose data do
    not say otherwise.
    """

    omega: float
    mass_kg: float
    half_length_m: float
    half_width_m: float
    touchdown_n: float
    tick_s: float
    gravity: float
    dcm: float = 4.0
    sole_margin_m: float = 0.012
    swing: float = 12.0
    stance_damping: float = 20.0
    rotation: float = 128.0
    rotation_damping: float = 22.0
    height: float = 64.0
    height_damping: float = 16.0
    upper: float = 90.0
    upper_damping: float = 18.0
    heading_error_rad: float = 0.05
    twist_m2: float = 0.0036


class Arrays(NamedTuple):
    """Views of MuJoCo's arrays, cut to the robot's degrees of freedom, which come first."""

    legs: np.ndarray
    upper: np.ndarray
    m_rownnz: np.ndarray
    m_rowadr: np.ndarray
    m_colind: np.ndarray
    inertia: np.ndarray
    bias: np.ndarray
    passive: np.ndarray
    qpos: np.ndarray
    qvel: np.ndarray
    qposadr: np.ndarray
    com: np.ndarray
    cdof: np.ndarray
    cdof_dot: np.ndarray
    sole: np.ndarray
    sole_rotation: np.ndarray
    touch: np.ndarray
    kp: np.ndarray
    kv: np.ndarray
    control: np.ndarray
