"""Steps of the template workflow that bring a hand somewhere: before a handle, in, back, home; and its fingers."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from teleop_sim.robot.affordance import Usability
from teleop_sim.robot.commands import Act, Fingers, Grasp, LetGo, Posture, PreGrasp, Retreat
from teleop_sim.robot.commands import Step as Stride
from teleop_sim.robot.drc_plans import lever_turn
from teleop_sim.robot.hands import base_name
from teleop_sim.robot.programs.steps import Memory, Reply, Step
from teleop_sim.robot.programs.template_work import (
    GAPS,
    Instance,
    Part,
    StepOutcome,
    StepProgram,
    Work,
    do,
    here_of,
    near,
    obstacles,
    remember,
    told,
    way_to,
    work_of,
)

TOOL = Usability("bars", (0.0, 0.0, 0.0))
"""The hand as a tool that nothing guides: it keeps to the believed path and holds against what springs back."""
GIVE_WAY_N = 15.0
"""Sideways force beyond which even such a hand gives way, as in ``benchmarks/door_study.py``."""
TURN_N: Mapping[str, float] = MappingProxyType({"atlas": 80.0, "thormang3": 45.0})
"""Of the wrist at a lever, beyond what it holds already. A lever resists with 18 to 45 N; 40 N down half a metre ahead
shift THORMANG3's pressure by 5 cm."""
STEPS_BACK, BACK_M, WALL = 2, 0.04, "wall"
"""A hand that has no room between the body and the thing gets it by a step back: with 4 cm all of three that had no way
found one (measured)."""
HELD_RAD = 0.05
"""A lever that is felt to be held down by less is up (assumed)."""
HOME = "walk"
"""Posture with both arms at home: what a robot walks in."""


def stand(memory: Memory, at: Instance) -> StepProgram:
    """Walk to where the thing is in reach, hand at home first. There is one measured stand a robot."""
    yield from free(memory)
    here = here_of(memory)
    if near(here, at.stand):
        return StepOutcome("reached", 0.0, "it stands there already")
    return told((yield from do(way_to(here, at.stand))))


def pregrasp(memory: Memory, at: Instance, preference: int) -> StepProgram:
    """Bring the hand, open or as a rod, 10 cm before the handle, clear of what the world model holds."""
    work = work_of(memory, at)
    if work.hand == "at":
        back = yield from retreat(memory, at)
        if back.outcome != "reached":
            return back
        work = work_of(memory, at)
    work = replace(work, gap=preference % GAPS if at.rod else 0)
    remember(memory, replace(work, hand="astray"))
    reply = yield from _before(memory, at, work)
    for _ in range(STEPS_BACK):
        if reply.outcome != "no_plan" or WALL not in reply.cause or work.hand != "home":
            break
        yield from do(Stride(forward_m=-BACK_M))
        reply = yield from _before(memory, at, work)
    if reply.outcome == "reached":
        remember(memory, replace(work, hand="before", closed=at.rod))
    elif reply.outcome == "no_plan":
        # It has not moved.
        remember(memory, work)
    return told(reply)


def _before(memory: Memory, at: Instance, work: Work) -> Generator[Step, Any, Reply]:
    return (yield from do(PreGrasp(at.side, work.handle, at.rod, obstacles(memory))))


def grasp(memory: Memory, at: Instance) -> StepProgram:
    """Lead the hand straight in. A rod that meets something tries the next gaps; a hand that is in comes out first."""
    work = work_of(memory, at)
    if work.hand == "at":
        again = yield from pregrasp(memory, at, work.gap)
        if again.outcome != "reached":
            return again
    reply = yield from _lead_in(memory, at)
    work = work_of(memory, at)
    for _ in range(GAPS - 1):
        if not at.rod or reply.outcome != "blocked":
            break
        reply = yield from pregrasp(memory, at, work.gap + 1)
        work = work_of(memory, at)
        if reply.outcome == "reached":
            reply = yield from _lead_in(memory, at)
    return reply


def enter(memory: Memory, at: Instance) -> StepProgram:
    """Both, from wherever the hand is."""
    reply = yield from pregrasp(memory, at, 0)
    if reply.outcome == "reached":
        reply = yield from grasp(memory, at)
    return reply


def _lead_in(memory: Memory, at: Instance) -> StepProgram:
    work = work_of(memory, at)
    remember(memory, replace(work, hand="astray"))
    reply = yield from do(Grasp(at.side, work.handle, at.rod))
    place = "at" if reply.outcome == "reached" else "before" if reply.outcome == "blocked" else work.hand
    remember(memory, replace(work, hand=place))
    return told(reply)


def fingers(memory: Memory, at: Instance, close: bool) -> StepProgram:
    """Close or open the hand where it is. Whoever has led it somewhere and closes it there means it to hold."""
    reply = yield from do(Fingers(at.side, close))
    work = work_of(memory, at)
    remember(memory, replace(work, closed=close, hand="at" if close and work.hand == "led" else work.hand))
    return told(reply)


def retreat(memory: Memory, at: Instance, distance_m: float = 0.10) -> StepProgram:
    """Straight back from a handle: a lever is let up and the hand opened first."""
    yield from let_up(memory, at)
    work = work_of(memory, at)
    if work.closed and not at.rod:
        yield from fingers(memory, at, False)
    work = work_of(memory, at)
    remember(memory, replace(work, hand="astray"))
    reply = yield from do(Retreat(at.side, work.handle, distance_m))
    remember(memory, replace(work, hand="before" if reply.outcome == "reached" else "astray"))
    return told(reply)


def let_up(memory: Memory, at: Instance) -> Part:
    """A held lever goes back up in the hand: let go, it would spring."""
    work = work_of(memory, at)
    if work.hand == "at" and work.lever_rad > HELD_RAD:
        lever, limit_n = lever_turn(work.lever), TURN_N[base_name(at.robot)]
        yield from do(Act(at.side, lever, -work.lever_rad, TOOL, limit_n, rigid=True, give_way_n=GIVE_WAY_N))
        remember(memory, replace(work, lever_rad=0.0))


def release(memory: Memory, at: Instance) -> StepProgram:
    """Let go and come home."""
    yield from let_up(memory, at)
    work = work_of(memory, at)
    remember(memory, replace(work, hand="astray"))
    reply = yield from do(LetGo(at.side, at.rod))
    remember(memory, replace(work, hand="home", closed=False, lever_rad=0.0))
    return told(reply)


def home(memory: Memory, at: Instance) -> StepProgram:
    """Bring the arm home, off the handle first if it is there."""
    if work_of(memory, at).hand != "home":
        reply = yield from release(memory, at)
        return StepOutcome("reached", 0.0, reply.cause)
    return told((yield from do(Posture(HOME))))


def free(memory: Memory) -> Part:
    """Before feet or torso move, the hand comes off whatever it is at."""
    work: Work | None = memory.facts.get("work")
    if work is not None and work.hand != "home":
        yield from release(memory, work.at)
