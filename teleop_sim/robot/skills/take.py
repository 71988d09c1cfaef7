"""Take: bring a hand round, or into, something that does not come along; guarded, and judged by what is felt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Take
from teleop_sim.robot.skill import Done, Motion
from teleop_sim.robot.skills.enter import blocked, come_before, entry_to, go_in, refusal, way_to
from teleop_sim.robot.skills.fingers import SHUT_S, close
from teleop_sim.robot.skills.holding import draw_back
from teleop_sim.robot.skills.manipulate import JAW_OPEN, JAW_SHUT, arm_of, move_jaws
from teleop_sim.robot.skills.servoing import Led


def take(body: Body, command: Take, rng: np.random.Generator) -> Motion:
    """See ``Take``; data: ``TakeReport`` once the hand has gone in or met something."""
    arm, handle = arm_of(body, command.side), command.handle
    entry = entry_to(arm, handle, rng)
    why = refusal(entry.solution)
    if why:
        return Done("no_plan", why)
    way = way_to(arm, handle, entry)
    if way.touches is not None:
        return Done("no_plan", "no way there: {} would touch {}".format(*way.touches))
    yield from move_jaws(arm, JAW_SHUT if command.shut else JAW_OPEN, SHUT_S)
    led = Led(arm)
    yield from come_before(led, handle, entry, way)
    report = yield from go_in(led, handle, entry)
    why = blocked(report)
    if why:
        yield from draw_back(led)
        return Done("blocked", why, report)
    if not command.shut:
        yield from close(led)
    report = replace(report, squeeze_n=body.hand_force(command.side), jaws_m=body.jaw_gap(command.side))
    return Done("taken", f"{report.squeeze_n:.0f} N on the jaws", report)
