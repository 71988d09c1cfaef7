"""Pick: come to a handle, close until it is felt, lift, and believe only the wrist about what is in the hand."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Pick
from teleop_sim.robot.skill import Done, Motion, Tick
from teleop_sim.robot.skills.holding import (
    best_posture,
    close,
    come_to,
    draw_back,
    has_it,
    hold_of,
    let_go,
    refusal,
)
from teleop_sim.robot.skills.manipulate import JAW_OPEN, arm_of
from teleop_sim.robot.skills.servoing import UP, Hold, Led, line, stay
from teleop_sim.world.plant import GRAVITY_M_S2

APPROACH_S = 2.0
LIFT_S = 1.8
WATCH_S = 0.6
BLOCKED_N = 25.0
"""Force on the open hand that stops its approach (assumed: a jaw that brushes a bar gives some newtons)."""
MOST = 1.5
"""The told mass is believed up to so many times (assumed)."""


@dataclass(frozen=True)
class PickReport:
    """What was felt: the jaws' force after closing [N], their places [m], the weight after lifting [N], as a mass [kg];
    how far the hand was off where it should have closed [m].
    """

    squeeze_n: float
    jaws_m: tuple[float, ...]
    weight_n: float
    told_kg: float
    off_m: float


def pick(body: Body, command: Pick, rng: np.random.Generator) -> Motion:
    """See ``Pick``; data: ``PickReport`` once the hand has closed."""
    arm, handle = arm_of(body, command.side), command.handle
    target, posed = best_posture(arm, handle, rng)
    why = refusal(posed, "the handle")
    if why is not None:
        return Done("no_plan", why)
    led = Led(arm)
    led.jaws = arm.jaws(JAW_OPEN)
    off_m = yield from come_to(arm, led, posed, target)
    if off_m > 0.012:
        return Done("no_plan", f"the way to the handle is out of reach: the hand stays {off_m * 1e3:.0f} mm off it")
    met = yield from line(led, target.position, target.rotation, APPROACH_S, lambda: _met(led))
    if met:
        force_n = float(np.linalg.norm(led.force()))
        yield from draw_back(led)
        return Done("blocked", f"{force_n:.0f} N on the open hand before it was there")
    off_m = float(np.linalg.norm(arm.hand()[1] - target.position))
    yield from close(led)
    yield from stay(led, 0.2)
    squeeze_n, jaws_m = body.hand_force(command.side), body.jaw_gap(command.side)
    hold = hold_of(handle)
    yield from _lift(led, hold, command.lift_m)
    yield from stay(led, WATCH_S)
    report = PickReport(squeeze_n, jaws_m, led.weight_n, led.told_kg, off_m)
    if has_it(led, handle.mass_kg):
        led.tell(led.weight_n / GRAVITY_M_S2)
        return Done("held", f"{led.weight_n:.1f} N at the wrist", report)
    yield from let_go(led)
    yield from draw_back(led)
    return Done("missed", f"only {report.weight_n:.1f} N at the wrist after lifting", report)


def _met(led: Led) -> bool:
    return float(np.linalg.norm(led.force())) > BLOCKED_N


def _lift(led: Led, hold: Hold, height_m: float) -> Generator[Tick, None, None]:
    """Straight up; the controller is told of the weight as it comes into the hand."""
    rotation, position = led.arm.hand()
    for tick in line(led, position + height_m * UP, rotation, LIFT_S, settle_s=0.6):
        yield tick
        led.follow_weight(hold, MOST * hold.mass_kg)
