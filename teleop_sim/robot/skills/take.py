"""Take: bring a hand round, or into, something that does not come along; guarded, and judged by what is felt."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import coal
import numpy as np
import pinocchio as pin

from teleop_sim.robot.body import Body
from teleop_sim.robot.chain_ik import ChainIk, Solution, Target, search, two_stage
from teleop_sim.robot.collision import Collisions
from teleop_sim.robot.commands import Handle, Take
from teleop_sim.robot.crank_scene import Thing
from teleop_sim.robot.pose_ik import PoseIk, pose_target
from teleop_sim.robot.skill import Done, Motion, Tick
from teleop_sim.robot.skills.holding import draw_back, rotations
from teleop_sim.robot.skills.manipulate import (
    JAW_OPEN,
    JAW_SHUT,
    Arm,
    Ticks,
    arm_of,
    follow_path,
    move_jaws,
    plan_stance,
    rest_posture,
)
from teleop_sim.robot.skills.servoing import Led, line, stay
from teleop_sim.robot.ways import Way, drawn_back, free_way

APPROACH_S, SHUT_S = 2.0, 0.6
BACK_M = 0.10
"""From where the hand comes: its bars reach 3 cm beyond the tool, a lever or a wheel 2 cm before it (assumed)."""
WALL_M = 0.02
"""So far before the tool's place begins what the arm keeps off on its way there (assumed)."""
BLOCKED_N, BEHIND_M = 25.0, 0.02
"""A hand that feels this force on its way in, or stays so far behind, has met something (assumed: a bar that brushes a
lever gives some newtons; a lever is 2 cm thick)."""
GOOD_M, GOOD_RAD = 0.006, 0.1
ROWS = 9


@dataclass(frozen=True)
class TakeReport:
    """What was felt: force on the way in [N], how far the hand stayed behind [m], jaws' force [N] and places [m]."""

    met_n: float
    behind_m: float
    squeeze_n: float
    jaws_m: tuple[float, ...]


@dataclass(frozen=True)
class Entry:
    """A way in: postures (rows, nq) from before the place to it, and how well the last serves."""

    solver: ChainIk
    path: np.ndarray
    solution: Solution


def take(body: Body, command: Take, rng: np.random.Generator) -> Motion:
    """See ``Take``; data: ``TakeReport`` once the hand has gone in or met something."""
    arm, handle = arm_of(body, command.side), command.handle
    entry = _entry(arm, handle, rng)
    why = _refusal(entry)
    if why:
        return Done("no_plan", why)
    way = _way_there(arm, handle, entry)
    if way.touches is not None:
        return Done("no_plan", "no way there: {} would touch {}".format(*way.touches))
    yield from move_jaws(arm, JAW_SHUT if command.shut else JAW_OPEN, SHUT_S)
    led = Led(arm)
    yield from follow_path(arm, way.q[:, arm.upper], 2.5, led.jaws)
    rotation, position = arm.kinematics.tool_pose(entry.path[-1], command.side)
    approach = np.array(handle.approach)
    led.goal = entry.path[-1]
    yield from line(led, position - BACK_M * approach, rotation, 0.5, settle_s=0.4)
    yield from line(led, position, rotation, APPROACH_S, lambda: _met_n(led, approach) > BLOCKED_N, settle_s=0.4)
    met_n, behind_m = _met_n(led, approach), float((position - arm.tool()) @ approach)
    if met_n > BLOCKED_N or behind_m > BEHIND_M:
        yield from draw_back(led)
        cause = f"{met_n:.0f} N, {behind_m * 1e3:.0f} mm before it was there"
        return Done("blocked", cause, TakeReport(met_n, behind_m, 0.0, ()))
    if not command.shut:
        yield from _close(led)
    report = TakeReport(met_n, behind_m, body.hand_force(command.side), body.jaw_gap(command.side))
    return Done("taken", f"{report.squeeze_n:.0f} N on the jaws", report)


