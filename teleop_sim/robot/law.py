"""One control tick of the legs: closed-form whole-body inverse dynamics, compiled.

Works on MuJoCo's own arrays (``cdof``, ``cdof_dot``, the sparse ``M`` whose base rows are also the centre-of-mass
Jacobian, ``qfrc_bias``); no second dynamics library, no quadratic program. Unknowns: 6 base and 12 leg accelerations.
Tasks: both soles (12), centre of mass (3), pelvis rotation (3). The structure leaves two 6x6 solves and one 3x3.

Balance: the divergent component of motion xi = c + c'/omega is steered by the centre of pressure,
p = zmp + (1 + k/omega)(xi - xi_ref), clamped to the soles (Englsberger, Ott, Albu-Schaeffer, IEEE T-RO 31 (2015),
355-368).
The pelvis' heading is not pulled back faster than a sole's friction can twist the body.
Not modelled: other friction limits in the law (physics has them), torque limits (the actuators clip), self-collision.
"""

from __future__ import annotations

import numpy as np
from numba.extending import register_jitable

from teleop_sim.robot.law_feet import carry, foot_wrenches, sole_task
from teleop_sim.robot.law_layout import (
    BOTH,
    COLUMNS,
    COP,
    ERROR,
    FOOT,
    GROUND,
    HEIGHT,
    LANDED,
    LEAN,
    LIFT,
    MEMORY,
    SOLE_Z,
    STANCE,
    XI,
    YAW,
    YAW_RATE,
    ZMP,
    Arrays,
    Gains,
)
from teleop_sim.robot.law_math import base_rotation, clip, compiled, solve, tilt_error
from teleop_sim.robot.law_wires import unwire

__all__ = [
    "BOTH",
    "COLUMNS",
    "COP",
    "ERROR",
    "FOOT",
    "GROUND",
    "HEIGHT",
    "LANDED",
    "LEAN",
    "LIFT",
    "MEMORY",
    "SOLE_Z",
    "STANCE",
    "XI",
    "YAW",
    "YAW_RATE",
    "ZMP",
    "Arrays",
    "Gains",
    "tick",
]


@register_jitable
def com_velocity(a, mass):
    """Centre-of-mass velocity: the base's linear rows of M times qvel, over the mass."""
    p = np.zeros(3)
    for i in range(3):
        for k in range(a.m_rowadr[i], a.m_rowadr[i] + a.m_rownnz[i]):
            j = a.m_colind[k]
            p[j] += a.inertia[k] * a.qvel[i]
            if j < i:
                p[i] += a.inertia[k] * a.qvel[j]
    x, y, z = p[0], p[1], p[2]
    for i in range(3, a.qvel.size):
        # The base's columns come first in every row.
        k, speed = a.m_rowadr[i], a.qvel[i]
        x += a.inertia[k] * speed
        y += a.inertia[k + 1] * speed
        z += a.inertia[k + 2] * speed
    return x / mass, y / mass, z / mass


@register_jitable
def centre_of_pressure(row, g, memory, a, velocity):
    """Set the wanted centre of pressure, kept on the sole or the hull of both; return the left foot's share."""
    ex = a.com[0] + velocity[0] / g.omega - row[XI]
    ey = a.com[1] + velocity[1] / g.omega - row[XI + 1]
    gain = 1.0 + g.dcm / g.omega
    px, py = row[ZMP] + gain * ex, row[ZMP + 1] + gain * ey
    yaw0 = np.arctan2(a.sole_rotation[0, 3], a.sole_rotation[0, 0])
    yaw1 = np.arctan2(a.sole_rotation[1, 3], a.sole_rotation[1, 0])
    stance = int(row[STANCE])
    if stance == 2:
        dx, dy = a.sole[1, 0] - a.sole[0, 0], a.sole[1, 1] - a.sole[0, 1]
        s = clip(((px - a.sole[0, 0]) * dx + (py - a.sole[0, 1]) * dy) / (dx * dx + dy * dy), 0.0, 1.0)
        bx, by = a.sole[0, 0] + s * dx, a.sole[0, 1] + s * dy
        yaw, left = yaw0 * (1 - s) + yaw1 * s, 1 - s
    else:
        bx, by = a.sole[stance, 0], a.sole[stance, 1]
        yaw, left = (yaw0, 1.0) if stance == 0 else (yaw1, 0.0)
    c, s = np.cos(yaw), np.sin(yaw)
    hx, hy = g.half_length_m - g.sole_margin_m, g.half_width_m - g.sole_margin_m
    lx = clip(c * (px - bx) + s * (py - by), -hx, hx)
    ly = clip(-s * (px - bx) + c * (py - by), -hy, hy)
    memory[COP], memory[COP + 1] = bx + c * lx - s * ly, by + s * lx + c * ly
    memory[ERROR], memory[ERROR + 1] = ex, ey
    return left


@register_jitable
def feel_ground(row, g, memory, a):
    """Remember which feet have landed and how high the ground is under them."""
    stance = int(row[STANCE])
    for i in range(2):
        if stance == 2 or stance == i:
            memory[LANDED + i] = 1.0
        elif row[LIFT] > 0:
            memory[LANDED + i] = 0.0
        elif row[FOOT + 12 * i + 11] > 0 and a.touch[i] > g.touchdown_n:
            memory[LANDED + i] = 1.0
        if memory[LANDED + i] > 0:
            memory[SOLE_Z + i] = a.sole[i, 2]
    target = 0.5 * (memory[SOLE_Z] + memory[SOLE_Z + 1]) if stance == 2 else memory[SOLE_Z + stance]
    # The body follows a change of the ground slowly, at 0.1 m/s.
    memory[GROUND] += clip(target - memory[GROUND], -0.1 * g.tick_s, 0.1 * g.tick_s)


