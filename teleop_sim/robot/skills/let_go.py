"""LetGo: lose the load, open, draw straight back, come home."""

from __future__ import annotations

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import LetGo
from teleop_sim.robot.skill import Done, Motion
from teleop_sim.robot.skills.fingers import YIELD_S, give_way
from teleop_sim.robot.skills.holding import draw_back
from teleop_sim.robot.skills.holding import let_go as open_hand
from teleop_sim.robot.skills.manipulate import JAW_OPEN, arm_of, move_jaws
from teleop_sim.robot.skills.servoing import Led


def let_go(body: Body, command: LetGo, rng: np.random.Generator) -> Motion:
    """See ``LetGo``. The way back starts where the hand is felt to be, and goes along its own approach axis."""
    arm = arm_of(body, command.side)
    led = Led(arm)
    yield from give_way(led)
    if not command.shut:
        yield from open_hand(led)
    yield from draw_back(led)
    if command.shut:
        yield from move_jaws(arm, JAW_OPEN, YIELD_S)
    return Done("released", "arm home")
