"""Joints: a group of joints straight to angles; guarded, as named postures of a group are."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import JointGroup, Joints
from teleop_sim.robot.skill import Done, Motion, Tick
from teleop_sim.robot.skills.guarding import guard_n
from teleop_sim.robot.skills.manipulate import PEAK_RATE_RAD_S, STRETCH, arm_of, smooth
from teleop_sim.robot.skills.servoing import LEASH_RAD, Led

LEAST_S, SETTLE_S = 1.0, 0.4
ROUNDING_RAD = 0.002
"""Beyond a limit by no more than a message rounds by (``channel``'s JointTargets: 1.53 mrad) is at the limit."""
STAY_RAD = 1e-3
"""What is no way to go."""
OFF_RAD = 0.03
"""A joint that ends so far off was held (assumed: arms are within 11 mrad under load)."""


def joints(body: Body, command: Joints, rng: np.random.Generator) -> Motion:
    """See ``Joints``; data: the largest angle that was left [rad]."""
    names = group_joints(body, command.group)
    if not names:
        return Done("refused", f"{command.group} cannot be told joint angles; arms, torso and neck can")
    if len(command.angles_rad) != len(names):
        return Done("refused", f"{command.group} has {len(names)} joints, not {len(command.angles_rad)}")
    beyond = [name for name, angle in zip(names, command.angles_rad, strict=True) if _excess(body, name, angle)]
    if beyond:
        return Done("refused", f"beyond the limits of {', '.join(beyond)}")
    return (yield from swing(body, dict(zip(names, command.angles_rad, strict=True))))


def group_joints(body: Body, group: JointGroup) -> tuple[str, ...]:
    """Joints of a group in the robot's order: an arm's from the shoulder out, the torso's and the neck's upwards.

    None of a group that no skill moves.
    """
    spec = body.spec
    groups: Mapping[str, tuple[str, ...]] = {
        "left_arm": spec.arms["left"],
        "right_arm": spec.arms["right"],
        "torso": spec.torso,
        "neck": spec.neck,
    }
    return tuple(groups.get(group, ()))


def swing(body: Body, angles_rad: Mapping[str, float], least_s: float = LEAST_S) -> Motion:
    """Bring joints to angles along a straight way in joint space, the others as they were told, jaws as they are.

    References lead the felt joints by no more than a leash; a wrist that feels ``guard_n`` more than at the start
    ends it. ``reached`` or ``blocked``; data: the largest angle left [rad].
    """
    start, goal = body.posture.copy(), body.posture.copy()
    for name, angle in angles_rad.items():
        joint = body.spec.model.description.joint(name)
        goal[body.upper_names.index(name)] = min(max(angle, joint.lower_rad), joint.upper_rad)
    if np.abs(goal - start).max() < STAY_RAD:
        return Done("reached", "there already", 0.0)
    moving = np.array([name in angles_rad for name in body.upper_names])
    seconds = max(least_s, STRETCH * float(np.abs(goal - start).max()) / PEAK_RATE_RAD_S)
    wrists = [Led(arm_of(body, side)) for side in body.hands]
    first_n: list[np.ndarray] = []
    guard = guard_n(body)
    count, before = max(1, math.ceil(seconds / body.tick_s)), 0.0
    for k in range(1, count + round(SETTLE_S / body.tick_s) + 1):
        share = smooth(k / count)
        yield Tick(
            _leashed(body, start + (goal - start) * share, moving),
            (goal - start) * (share - before) / body.tick_s,
            jaws=body.jaws,
        )
        before = share
        for wrist in wrists:
            wrist.feel_wrist()
        forces = [wrist.force() for wrist in wrists]
        first_n = forces if k <= 10 else first_n
        met_n = max((float(np.linalg.norm(a - b)) for a, b in zip(forces, first_n, strict=True)), default=0.0)
        if met_n > guard:
            return Done("blocked", f"{met_n:.0f} N at a wrist", _left_rad(body, goal, moving))
    left_rad = _left_rad(body, goal, moving)
    return Done("reached" if left_rad <= OFF_RAD else "blocked", f"{left_rad:.3f} rad left", left_rad)


def _leashed(body: Body, posture: np.ndarray, moving: np.ndarray) -> np.ndarray:
    felt = body.upper()
    return np.where(moving, np.clip(posture, felt - LEASH_RAD, felt + LEASH_RAD), posture)


def _left_rad(body: Body, goal: np.ndarray, moving: np.ndarray) -> float:
    return float(np.abs(np.where(moving, goal - body.upper(), 0.0)).max())


def _excess(body: Body, name: str, angle: float) -> bool:
    joint = body.spec.model.description.joint(name)
    return not joint.lower_rad - ROUNDING_RAD <= angle <= joint.upper_rad + ROUNDING_RAD