@register_jitable
def accelerations(row, g, memory, a, qref, vref, velocity, Jl, Rb):
    """Accelerations of all degrees of freedom (nv,) that fulfil the tasks."""
    nv = a.qvel.size
    qdd = np.zeros(nv)
    for k in range(a.upper.size):
        i = a.upper[k]
        qdd[i] = g.upper * (qref[k] - a.qpos[a.qposadr[i]]) + g.upper_damping * (vref[k] - a.qvel[i])
    cos_yaw, sin_yaw = np.cos(row[YAW]), np.sin(row[YAW])
    ex, ey, ez = tilt_error(Rb, cos_yaw, sin_yaw)
    # A sole twists the body by mu m g r at most: 4 to 6 rad/s^2 at friction 0.4. Who asks for more turns his feet, and
    # one that stands on an edge then walks off it (all 11 falls of 840 walks of the full-size robots).
    ez = clip(ez, -g.heading_error_rad, g.heading_error_rad)
    ex += cos_yaw * row[LEAN]
    ey += sin_yaw * row[LEAN]
    for n in range(3):
        along = Rb[0, n] * ex + Rb[1, n] * ey + Rb[2, n] * ez
        qdd[3 + n] = g.rotation * along + g.rotation_damping * (Rb[2, n] * row[YAW_RATE] - a.qvel[3 + n])
    # Each leg's accelerations as u0 + u123 times the base's linear acceleration.
    u = np.empty((2, 6, 4))
    for i in range(2):
        Jb = np.empty((6, 3))
        w = sole_task(i, row, g, memory, a, Jl[i], Jb)
        for n in range(6):
            b = w[n]
            for k in range(3):
                b -= Jb[n, k] * qdd[3 + k]
                u[i, n, 1 + k] = -1.0 if n == k else 0.0
            u[i, n, 0] = b
        solve(Jl[i].copy(), u[i])
    # Centre of mass: M[:3] qdd + h[:3] = mass (a + g).
    B, b3 = np.zeros((3, 3)), np.empty((3, 1))
    a3 = np.empty(3)
    a3[0] = g.omega * g.omega * (a.com[0] - memory[COP])
    a3[1] = g.omega * g.omega * (a.com[1] - memory[COP + 1])
    a3[2] = g.height * (row[HEIGHT] + memory[GROUND] - a.com[2]) - g.height_damping * velocity[2] + g.gravity
    for n in range(3):
        B[n, n] = g.mass_kg
        b3[n, 0] = g.mass_kg * a3[n] - a.bias[n]
    for i in range(3, nv):
        for n in range(3):
            b3[n, 0] -= a.inertia[a.m_rowadr[i] + n] * qdd[i]
    for i in range(2):
        for k in range(6):
            d = a.legs[i, k]
            for n in range(3):
                m = a.inertia[a.m_rowadr[d] + n]
                b3[n, 0] -= m * u[i, k, 0]
                for c in range(3):
                    B[n, c] += m * u[i, k, 1 + c]
    solve(B, b3)
    for n in range(3):
        qdd[n] = b3[n, 0]
    for i in range(2):
        for k in range(6):
            drop = u[i, k, 1] * b3[0, 0] + u[i, k, 2] * b3[1, 0] + u[i, k, 3] * b3[2, 0]
            qdd[a.legs[i, k]] = u[i, k, 0] + drop
    return qdd


@compiled
def tick(row, qref, vref, extra, table):
    """One control period: read the arrays, set ``Arrays.control``.

    Args:
        row: (COLUMNS,) of the walking or standing plan.
        qref, vref, extra: (n_upper,) reference angles and rates of the upper body, torques to add.
        table: of ``law_wires.wire``: Gains, memory (MEMORY,), which is changed, and Arrays.
    """
    g, memory, a = unwire(table)
    nv = a.qvel.size
    velocity = com_velocity(a, g.mass_kg)
    left = centre_of_pressure(row, g, memory, a, velocity)
    feel_ground(row, g, memory, a)
    Rb = base_rotation(a.qpos)
    Jl = np.empty((2, 6, 6))
    qdd = accelerations(row, g, memory, a, qref, vref, velocity, Jl, Rb)
    tau = np.empty(nv)
    for i in range(nv):
        tau[i] = a.bias[i] - (a.passive[i] if i > 5 else 0.0)
    for i in range(nv):
        # A row of M ends on its diagonal.
        last = a.m_rowadr[i] + a.m_rownnz[i] - 1
        sum_i, qdd_i = tau[i], qdd[i]
        for k in range(a.m_rowadr[i], last):
            j = a.m_colind[k]
            sum_i += a.inertia[k] * qdd[j]
            tau[j] += a.inertia[k] * qdd_i
        tau[i] = sum_i + a.inertia[last] * qdd_i
    carry(foot_wrenches(row, g, a, tau, Rb, left), g, a, Jl, tau)
    # The actuators make force = kp (control - q) - kv qd all through the tick; tau is what they shall make on average,
    # so q and qd are those of the middle of the tick. Without this the servos brake every swing: the sole tilts by 14
    # degrees instead of 2, and standing feet slip four times as far.
    half_s = 0.5 * g.tick_s
    for i in a.legs.ravel():
        k = i - 6
        q, qd = a.qpos[a.qposadr[i]] + half_s * a.qvel[i], a.qvel[i] + half_s * qdd[i]
        a.control[k] = q + (a.kv[k] * qd + tau[i]) / a.kp[k]
    for n in range(a.upper.size):
        i = a.upper[n]
        k = i - 6
        a.control[k] = qref[n] + (a.kv[k] * vref[n] + tau[i] + extra[n]) / a.kp[k]