def _entry(arm: Arm, handle: Handle, rng: np.random.Generator) -> Entry:
    """Of all turns of the tool round a bar, or with a free spin, the way in that leaves most room at the joints."""
    position, approach = np.array(handle.centre), np.array(handle.approach)
    targets: list[Target] = [Target(position, approach)]
    if handle.bar is not None:
        targets = [pose_target(position, rotation) for rotation in rotations(handle)]
    entries = [_way_in(arm, target, rng) for target in targets]
    return max(entries, key=lambda entry: _worth(entry.solution))


def _way_in(arm: Arm, target: Target, rng: np.random.Generator) -> Entry:
    _, stance = plan_stance(arm)
    rest = rest_posture(arm, stance)
    for stage, _ in two_stage(arm.kinematics, arm.side, stance, rest):
        solver = PoseIk(arm.kinematics, arm.side, stance, rest, torso=stage == "chain")
        found = search(solver, rest, target, rng)
        if found.within(GOOD_M / 2, GOOD_RAD / 2):
            break
    path, solution = [found.q], found
    for share in np.linspace(0.0, 1.0, ROWS)[1:]:
        place = target.position - share * BACK_M * target.approach
        before = pose_target(place, target.rotation) if hasattr(target, "rotation") else Target(place, target.approach)
        solution = solver.solve(solution.q, before, 15)
        path.append(solution.q)
    worst = max((found, solution), key=lambda each: each.position_error_m + 0.1 * each.axis_error_rad)
    return Entry(solver, np.array(path[::-1]), worst)


def _worth(found: Solution) -> float:
    if found.within(GOOD_M, GOOD_RAD):
        return found.limit_margin_rad
    return -found.position_error_m - 0.1 * found.axis_error_rad


def _refusal(entry: Entry) -> str:
    found = entry.solution
    if found.within(2 * GOOD_M, 2 * GOOD_RAD):
        return ""
    off_mm, turn_deg = found.position_error_m * 1e3, np.degrees(found.axis_error_rad)
    return f"out of reach: the hand stays {off_mm:.0f} mm and {turn_deg:.0f} degrees off"


def _close(led: Led) -> Ticks:
    """Shut the jaws. The arm gives way meanwhile: not the thing, but the hand is to move."""
    for tick in move_jaws(led.arm, JAW_SHUT, SHUT_S):
        led.jaws = tick.jaws
        led.feel_wrist()
        yield Tick(led.yielding(), jaws=tick.jaws)
    yield from stay(led, 0.4)


def _way_there(arm: Arm, handle: Handle, entry: Entry) -> Way:
    """The way to where the hand goes in: as free ways go, else with the hand drawn back from where it is now first."""
    now, stance = plan_stance(arm)
    rest, start, goal = rest_posture(arm, stance), entry.solver.settle(now), entry.path[0]
    minded = _obstacles(arm, handle, start)
    way = free_way(minded, start, goal, rest, partial(drawn_back, entry.solver, goal))
    if way.touches is None:
        return way
    for first in drawn_back(entry.solver, start):
        onward = free_way(minded, first, goal, rest, partial(drawn_back, entry.solver, goal))
        if onward.touches is None and minded.along([start, first], 0.0) is None:
            return Way(np.vstack([first, onward.q]), None)
    return way


def _obstacles(arm: Arm, handle: Handle, start: np.ndarray) -> Collisions:
    """The robot itself and what stands behind the thing; a robot whose hands rest nearer than that minds itself."""
    minded = Collisions(arm.robot, (_wall(handle),))
    return minded if minded.touching(start, 0.0) is None else Collisions(arm.robot, ())


def _wall(handle: Handle) -> Thing:
    """What stands behind the thing, as far as the way there minds: 30 cm square, from a little before it on."""
    approach = np.array(handle.approach)
    turn = pin.Quaternion.FromTwoVectors(np.array([1.0, 0.0, 0.0]), approach).toRotationMatrix()
    deep_m = 0.6
    centre = np.array(handle.centre) + (deep_m / 2 - WALL_M) * approach
    return Thing("wall", pin.SE3(turn, centre), coal.Box(deep_m, 0.3, 0.3))


def _met_n(led: Led, approach: np.ndarray) -> float:
    """Force with which the hand presses on what it meets [N]."""
    return float(led.force() @ approach)
