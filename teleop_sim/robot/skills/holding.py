"""What picking, carrying, placing and inserting share: where the hand can go, jaws that close till they feel."""

from __future__ import annotations

import math
from collections.abc import Generator

import numpy as np

from teleop_sim.robot.commands import Handle
from teleop_sim.robot.grasps import hand_stand
from teleop_sim.robot.pose_ik import PoseTarget, angle_between, pose_target
from teleop_sim.robot.skill import Tick
from teleop_sim.robot.skills.manipulate import JAW_OPEN, Arm, Ticks, follow_path, home, move_jaws
from teleop_sim.robot.skills.servoing import Hold, Led, Posed, line, path_back, posture_for, stay
from teleop_sim.world.plant import GRAVITY_M_S2

SHUT, FELT_N = 1.15, 2.0
"""Jaw reference at which jaws that feel less force than this have met nothing but their stops (assumed)."""
CLOSE_S = 0.8
OPEN_S = 0.6
SETTLE_S = 0.4
REACHED_M, REACHED_RAD = 0.006, 0.08
"""A posture that leaves the hand further off is no plan (assumed: less than the play of an open cage round a bar)."""
ROUND_SPINS = 8
TURN_COST = 0.02
"""Room at the joints' limits that a turn of the held thing must win, per radian (assumed)."""
STRAYED_M, STRAYED_RAD = 0.06, 0.35
"""A led hand that ends so far off has met a joint's limit or a thing (assumed)."""
HAS_SHARE = 0.5
"""Share of a thing's weight that must be felt at the wrist to say that it is in the hand (assumed)."""
BACK_M = 0.14
"""From the handle to where the hand comes from and goes to: the bars' reach beyond the palm is 8 cm (assumed)."""


def rotations(handle: Handle, like: np.ndarray | None = None) -> list[np.ndarray]:
    """Ways in which the tool can be turned at a handle: its z along the approach, its y along the bar.

    At a round one they begin with the turn that is nearest to ``like``.
    """
    z = np.array(handle.approach) / np.linalg.norm(handle.approach)
    if handle.bar is not None:
        bar = np.array(handle.bar) - z * float(z @ np.array(handle.bar))
        first, spins = bar / np.linalg.norm(bar), 2
    else:
        side = np.cross(z, [1.0, 0.0, 0.0] if abs(z[0]) < 0.9 else [0.0, 1.0, 0.0]) if like is None else like[:, 1]
        first, spins = side - z * float(z @ side), ROUND_SPINS
        first = first / np.linalg.norm(first)
    second, found = np.cross(z, first), []
    for k in range(spins):
        turn = math.tau * k / spins
        y = math.cos(turn) * first + math.sin(turn) * second
        found.append(np.column_stack([np.cross(y, z), y, z]))
    return found


def best_posture(
    arm: Arm, handle: Handle, rng: np.random.Generator, start: np.ndarray | None = None
) -> tuple[PoseTarget, Posed]:
    """Of all turns of the tool at a handle the one with most room at the joints' limits, or that comes nearest."""
    tried = []
    for rotation in rotations(handle):
        target = pose_target(np.array(handle.centre), rotation)
        tried.append((target, posture_for(arm, target, rng, start, 6 if handle.bar is not None else 1)))
    return max(tried, key=lambda each: _worth(each[1]))


def kept_posture(arm: Arm, handle: Handle, rng: np.random.Generator) -> tuple[PoseTarget, Posed]:
    """For a thing in the hand: the tool turned little; at a round handle as far as gives the joints room.

    First without another start of the search: the arm must come there with what it holds, not swing over.
    """
    now = arm.hand()[0]
    near = sorted(rotations(handle, now), key=lambda each: angle_between(now, each))
    tried = []
    for rotation in near[:1] if handle.bar is not None else near:
        target = pose_target(np.array(handle.centre), rotation)
        posed = posture_for(arm, target, rng, arm.reference(), restarts=0)
        tried.append((_worth(posed) - TURN_COST * angle_between(now, rotation), target, posed))
    _, target, posed = max(tried, key=lambda each: each[0])
    if not posed.solution.within(REACHED_M, REACHED_RAD):
        posed = posture_for(arm, target, rng, arm.reference())
    return target, posed


