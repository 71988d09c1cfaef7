"""PreGrasp: a hand to before a handle, on a way that touches nothing known of."""

from __future__ import annotations

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import PreGrasp
from teleop_sim.robot.skill import Done, Motion
from teleop_sim.robot.skills.enter import come_before, entry_to, refusal, way_to
from teleop_sim.robot.skills.fingers import SHUT_S
from teleop_sim.robot.skills.manipulate import JAW_OPEN, JAW_SHUT, arm_of, move_jaws
from teleop_sim.robot.skills.servoing import Led


def pre_grasp(body: Body, command: PreGrasp, rng: np.random.Generator) -> Motion:
    """See ``PreGrasp``. Planned as far as the handle, so that a hand that is before it can go in."""
    arm, handle = arm_of(body, command.side), command.handle
    entry = entry_to(arm, handle, rng)
    why = refusal(entry.solution)
    if why:
        return Done("no_plan", why)
    way = way_to(arm, handle, entry, command.obstacles)
    if way.touches is not None:
        return Done("no_plan", "no way there: {} would touch {}".format(*way.touches))
    yield from move_jaws(arm, JAW_SHUT if command.shut else JAW_OPEN, SHUT_S)
    yield from come_before(Led(arm), handle, entry, way)
    return Done("reached", "before the handle")
