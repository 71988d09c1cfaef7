"""Carry: bring what a hand holds close to the body, level, before walking with it."""

from __future__ import annotations

import math

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Carry
from teleop_sim.robot.gait import body_between
from teleop_sim.robot.grasps import hand_stand
from teleop_sim.robot.pose_ik import PoseTarget, pose_target
from teleop_sim.robot.skill import Done, Motion
from teleop_sim.robot.skills.holding import has_it, refusal
from teleop_sim.robot.skills.manipulate import Arm, arm_of
from teleop_sim.robot.skills.servoing import Led, line, posture_for, stay

SPEED_M_S = 0.12
"""Assumed: what hangs in the hand swings little."""


def carry(body: Body, command: Carry, rng: np.random.Generator) -> Motion:
    """See ``Carry``; data: the weight felt [N]."""
    arm = arm_of(body, command.side)
    led = Led(arm)
    mass_kg = led.told_kg
    target = _carrying(arm)
    posed = posture_for(arm, target, rng, arm.reference())
    why = refusal(posed, "the carrying place")
    if why is not None:
        return Done("no_plan", why)
    led.goal = posed.solution.q
    length_m = float(np.linalg.norm(target.position - arm.hand()[1]))
    yield from line(led, target.position, target.rotation, max(1.0, length_m / SPEED_M_S), settle_s=0.4)
    yield from stay(led, 0.4)
    if mass_kg > 0.0 and not has_it(led, mass_kg):
        weight_n = led.weight_n
        led.tell(0.0)
        return Done("lost", f"only {weight_n:.1f} N left at the wrist", weight_n)
    return Done("carried", f"{led.weight_n:.1f} N at the wrist", led.weight_n)


def _carrying(arm: Arm) -> PoseTarget:
    """The hand's pose for carrying: level, its jaws one over the other as now, where the robot's data say."""
    figures = hand_stand(arm.robot)
    x, y, yaw = body_between(arm.body.feet())
    ahead, aside, up = figures.carry
    left = aside if arm.side == "left" else -aside
    c, s = math.cos(yaw), math.sin(yaw)
    place = np.array([x + c * ahead - s * left, y + s * ahead + c * left, arm.body.ground_z_m() + up])
    inwards = yaw + figures.inwards_rad * (1.0 if arm.side == "right" else -1.0)
    z = np.array([math.cos(inwards), math.sin(inwards), 0.0])
    up_now = arm.hand()[0][2, 0]
    x_axis = np.array([0.0, 0.0, math.copysign(1.0, up_now)])
    return pose_target(place, np.column_stack([x_axis, np.cross(z, x_axis), z]))