def strayed(led: Led, position: np.ndarray, rotation: np.ndarray) -> str | None:
    """In words, that the hand is felt far from where it was led, or None."""
    now, place = led.arm.hand()
    off_m, turn_rad = float(np.linalg.norm(place - position)), angle_between(now, rotation)
    if off_m < STRAYED_M and turn_rad < STRAYED_RAD:
        return None
    return f"the hand came to a stand {off_m * 1e2:.0f} cm and {math.degrees(turn_rad):.0f} degrees off its way"


def _worth(posed: Posed) -> float:
    found = posed.solution
    if found.within(REACHED_M, REACHED_RAD):
        return found.limit_margin_rad
    return -found.position_error_m - 0.1 * found.axis_error_rad


def refusal(posed: Posed, what: str) -> str | None:
    """In words why a posture does not serve, or None."""
    found = posed.solution
    if found.within(REACHED_M, REACHED_RAD):
        return None
    off_mm, turn_deg = found.position_error_m * 1e3, math.degrees(found.axis_error_rad)
    return f"{what} is out of reach: the hand stays {off_mm:.0f} mm and {turn_deg:.0f} degrees off"


def hold_of(handle: Handle) -> Hold:
    """What is told of a thing taken by its handle."""
    return Hold(handle.mass_kg, np.array(handle.to_centre))


def has_it(led: Led, mass_kg: float) -> bool:
    """Whether the wrist feels enough of a weight."""
    return led.weight_n > HAS_SHARE * mass_kg * GRAVITY_M_S2


def close(led: Led, seconds: float = CLOSE_S) -> Ticks:
    """Shut the jaws until they press. The arm gives way meanwhile: not the thing, but the hand is to move."""
    arm, which = led.arm, 0 if led.arm.side == "left" else 1
    for tick in move_jaws(arm, hand_stand(arm.robot).squeeze, seconds):
        led.jaws = tick.jaws
        led.feel_wrist()
        yield Tick(led.yielding(), jaws=tick.jaws)
        # On their stops and nothing between them: more force would only bend the stops.
        if tick.jaws[which] > SHUT and arm.body.hand_force(arm.side) < FELT_N:
            break
    for _ in range(round(SETTLE_S / led.arm.body.tick_s)):
        led.feel_wrist()
        yield Tick(led.yielding(), jaws=led.jaws)


def let_go(led: Led) -> Ticks:
    """Open the jaws; what they held is no longer told."""
    for tick in move_jaws(led.arm, JAW_OPEN, OPEN_S):
        led.jaws = tick.jaws
        led.feel_wrist()
        yield tick
    led.tell(0.0)


def draw_back(led: Led, distance_m: float = BACK_M) -> Generator[Tick, None, None]:
    """Take the hand straight back from where it is felt to be, then bring arm and torso home."""
    arm = led.arm
    rotation, position = arm.hand()
    led.goal = arm.reference()
    yield from line(led, position - distance_m * rotation[:, 2], rotation, 1.5)
    yield from follow_path(arm, home(arm)[None, :], 2.0, led.jaws)
    yield from stay(led, 0.2)


def come_to(
    arm: Arm, led: Led, posed: Posed, target: PoseTarget, back_m: float = BACK_M
) -> Generator[Tick, None, float]:
    """Bring the open hand to ``back_m`` before the target by a joint path; return how far it will stay off [m]."""
    path, last = path_back(posed, target, -back_m * target.approach)
    if last.position_error_m > 2 * REACHED_M:
        return last.position_error_m
    yield from follow_path(arm, path[-1:, arm.upper], 2.5, led.jaws)
    led.goal = posed.solution.q
    yield from line(led, target.position - back_m * target.approach, target.rotation, 0.5, settle_s=0.4)
    return last.position_error_m
