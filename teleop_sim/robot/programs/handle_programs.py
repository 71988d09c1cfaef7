"""At the console: grasp a handle, turn it until the dish is right, look again when that fails."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from typing import Any

from teleop_sim.robot.commands import CircularAffordance, Follow, Grip, Posture, Reach, Side, Walk
from teleop_sim.robot.programs.claims import claim_of_fix
from teleop_sim.robot.programs.console_programs import look_again
from teleop_sim.robot.programs.doing import Doing
from teleop_sim.robot.programs.places import move, near, stance, worth
from teleop_sim.robot.programs.steps import AskStatus, Program, Reply, Show, Step
from teleop_sim.robot.sightings import ConsoleFix

Body = Callable[[Doing], Program]


@dataclass(frozen=True)
class Axis:
    """One axis of the dish: the hand that turns its wheel, and WPI's names for what happens."""

    name: str
    side: Side

    @property
    def grasp(self) -> str:
        """Stem of the events of the grasping state."""
        return f"{self.name.upper()}_HANDLE"

    @property
    def correct(self) -> str:
        """Stem of the events of the correcting state."""
        return f"/{self.name.upper()}_CORRECTION"

    def handle(self, fix: ConsoleFix) -> CircularAffordance:
        """The handle that turns it."""
        return fix.pitch_handle if self.name == "pitch" else fix.yaw_handle


PITCH, YAW = Axis("pitch", "right"), Axis("yaw", "left")


def grasp(axis: Axis) -> Body:
    """The grasping state of an axis."""

    def body(doing: Doing) -> Program:
        doing.memory.facts["axis"] = axis.name
        yield from doing.let_go()
        if doing.tries > 0:
            # WPI tried the same place up to 20 times; a hand that missed learns nothing from that (assumed).
            yield from look_again(doing)
        doing.spent_s = 0.0
        fix: ConsoleFix | None = doing.memory.facts.get("fix")
        if fix is None:
            return (yield from doing.retry(f"/GRASP_{axis.grasp}_RETRY", "no handle known"))
        yield from _align(doing, fix, axis)
        felt, why = yield from _take(doing, axis, axis.handle(fix))
        if felt:
            yield Show()
            return (yield from doing.done(f"/GRASPED_{axis.grasp}", f"{axis.side} hand feels the handle"))
        yield from doing.let_go()
        return (yield from doing.retry(f"/GRASP_{axis.grasp}_RETRY", f"{axis.side} hand does not feel it: {why}"))

    return body


def _align(doing: Doing, fix: ConsoleFix, axis: Axis) -> Generator[Step, Any, None]:
    """Side-step, or walk if something took the robot away, to where the hand reaches all of the circle."""
    goal = stance(fix, axis.side, doing.stand)
    step = move(doing.here, goal)
    if not worth(step):
        return
    if near(step):
        yield from doing.do(step)
    else:
        doing.memory.facts["at_console"] = True
        yield from doing.do(Walk((goal,)))
    yield from doing.fill(doing.pacing.side_step_s, "side-step")


def _take(doing: Doing, axis: Axis, handle: CircularAffordance) -> Generator[Step, Any, tuple[bool, str]]:
    """Reach, close, feel. Takes at least as long as WPI's sequence."""
    doing.memory.facts["holding"] = (axis.side, handle)
    reply = yield from doing.do(Reach(axis.side, handle))
    felt = False
    if reply.outcome == "reached":
        reply = yield from doing.do(Grip(axis.side, close=True))
        felt = reply.outcome == "felt"
    yield from doing.fill(doing.pacing.grasp_s, "grasp")
    return felt, reply.cause


def correct(axis: Axis) -> Body:
    """The correcting state of an axis: turn, let go, wait until the scorer counts it."""

    def body(doing: Doing) -> Program:
        status = yield AskStatus()
        why, event = f"dish {axis.name} left its tolerance", f"{axis.correct}_RETRY"
        if not _is(status, axis, "ok"):
            why, event = yield from _turn(doing, axis, status)
            status = yield AskStatus()
        doing.spent_s = 0.0
        yield from doing.let_go()
        if not _is(status, axis, "ok"):
            return (yield from doing.retry(event, why))
        yield from _hold(doing)
        status = yield AskStatus()
        if _is(status, axis, "done"):
            return (yield from _corrected(doing, axis, status))
        if _is(status, axis, "ok"):
            yield from doing.say(f"dish {axis.name} in tolerance, not yet held long enough")
            return f"{axis.correct}_EXECUTING"
        return (yield from doing.retry(f"{axis.correct}_RETRY", f"dish {axis.name} left its tolerance"))

    return body


def _turn(doing: Doing, axis: Axis, status: Mapping[str, float]) -> Generator[Step, Any, tuple[str, str]]:
    """Turn the handle towards the target. Returns why it may have failed and what to raise then."""
    retry = f"{axis.correct}_RETRY"
    if not status:
        return "the dish sends no status", retry
    if doing.holding is None:
        return "no handle in the hand", retry
    error_rad = status[f"{axis.name}_target"] - status[f"dish_{axis.name}"]
    limit_s = doing.pacing.turning_limit_s
    # Clockwise, seen from above, increases the dish's angle (rules of the task).
    direction = -int(math.copysign(1, error_rad))
    side, handle = doing.holding
    signal, target = f"dish_{axis.name}", status[f"{axis.name}_target"]
    yield from doing.say(
        f"dish {axis.name} {error_rad:+.3f} rad off, turning {'anti' if direction > 0 else ''}clockwise"
    )
    reply: Reply = yield from doing.do(
        Follow(side, handle, direction, signal, target, status["tolerance_rad"], limit_s)
    )
    if reply.outcome == "timed_out":
        return "the planned turn has ended", "!timed_out" if doing.pacing.turning_limit_counts else retry
    return f"{reply.outcome}: {reply.cause}", retry


def _hold(doing: Doing) -> Generator[Step, Any, None]:
    """The task wants the axis held; the arm is brought home meanwhile or before."""
    let_go_s = doing.spent_s
    if let_go_s > 0.0:
        yield from doing.fill(doing.pacing.posture_reset_s, "posture reset")
    yield from doing.pause(doing.pacing.hold_s - (let_go_s if doing.pacing.hold_overlaps else 0.0), "hold")


def _corrected(doing: Doing, axis: Axis, status: Mapping[str, float]) -> Program:
    if axis is YAW and not _is(status, PITCH, "done"):
        doing.memory.facts["axis"] = PITCH.name
        return (yield from doing.retry("!pitch_disturbed", "dish yaw is right, but pitch is not any more"))
    # The events of the original are spelt so.
    return (yield from doing.done(f"{axis.correct}_SUCESSFUL", f"dish {axis.name} correct and held"))


def _is(status: Mapping[str, float], axis: Axis, what: str) -> bool:
    return status.get(f"{axis.name}_{what}", 0.0) > 0.5


def redetect(doing: Doing) -> Program:
    """Arms away, find the handles anew, go back to the axis that was interrupted."""
    yield from doing.let_go()
    yield from doing.do(Posture("walk"))
    yield from doing.fill(doing.pacing.posture_reset_s, "posture reset")
    if not (yield from look_again(doing)):
        return (yield from doing.retry("/REDETECT_HANDLE_RETRY", "handles not found in the cloud"))
    axis = str(doing.memory.facts.get("axis", PITCH.name)).upper()
    event = f"/REDETECTED_HANDLE_GRASP_{axis}"
    yield Show(claim_of_fix(event, doing.memory.facts["fix"], doing))
    return (yield from doing.done(event, "both handles seen again"))
