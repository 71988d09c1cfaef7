"""Affordances of a door and a valve as a robot carries them out, from where its hand is.

The library says what an affordance is; how it is done is our robots'. A lever is turned by 55 degrees, past its
latch and short of its stop (published: 60); *push* and *pull* follow the door's swing about its hinges (published: a
straight line of 5 cm, which bends no wrist but lets the lever slide through the hand); the wheel is turned by strokes
as long as the arm reaches, with new grips between them (published: one stroke of 370 degrees, about Atlas' last joint).

Amounts count in the sense of the affordance's name; zero is what it does by itself. Figures are those of
``benchmarks/door_study.py`` and ``benchmarks/valve_study.py``, with which the rates in docs/physics.md were measured.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from teleop_sim.robot.affordance import Affordance
from teleop_sim.robot.commands import Act, LetGo
from teleop_sim.robot.drc_plans import door_swing, lever_turn, wheel_turn
from teleop_sim.robot.hands import base_name
from teleop_sim.robot.programs.steps import Memory, Reply, Step
from teleop_sim.robot.programs.template_hands import GIVE_WAY_N, HELD_RAD, TOOL, TURN_N, enter, grasp, retreat
from teleop_sim.robot.programs.template_work import (
    DOOR,
    Instance,
    StepOutcome,
    StepProgram,
    Work,
    amount_of,
    do,
    reach_of,
    remember,
    told,
    work_of,
)
from teleop_sim.templates.elements import Affordance as Published
from teleop_sim.world import door

TURN_RAD = math.radians(55.0)
PUSH_RAD: Mapping[str, float] = MappingProxyType({"atlas": math.radians(20.0), "thormang3": math.radians(16.0)})
"""As far as the arm reaches from where the robot stands."""
FORCE_N: Mapping[str, float] = MappingProxyType({"atlas": 100.0, "thormang3": 50.0})
"""Of the wrist at a wheel: what each stops at."""
PUSH_N: Mapping[str, float] = MappingProxyType({"atlas": 80.0, "thormang3": 30.0})
"""Of the wrist at a door, beyond what it holds already: 25 N at a metre shift THORMANG3's pressure by 6 cm, and its
soles give it 10, of which the lever takes half; a latched door pushed harder fells it. An unlatched one takes 5."""
PUSHES, STUCK_RAD, FURTHER_RAD = 3, math.radians(2.0), math.radians(10.0)
"""Pushes of a door; one that went no further has met its latch, and the lever is turned by that more (assumed)."""
GRIPS, LEAST_RAD, SEEK_RAD = 3, math.radians(10.0), 0.5
"""Grips of a wheel; what may be left undone; as far as a rod goes in its gap before it touches."""
SHARE = 0.95
"""Of what is in reach, where not all of it is."""


def affordance(memory: Memory, at: Instance, which: int, amount: float) -> StepProgram:
    """Carry out an affordance of the template by its id in the library."""
    known = at.affordance(which)
    if known is None:
        return StepOutcome("refused", 0.0, f"a {at.template} has no affordance {which}")
    if at.template == DOOR:
        return (yield from _of_door(memory, at, known, amount))
    return (yield from _of_valve(memory, at, known, amount))


def default_amount(robot: str, template: str, known: Published) -> float:
    """How far an affordance goes by itself, in its own sense [m or rad]."""
    if template == DOOR and known.name.startswith("turn"):
        return min(abs(known.amount), TURN_RAD)
    if template == DOOR and known.name in ("push", "pull"):
        return PUSH_RAD[base_name(robot)] * _arm_m()
    return abs(known.amount)


# The door


def _of_door(memory: Memory, at: Instance, known: Published, amount: float) -> StepProgram:
    work = work_of(memory, at)
    if work.hand == "home":
        return StepOutcome("no_plan", 0.0, "the hand is at home")
    wanted = amount or default_amount(at.robot, at.template, known)
    match known.name:
        case "turnCW":
            return (yield from _turn(memory, at, wanted, 1.0))
        case "turnCCW":
            return (yield from _turn(memory, at, wanted, -1.0))
        case "push":
            return (yield from _swing(memory, at, wanted, 1.0))
        case "pull":
            return (yield from _swing(memory, at, wanted, -1.0))
    axis, _ = known.at(at.pose)
    line = Affordance("linear", axis)
    reply = yield from do(_firm(at, line, math.copysign(1.0, known.amount) * wanted, PUSH_N))
    return told(reply, math.copysign(1.0, known.amount) * amount_of(reply))


def _firm(at: Instance, what: Affordance, amount: float, limit_n: Mapping[str, float]) -> Act:
    return Act(at.side, what, amount, TOOL, limit_n[base_name(at.robot)], rigid=True, give_way_n=GIVE_WAY_N)


def _turn(memory: Memory, at: Instance, wanted_rad: float, sense: float) -> StepProgram:
    """Turn the lever, down with sense +1; a lever that is held down comes up no further than it was."""
    work = work_of(memory, at)
    goal = sense * wanted_rad
    if goal < 0.0 < work.lever_rad:
        goal = max(goal, -work.lever_rad)
    reply = yield from do(_firm(at, lever_turn(work.lever), goal, TURN_N))
    went = amount_of(reply)
    _felt(memory, replace(work, lever_rad=max(work.lever_rad + went, 0.0)), reply)
    return told(reply, sense * went)


def _swing(memory: Memory, at: Instance, wanted_m: float, sense: float) -> StepProgram:
    """Swing the door, open with sense +1, as far as the arm goes; amounts are metres of the lever's way."""
    arm_m = _arm_m()
    goal, went = sense * wanted_m / arm_m, 0.0
    reply = yield from _swung(memory, at, goal)
    for _ in range(PUSHES - 1):
        went += amount_of(reply)
        if reply.outcome not in ("force_limit", "no_motion") or abs(goal - went) < STUCK_RAD:
            return told(reply, sense * went * arm_m)
        if abs(went) < STUCK_RAD and work_of(memory, at).lever_rad > HELD_RAD:
            turned = yield from _turn(memory, at, FURTHER_RAD, 1.0)
            if turned.outcome == "grip_lost":
                return turned
        reply = yield from _swung(memory, at, goal - went)
    return told(reply, sense * (went + amount_of(reply)) * arm_m)


