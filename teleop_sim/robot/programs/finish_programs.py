"""From the console to the finish: step back, find the finish square, walk to it."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np

from teleop_sim.robot.commands import Cloud, Detect, Look, Posture
from teleop_sim.robot.commands import Step as Stride
from teleop_sim.robot.programs.console_programs import sweep
from teleop_sim.robot.programs.doing import Doing
from teleop_sim.robot.programs.places import wrap
from teleop_sim.robot.programs.steps import Program, Show, Step
from teleop_sim.robot.sightings import FinishFix

BACK_M = 0.5
"""Two strides of 0.25 m (WPI, val_task1.cpp)."""


def detect_finish(doing: Doing) -> Program:
    """Step back and turn once, then look for an unvisited square in all that was swept."""
    yield from doing.let_go()
    if doing.memory.facts.pop("at_console", False):
        yield from _retreat(doing)
    elif doing.tries > 1 and "place" in doing.memory.facts:
        # The same view twice in vain: another one, from a place where the robot has stood (assumed; WPI looked on).
        yield from doing.walk((doing.memory.facts["place"],), doing.pacing.walk_start_s)
    yield from sweep(doing, None)
    cloud = merged(tuple(doing.memory.facts.get("clouds", {}).values()))
    reply = yield from doing.do(Detect("finish", "fine", cloud=cloud, visited=(*doing.visited, doing.here)))
    yield Show()
    if not isinstance(reply.data, FinishFix):
        return (yield from doing.retry("/DETECT_FINISH_RETRY", f"finish box not found: {reply.cause}"))
    doing.memory.facts["finish"] = reply.data
    doing.spent_s = 0.0
    yield from doing.do(Posture("walk"))
    yield from doing.fill(doing.pacing.posture_reset_s, "posture reset")
    x, y, _ = reply.data.centre
    return (yield from doing.done("/DETECT_FINISH_SUCESSFUL", f"finish box centre at ({x:.2f}, {y:.2f})"))


def _retreat(doing: Doing) -> Generator[Step, Any, None]:
    """Two strides back, then the heading of the start, as WPI turned."""
    yield from doing.do(Look(0.0, 0.0, doing.pacing.head_move_s))
    doing.spent_s = 0.0
    yield from doing.do(Stride(forward_m=-BACK_M))
    yield from doing.fill(doing.pacing.retreat_s, "two strides back")
    yield from doing.do(Stride(turn_rad=wrap(-doing.here[2])))
    yield from doing.fill(doing.pacing.turn_s, "turn")


def walk_to_finish(doing: Doing) -> Program:
    """Walk over the walkway into the finish square."""
    fix: FinishFix | None = doing.memory.facts.get("finish")
    if fix is None:
        return (yield from doing.retry("/WALK_TO_FINISH_RETRY", "no finish box known"))
    if (yield from doing.walk(fix.path, doing.pacing.finish_start_s)):
        return (yield from doing.done("/WALK_TO_FINISH_SUCESSFUL", "reached the finish box, task completed"))
    return (yield from doing.retry("/WALK_TO_FINISH_RETRY", "stopped short of the finish box"))


def merged(clouds: tuple[Cloud, ...]) -> Cloud | None:
    """All sweeps as one cloud, (n, 3) points; None if there was none."""
    if not clouds:
        return None
    return Cloud(np.concatenate([c.points for c in clouds]), clouds[-1].origin)
