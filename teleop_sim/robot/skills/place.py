"""Place: lower what a hand holds until the ground bears it, open, draw back."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Place
from teleop_sim.robot.skill import Done, Motion, Tick
from teleop_sim.robot.skills.holding import draw_back, has_it, kept_posture, let_go, refusal, strayed
from teleop_sim.robot.skills.manipulate import arm_of
from teleop_sim.robot.skills.servoing import UP, Led, line, stay

OVER_M = 0.08
"""Height over its place to which the thing is brought first (assumed)."""
UNDER_M = 0.05
"""How much further down the ground may be than believed (assumed)."""
LOWER_M_S = 0.04
BORNE = 0.4
"""Share of its weight that the hand still feels when the ground is said to bear a thing (assumed)."""


def place(body: Body, command: Place, rng: np.random.Generator) -> Motion:
    """See ``Place``; data: the height of the hand over where it should have been when the ground took the load [m]."""
    arm, handle = arm_of(body, command.side), command.handle
    led = Led(arm)
    mass_kg = led.told_kg if led.told_kg > 0 else handle.mass_kg
    target, posed = kept_posture(arm, handle, rng)
    why = refusal(posed, "the place")
    if why is not None:
        return Done("no_plan", why)
    led.goal = posed.solution.q
    over = target.position + OVER_M * UP
    length_m = float(np.linalg.norm(over - arm.hand()[1]))
    yield from line(led, over, target.rotation, max(1.5, length_m / 0.12), settle_s=0.6)
    why = strayed(led, over, target.rotation)
    if why is not None:
        return Done("no_plan", why)
    if not has_it(led, mass_kg):
        led.tell(0.0)
        return Done("lost", f"only {led.weight_n:.1f} N at the wrist over the place")
    down = yield from _lower(led, over, target.rotation, mass_kg)
    if not down:
        return Done("no_ground", f"still {led.weight_n:.1f} N at the wrist, {UNDER_M * 100:.0f} cm below the place")
    off_m = float(arm.hand()[1][2] - target.position[2])
    yield from stay(led, 0.3)
    yield from let_go(led)
    yield from draw_back(led)
    return Done("placed", f"the ground took it {off_m * 1e3:+.0f} mm off where it was believed", off_m)


def _lower(led: Led, over: np.ndarray, rotation: np.ndarray, mass_kg: float) -> Generator[Tick, None, bool]:
    """Down until the wrist feels little of the weight; the controller is told of less as the ground takes over."""
    depth_m = OVER_M + UNDER_M
    few_n = BORNE * mass_kg * 9.81
    lowering = line(led, over - depth_m * UP, rotation, depth_m / LOWER_M_S)
    calm = 0
    for tick in lowering:
        yield tick
        led.follow_weight(None, mass_kg)
        calm = calm + 1 if led.weight_n < few_n else 0
        if calm >= 5:
            led.tell(0.0)
            return True
    return False