def _swung(memory: Memory, at: Instance, amount_rad: float) -> Generator[Step, Any, Reply]:
    """One push, as far as the arm goes."""
    swing = door_swing(at.place)
    reply = yield from do(_firm(at, swing, amount_rad, PUSH_N))
    if reach := reach_of(reply):
        reply = yield from do(_firm(at, swing, SHARE * reach, PUSH_N))
    work = work_of(memory, at)
    _felt(memory, replace(work, opened_rad=max(work.opened_rad + amount_of(reply), 0.0)), reply)
    return reply


def _arm_m() -> float:
    """From the hinges to the lever's axis."""
    return math.hypot(door.HINGE[0], door.HINGE[1])


def _felt(memory: Memory, work: Work, reply: Reply) -> None:
    """Remember how far the thing went; a hand that has lost it holds nothing, and the lever springs up."""
    remember(memory, replace(work, hand="astray", lever_rad=0.0) if reply.outcome == "grip_lost" else work)


# The valve


def _of_valve(memory: Memory, at: Instance, known: Published, amount: float) -> StepProgram:
    match known.name:
        case "insert":
            return (yield from grasp(memory, at))
        case "extract":
            return (yield from retreat(memory, at, amount or abs(known.amount)))
    wanted = amount or abs(known.amount)
    if known.name == "close" and work_of(memory, at).hand != "at":
        return StepOutcome("reached", 0.0, "a rod needs no turning back: it goes in where its stroke begins")
    return (yield from _wheel(memory, at, wanted, 1.0 if known.name == "open" else -1.0))


def _wheel(memory: Memory, at: Instance, wanted_rad: float, sense: float) -> StepProgram:
    """Turn the wheel: a stroke as far as the arm goes, out, in again, and on."""
    left, done = wanted_rad, 0.0
    end = StepOutcome("reached")
    for grip in range(GRIPS):
        if grip and work_of(memory, at).hand == "at":
            yield from _out(memory, at)
        if work_of(memory, at).hand not in ("at", "led"):
            end = yield from enter(memory, at)
            if end.outcome != "reached":
                break
        reply = yield from _stroke(at, sense * left)
        if reply.outcome == "grip_lost" and abs(amount_of(reply)) < SEEK_RAD:
            # It has found nothing to push yet.
            reply = yield from _stroke(at, sense * left)
        went = sense * amount_of(reply)
        left, done = left - went, done + went
        work = work_of(memory, at)
        remember(memory, replace(work, turned_rad=work.turned_rad + sense * went))
        end = told(reply)
        if left < LEAST_RAD:
            end = StepOutcome("reached", 0.0, reply.cause)
            break
    return replace(end, amount=done)


def _stroke(at: Instance, left_rad: float) -> Generator[Step, Any, Reply]:
    """One turn of what is left, or of as much of it as is in reach."""
    reply = yield from do(_braced(at, left_rad))
    if abs(reach := reach_of(reply)) > LEAST_RAD:
        reply = yield from do(_braced(at, SHARE * reach))
    return reply


def _braced(at: Instance, amount_rad: float) -> Act:
    limit_n = FORCE_N[base_name(at.robot)]
    return Act(at.side, wheel_turn(at.place), amount_rad, TOOL, limit_n, give_way_n=GIVE_WAY_N, braced=True)


def _out(memory: Memory, at: Instance) -> Generator[Step, Any, None]:
    work = work_of(memory, at)
    remember(memory, replace(work, hand="astray"))
    yield from do(LetGo(at.side, shut=True))
    remember(memory, replace(work, hand="home", closed=False, gap=0))
