"""Fingers: close or open a hand where it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Fingers
from teleop_sim.robot.skill import Done, Motion, Tick
from teleop_sim.robot.skills.holding import let_go as open_hand
from teleop_sim.robot.skills.manipulate import JAW_SHUT, Ticks, arm_of, move_jaws
from teleop_sim.robot.skills.servoing import Led, stay

SHUT_S = 0.6
YIELD_S = 0.6
"""For the arm to be pushed to where the thing would have it (assumed: as long as a hand takes to open)."""


@dataclass(frozen=True)
class FingersReport:
    """What the hand feels afterwards: force on its jaws [N], their places [m or rad]."""

    squeeze_n: float
    jaws_m: tuple[float, ...]


def fingers(body: Body, command: Fingers, rng: np.random.Generator) -> Motion:
    """See ``Fingers``; data: ``FingersReport``. A hand that holds a weight is opened by ``Place`` or ``LetGo``."""
    led = Led(arm_of(body, command.side))
    if command.close:
        yield from close(led)
    else:
        yield from give_way(led)
        yield from open_hand(led)
        yield from stay(led, 0.2)
    report = FingersReport(body.hand_force(command.side), body.jaw_gap(command.side))
    return Done("closed" if command.close else "opened", f"{report.squeeze_n:.0f} N on the jaws", report)


def close(led: Led) -> Ticks:
    """Shut the jaws. The arm gives way meanwhile: not the thing, but the hand is to move."""
    for tick in move_jaws(led.arm, JAW_SHUT, SHUT_S):
        led.jaws = tick.jaws
        led.feel_wrist()
        yield Tick(led.yielding(), jaws=tick.jaws)
    yield from stay(led, 0.4)


def give_way(led: Led) -> Ticks:
    """Let the arm be pushed to where the thing in the hand would have it, so that nothing springs."""
    for _ in range(round(YIELD_S / led.arm.body.tick_s)):
        led.feel_wrist()
        yield Tick(led.yielding(), jaws=led.jaws)
