"""Footsteps to a walking plan: piecewise-linear ZMP, closed-form DCM and centre of mass, one table.

A plan is a table (n, law.COLUMNS) with one row a control tick. Within a tick the ZMP is constant, so the DCM has a
closed form, backwards from rest on the last ZMP: xi(k) = z + (xi(k+1) - z) e^{-w dt} (linear inverted pendulum; Kajita
et al., IROS 2001; Englsberger et al., T-RO 2015). No inverse kinematics: the control law finds the legs' motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from teleop_sim.robot import law
from teleop_sim.robot.commands import PlanarPose
from teleop_sim.robot.footsteps import (
    LEFT,
    RIGHT,
    Footstep,
    Gait,
    body_between,
    first_foot,
    shift_bodies,
    sole_place,
    steps_along,
    turn_bodies,
    walk_bodies,
    wrap,
)
from teleop_sim.robot.law_math import com_forwards, dcm_backwards
from teleop_sim.world.plant import GRAVITY_M_S2

__all__ = [
    "LEFT",
    "RIGHT",
    "Footstep",
    "Gait",
    "Plan",
    "body_between",
    "first_foot",
    "make_plan",
    "reference_dcm",
    "shift_bodies",
    "smooth",
    "sole_place",
    "stand_row",
    "steps_along",
    "turn_bodies",
    "walk_bodies",
    "wrap",
]


@dataclass(frozen=True)
class Plan:
    """A walking plan. ``step_ends``: rows at which a swing foot has landed."""

    rows: np.ndarray
    omega: float
    step_ends: tuple[int, ...]


def smooth(u: np.ndarray) -> np.ndarray:
    """Quintic from 0 to 1 with zero velocity and acceleration at both ends."""
    u = np.clip(u, 0.0, 1.0)
    curve: np.ndarray = u**3 * (10 - 15 * u + 6 * u * u)
    return curve


@dataclass(frozen=True)
class _Phase:
    duration_s: float
    zmp0: np.ndarray
    zmp1: np.ndarray
    stance: float
    swing: tuple[int, np.ndarray, np.ndarray] | None
    feet: tuple[np.ndarray, np.ndarray]


def _phases(feet: Sequence[PlanarPose], zmp: np.ndarray, steps: Sequence[Footstep], gait: Gait) -> list[_Phase]:
    now = [np.array(f, float) for f in feet]
    phases = []
    for k, step in enumerate(steps):
        onto = _pressed(now[1 - step.foot], gait.zmp_ahead_m)
        both = (now[0].copy(), now[1].copy())
        phases.append(_Phase(gait.first_s if k == 0 else gait.transfer_s, zmp, onto, law.BOTH, None, both))
        yaw = now[step.foot][2] + wrap(step.yaw - now[step.foot][2])
        goal = np.array([step.x, step.y, yaw])
        swing = (step.foot, now[step.foot].copy(), goal)
        phases.append(_Phase(gait.swing_s, onto, onto, float(1 - step.foot), swing, both))
        now[step.foot] = goal
        zmp = onto
    both = (now[0].copy(), now[1].copy())
    middle = (now[0][:2] + now[1][:2]) / 2
    phases.append(_Phase(gait.transfer_s * 1.5 if steps else 0.2, zmp, middle, law.BOTH, None, both))
    phases.append(_Phase(gait.last_s, middle, middle, law.BOTH, None, both))
    return phases


def _pressed(sole: np.ndarray, ahead_m: float) -> np.ndarray:
    """Where on a sole (x, y, yaw) the planned ZMP (2,) is."""
    x, y, yaw = sole
    return np.array([x + np.cos(yaw) * ahead_m, y + np.sin(yaw) * ahead_m])


def make_plan(
    feet: Sequence[PlanarPose],
    com: np.ndarray,
    com_height_m: float,
    ground_z_m: float,
    steps: Sequence[Footstep],
    gait: Gait,
    tick_s: float,
) -> Plan:
    """Plan a walk from rest to rest.

    Args:
        feet: sole centres now, left and right. com: centre of mass (2,) now. com_height_m: over the soles.
        ground_z_m: height of the ground. steps: footsteps, alternating. tick_s: control period.
    """
    omega = float(np.sqrt(GRAVITY_M_S2 / com_height_m))
    phases = _phases(feet, np.array(com, float), steps, gait)
    counts = [max(1, round(p.duration_s / tick_s)) for p in phases]
    n = sum(counts)
    rows, soles, ends, at = np.zeros((n, law.COLUMNS)), np.zeros((n, 2, 4)), [], 0
    for phase, count in zip(phases, counts, strict=True):
        _fill_phase(rows[at : at + count], soles[at : at + count], phase, ground_z_m, gait)
        at += count
        if phase.swing is not None:
            ends.append(at)
    _fill_feet(rows, soles, tick_s)
    rows[:, law.HEIGHT] = com_height_m + ground_z_m
    _begin_at(rows[:, law.ZMP : law.ZMP + 2], np.array(com, float), counts[0], omega, tick_s)
    xi = rows[:, law.XI : law.XI + 2] = reference_dcm(rows[:, law.ZMP : law.ZMP + 2], omega, tick_s)
    if gait.lean_rad:
        rows[:, law.LEAN] = _lean(rows[:, law.ZMP : law.ZMP + 2], xi, com, soles, gait.lean_rad, omega * tick_s)
    return Plan(rows, omega, tuple(ends))


def _fill_phase(rows: np.ndarray, soles: np.ndarray, phase: _Phase, ground_z_m: float, gait: Gait) -> None:
    u = (np.arange(len(rows)) + 0.5) / len(rows)
    rows[:, law.ZMP : law.ZMP + 2] = phase.zmp0 + (phase.zmp1 - phase.zmp0) * smooth(u)[:, None]
    rows[:, law.STANCE] = phase.stance
    for i in (LEFT, RIGHT):
        soles[:, i, :2], soles[:, i, 2], soles[:, i, 3] = phase.feet[i][:2], ground_z_m, phase.feet[i][2]
    if phase.swing is not None:
        i, start, goal = phase.swing
        along = smooth((u - 0.02) / 0.9)
        moved = start + (goal - start) * along[:, None]
        soles[:, i, :2], soles[:, i, 3] = moved[:, :2], moved[:, 2]
        soles[:, i, 2] = ground_z_m + gait.lift_m * np.where(u < 0.42, smooth(u / 0.42), smooth((0.95 - u) / 0.53))
        rows[0, law.LIFT] = 1.0


def _fill_feet(rows: np.ndarray, soles: np.ndarray, tick_s: float) -> None:
    n = len(rows)
    velocity, acceleration = np.zeros_like(soles), np.zeros_like(soles)
    velocity[1:-1] = (soles[2:] - soles[:-2]) / (2 * tick_s)
    acceleration[1:-1] = (soles[2:] - 2 * soles[1:-1] + soles[:-2]) / tick_s**2
    ahead = round(0.05 / tick_s)
    falling = soles[np.minimum(np.arange(n) + ahead, n - 1), :, 2] - soles[:, :, 2] < -1e-4
    for i in (LEFT, RIGHT):
        f = law.FOOT + 12 * i
        rows[:, f : f + 3] = soles[:, i, :3]
        rows[:, f + 3 : f + 6] = velocity[:, i, :3]
        rows[:, f + 6 : f + 9] = acceleration[:, i, :3]
        rows[:, f + 9], rows[:, f + 10], rows[:, f + 11] = soles[:, i, 3], velocity[:, i, 3], falling[:, i]
    rows[:, law.YAW] = soles[:, :, 3].mean(1)
    rows[:, law.YAW_RATE] = velocity[:, :, 3].mean(1)


def _begin_at(zmp: np.ndarray, com: np.ndarray, first: int, omega: float, tick_s: float) -> None:
    """Add to the first load shift's ZMP what makes the plan's DCM begin over the centre of mass (2,) at rest.

    It first leans on the swing foot to push the body over, as people do; without it the law would, with a jolt.
    """
    u = (np.arange(first) + 0.5) / first
    push = np.zeros_like(zmp)
    push[:first] = (u * (1 - u) ** 2)[:, None]
    missing = com - reference_dcm(zmp, omega, tick_s)[0]
    zmp += push * missing / reference_dcm(push, omega, tick_s)[0]


def reference_dcm(zmp: np.ndarray, omega: float, tick_s: float) -> np.ndarray:
    """DCM (n, 2) that follows a ZMP table (n, 2), constant within each tick, and ends at rest on its last row.

    Where it begins follows from the table.
    """
    xi: np.ndarray = dcm_backwards(zmp, np.exp(-omega * tick_s))
    return xi


def _lean(
    zmp: np.ndarray, xi: np.ndarray, com: np.ndarray, soles: np.ndarray, lean_rad: float, omega_tick: float
) -> np.ndarray:
    """Pelvis roll (n,), in proportion to how far the centre of mass is from the soles' middle towards one of them."""
    path = com_forwards(zmp, xi, np.array(com, float), np.exp(-omega_tick), np.sinh(omega_tick))
    across = soles[:, 0, :2] - soles[:, 1, :2]
    aside = ((path - soles[:, :, :2].mean(1)) * across).sum(1) / (across**2).sum(1)
    lean: np.ndarray = -2.0 * lean_rad * aside
    return lean


def stand_row(feet: Sequence[PlanarPose], com_height_m: float, ground_z_m: float) -> np.ndarray:
    """The row (COLUMNS,) that keeps a robot standing on its feet, load in the middle."""
    row = np.zeros(law.COLUMNS)
    middle = np.array(body_between(feet))
    row[law.XI : law.XI + 2] = row[law.ZMP : law.ZMP + 2] = middle[:2]
    row[law.STANCE], row[law.YAW], row[law.HEIGHT] = law.BOTH, middle[2], com_height_m + ground_z_m
    for i in (LEFT, RIGHT):
        f = law.FOOT + 12 * i
        row[f : f + 3] = feet[i][0], feet[i][1], ground_z_m
        row[f + 9] = feet[i][2]
    return row
