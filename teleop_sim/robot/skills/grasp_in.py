"""Grasp and Retreat: straight in to a handle from before it, and straight back."""

from __future__ import annotations

import math

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Grasp, Handle, Retreat
from teleop_sim.robot.skill import Done, Motion
from teleop_sim.robot.skills.enter import BACK_M, BEHIND_M, blocked, entry_from_here, go_in, refusal, square_up
from teleop_sim.robot.skills.fingers import SHUT_S
from teleop_sim.robot.skills.manipulate import JAW_OPEN, JAW_SHUT, Arm, arm_of, move_jaws
from teleop_sim.robot.skills.servoing import Led, line

NEAR_M, SQUARE_M = (0.03, 0.20), 0.005
ASIDE_M, TILT_RAD = 0.08, math.radians(30.0)
"""Where a hand counts as before a handle: so far before it, so far aside and so much askew (assumed: what an operator
moves a template by); a hand that is further aside than ``SQUARE_M`` is led to the line in first."""
BACK_S = 1.5


def grasp(body: Body, command: Grasp, rng: np.random.Generator) -> Motion:
    """See ``Grasp``; data: ``TakeReport`` once the hand has gone in or met something."""
    arm, handle = arm_of(body, command.side), command.handle
    why = _elsewhere(arm, handle)
    if why:
        return Done("no_plan", why)
    entry = entry_from_here(arm, handle)
    why = refusal(entry.solution)
    if why:
        return Done("no_plan", why)
    led = Led(arm)
    wanted = JAW_SHUT if command.shut else JAW_OPEN
    if arm.jaws(wanted) != body.jaws:
        yield from move_jaws(arm, wanted, SHUT_S)
        led.jaws = body.jaws
    if not _on_line(arm, handle):
        yield from square_up(led, handle, entry)
    report = yield from go_in(led, handle, entry)
    why = blocked(report)
    if why:
        rotation, position = arm.hand()
        yield from line(led, position - (BACK_M - report.behind_m) * np.array(handle.approach), rotation, BACK_S)
        return Done("blocked", why, report)
    return Done("reached", f"{report.met_n:.0f} N on the way in", report)


def retreat(body: Body, command: Retreat, rng: np.random.Generator) -> Motion:
    """See ``Retreat``; data: how far the hand was felt to go [m]."""
    arm, approach = arm_of(body, command.side), np.array(command.handle.approach)
    led = Led(arm)
    rotation, position = arm.hand()
    yield from line(led, position - command.distance_m * approach, rotation, BACK_S, settle_s=0.4)
    went_m = float((position - arm.tool()) @ approach)
    outcome = "reached" if command.distance_m - went_m <= BEHIND_M else "blocked"
    return Done(outcome, f"{went_m * 1e3:.0f} mm back", went_m)


def _elsewhere(arm: Arm, handle: Handle) -> str:
    """In words, that a hand is not before a handle, or nothing."""
    rotation, position = arm.hand()
    ahead_m, aside_m = _off(position, handle)
    tilt_rad = math.acos(float(np.clip(rotation[:, 2] @ np.array(handle.approach), -1.0, 1.0)))
    if NEAR_M[0] <= ahead_m <= NEAR_M[1] and aside_m <= ASIDE_M and tilt_rad <= TILT_RAD:
        return ""
    askew = (
        f"{ahead_m * 1e2:.0f} cm before it, {aside_m * 1e2:.0f} cm aside, {math.degrees(tilt_rad):.0f} degrees askew"
    )
    return f"the hand is not before the handle but {askew}"


def _on_line(arm: Arm, handle: Handle) -> bool:
    return _off(arm.tool(), handle)[1] <= SQUARE_M


def _off(position: np.ndarray, handle: Handle) -> tuple[float, float]:
    """How far a tool is before a handle, and aside of the line in [m]."""
    approach, to_go = np.array(handle.approach), np.array(handle.centre) - position
    ahead_m = float(to_go @ approach)
    return ahead_m, float(np.linalg.norm(to_go - ahead_m * approach))
