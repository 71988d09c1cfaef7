"""The feet's part of the control law: what a sole shall do, and which wrenches carry the robot."""

from __future__ import annotations

import numpy as np
from numba.extending import register_jitable

from teleop_sim.robot.law_layout import FOOT, LANDED, STANCE
from teleop_sim.robot.law_math import clip, cross, dot, into, out_of, solve, tilt_error


@register_jitable
def sole_task(i, row, g, memory, a, Jl, Jb):
    """Fill a sole's Jacobians by leg (6, 6) and base rotation (6, 3); return wanted minus drift acceleration."""
    r = (a.sole[i, 0] - a.com[0], a.sole[i, 1] - a.com[1], a.sole[i, 2] - a.com[2])
    drift, velocity = np.zeros(6), np.zeros(6)
    for n in range(12):
        k = n if n < 6 else a.legs[i, n - 6]
        cr, cq, v = a.cdof[k], a.cdof_dot[k], a.qvel[k]
        jx = cr[3] + cr[1] * r[2] - cr[2] * r[1]
        jy = cr[4] + cr[2] * r[0] - cr[0] * r[2]
        jz = cr[5] + cr[0] * r[1] - cr[1] * r[0]
        if n >= 3:
            J, column = (Jl, n - 6) if n >= 6 else (Jb, n - 3)
            J[0, column], J[1, column], J[2, column] = jx, jy, jz
            J[3, column], J[4, column], J[5, column] = cr[0], cr[1], cr[2]
        velocity[0] += jx * v
        velocity[1] += jy * v
        velocity[2] += jz * v
        for b in range(3):
            velocity[3 + b] += cr[b] * v
            drift[3 + b] += cq[b] * v
            drift[b] += cq[3 + b] * v
    turning, moving = cross(drift[3:], r), cross(velocity[3:], velocity)
    for n in range(3):
        drift[n] += turning[n] + moving[n]
    wanted = np.empty(6)
    if memory[LANDED + i] > 0:
        for n in range(6):
            wanted[n] = -g.stance_damping * velocity[n]
    else:
        f, k = FOOT + 12 * i, g.swing
        e = tilt_error(a.sole_rotation[i].reshape(3, 3), np.cos(row[f + 9]), np.sin(row[f + 9]))
        for n in range(3):
            wanted[n] = row[f + 6 + n] + 2 * k * (row[f + 3 + n] - velocity[n]) + k * k * (row[f + n] - a.sole[i, n])
            spin = row[f + 10] if n == 2 else 0.0
            wanted[3 + n] = 2 * k * (spin - velocity[3 + n]) + k * k * e[n]
    for n in range(6):
        wanted[n] -= drift[n]
    return wanted


@register_jitable
def _from_root(a, i):
    """A sole's place from the root's (world axes)."""
    return a.sole[i, 0] - a.qpos[0], a.sole[i, 1] - a.qpos[1], a.sole[i, 2] - a.qpos[2]


@register_jitable
def foot_wrenches(row, g, a, tau, Rb, left):
    """Forces and moments (2, 6) at the soles that carry the base: weighted least norm on both feet, or all on one."""
    F, W = np.zeros((2, 6)), np.empty(6)
    for n in range(3):
        W[n] = tau[n]
        W[3 + n] = Rb[n, 0] * tau[3] + Rb[n, 1] * tau[4] + Rb[n, 2] * tau[5]
    stance = int(row[STANCE])
    if stance != 2:
        t = cross(_from_root(a, stance), W)
        for n in range(3):
            F[stance, n], F[stance, 3 + n] = W[n], W[3 + n] - t[n]
        return F
    # A newton metre costs as much as a newton at the root of this; 0.06 m is about a sole's half width. The larger,
    # the more of a twist is left to the soles' grip, and the less the legs push one against the other.
    cost = g.twist_m2
    G, S = np.zeros((6, 6)), np.zeros((2, 3, 3))
    for i in range(2):
        share = max(left if i == 0 else 1 - left, 1e-4)
        r = _from_root(a, i)
        # S is r as a cross product; S S' = (r.r) 1 - r r'.
        S[i, 0, 1], S[i, 0, 2], S[i, 1, 2] = -r[2], r[1], -r[0]
        S[i, 1, 0], S[i, 2, 0], S[i, 2, 1] = r[2], -r[1], r[0]
        for n in range(3):
            G[n, n] += share
            G[3 + n, 3 + n] += share * (cost + dot(r, r))
            for k in range(3):
                G[3 + n, 3 + k] -= share * r[n] * r[k]
                G[3 + n, k] += share * S[i, n, k]
                G[n, 3 + k] += share * S[i, k, n]
    lam = np.empty((6, 1))
    lam[:, 0] = W
    solve(G, lam)
    for i in range(2):
        share = max(left if i == 0 else 1 - left, 1e-4)
        for n in range(3):
            v = lam[n, 0]
            for c in range(3):
                v += S[i, c, n] * lam[3 + c, 0]
            F[i, n], F[i, 3 + n] = share * v, share * cost * lam[3 + n, 0]
    return F


@register_jitable
def carry(F, g, a, Jl, tau):
    """Take the soles' wrenches off the leg torques, each foot's centre of pressure kept on its sole."""
    hx, hy = g.half_length_m - g.sole_margin_m, g.half_width_m - g.sole_margin_m
    for i in range(2):
        R = a.sole_rotation[i].reshape(3, 3)
        load, (mx, my, mz) = into(R, F[i])[2], into(R, F[i, 3:])
        if load < 1.0:
            continue
        turned = out_of(R, (clip(mx / load, -hy, hy) * load, -clip(-my / load, -hx, hx) * load, mz))
        for k in range(6):
            for n in range(3):
                tau[a.legs[i, k]] -= Jl[i, n, k] * F[i, n] + Jl[i, 3 + n, k] * turned[n]
