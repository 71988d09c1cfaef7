"""Ways of a hand into a thing that does not come along: to before it, straight in, straight back.

``Take`` does it all in one; ``PreGrasp``, ``Grasp`` and ``Retreat`` are its parts.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from functools import partial

import coal
import numpy as np
import pinocchio as pin

from teleop_sim.robot.chain_ik import ChainIk, Solution, Target, search, two_stage
from teleop_sim.robot.collision import Collisions
from teleop_sim.robot.commands import Handle, Vector
from teleop_sim.robot.crank_scene import Thing
from teleop_sim.robot.pose_ik import PoseIk, angle_between, pose_target
from teleop_sim.robot.skill import Tick
from teleop_sim.robot.skills.holding import rotations
from teleop_sim.robot.skills.manipulate import Arm, Ticks, follow_path, plan_stance, rest_posture
from teleop_sim.robot.skills.servoing import Led, line
from teleop_sim.robot.ways import Way, drawn_back, free_way

APPROACH_S = 2.0
BACK_M = 0.10
"""From where the hand comes: its bars reach 3 cm beyond the tool, a lever or a wheel 2 cm before it (assumed)."""
WALL_M = 0.02
"""So far before the tool's place begins what the arm keeps off on its way there (assumed)."""
BLOCKED_N, BEHIND_M = 25.0, 0.02
"""A hand that feels this force on its way in, or stays so far behind, has met something (assumed: a bar that brushes a
lever gives some newtons; a lever is 2 cm thick)."""
GOOD_M, GOOD_RAD = 0.006, 0.1
ROWS = 9
CUBE_M = 0.05
"""Edge of what stands for a point that the world model holds: its voxel (assumed)."""
OBSTACLE = "obstacle"


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

    def place(self, arm: Arm) -> tuple[np.ndarray, np.ndarray]:
        """Rotation (3, 3) and position (3,) [m] of the tool at its end."""
        return arm.kinematics.tool_pose(self.path[-1], arm.side)


# Plans ---------------------------------------------------------------------------------------------------------------


def entry_to(arm: Arm, handle: Handle, rng: np.random.Generator) -> Entry:
    """Of all turns of the tool round a bar, or with a free spin, the way in that leaves most room at the joints."""
    position, approach = np.array(handle.centre), np.array(handle.approach)
    targets: list[Target] = [Target(position, approach)]
    if handle.bar is not None:
        targets = [pose_target(position, rotation) for rotation in rotations(handle)]
    entries = [_way_in(arm, target, rng) for target in targets]
    return max(entries, key=lambda entry: _worth(entry.solution))


def entry_from_here(arm: Arm, handle: Handle) -> Entry:
    """The way in for a hand that is before the place already: turned as it is, as nearly as a bar lets it."""
    now, stance = plan_stance(arm)
    rest, like = rest_posture(arm, stance), arm.hand()[0]
    position, approach = np.array(handle.centre), np.array(handle.approach)
    target: Target = Target(position, approach)
    if handle.bar is not None:
        nearest = min(rotations(handle, like), key=lambda rotation: angle_between(like, rotation))
        target = pose_target(position, nearest)
    for stage, _ in two_stage(arm.kinematics, arm.side, stance, rest):
        solver = PoseIk(arm.kinematics, arm.side, stance, rest, torso=stage == "chain")
        rows: list[np.ndarray] = []
        first, last = now, solver.judge(now, target)
        for share in np.linspace(1.0, 0.0, ROWS):
            last = solver.solve(first, _before(target, share * BACK_M), 40 if not rows else 15)
            first = last.q
            rows.append(first)
        if last.within(GOOD_M / 2, GOOD_RAD / 2):
            break
    return Entry(solver, np.array(rows), last)


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
        solution = solver.solve(solution.q, _before(target, share * BACK_M), 15)
        path.append(solution.q)
    worst = max((found, solution), key=lambda each: each.position_error_m + 0.1 * each.axis_error_rad)
    return Entry(solver, np.array(path[::-1]), worst)


def _before(target: Target, back_m: float) -> Target:
    """A target drawn back along its approach."""
    place = target.position - back_m * target.approach
    return pose_target(place, target.rotation) if hasattr(target, "rotation") else Target(place, target.approach)


def _worth(found: Solution) -> float:
    if found.within(GOOD_M, GOOD_RAD):
        return found.limit_margin_rad
    return -found.position_error_m - 0.1 * found.axis_error_rad


def refusal(found: Solution) -> str:
    """In words why a posture does not serve, or nothing."""
    if found.within(2 * GOOD_M, 2 * GOOD_RAD):
        return ""
    off_mm, turn_deg = found.position_error_m * 1e3, np.degrees(found.axis_error_rad)
    return f"out of reach: the hand stays {off_mm:.0f} mm and {turn_deg:.0f} degrees off"


def way_to(arm: Arm, handle: Handle, entry: Entry, obstacles: tuple[Vector, ...] = ()) -> Way:
    """The way to where the hand goes in: as free ways go, else with the hand drawn back from where it is now first."""
    now, stance = plan_stance(arm)
    rest, start, goal = rest_posture(arm, stance), entry.solver.settle(now), entry.path[0]
    minded = _minded(arm, handle, start, obstacles)
    way = free_way(minded, start, goal, rest, partial(drawn_back, entry.solver, goal))
    if way.touches is None:
        return way
    for first in drawn_back(entry.solver, start):
        onward = free_way(minded, first, goal, rest, partial(drawn_back, entry.solver, goal))
        if onward.touches is None and minded.along([start, first], 0.0) is None:
            return Way(np.vstack([first, onward.q]), None)
    return way


def _minded(arm: Arm, handle: Handle, start: np.ndarray, obstacles: tuple[Vector, ...]) -> Collisions:
    """The robot itself, what is told to be in the way, and what stands behind the thing; a robot whose hands rest
    nearer than that does not mind the last.
    """
    cubes = tuple(_cube(place) for place in obstacles)
    free = Collisions(arm.robot, (_wall(handle),)).touching(start, 0.0) is None
    return Collisions(arm.robot, (_wall(handle), *cubes) if free else cubes)


def _cube(place: Vector) -> Thing:
    return Thing(OBSTACLE, pin.SE3(np.eye(3), np.array(place)), coal.Box(CUBE_M, CUBE_M, CUBE_M))


def _wall(handle: Handle) -> Thing:
    """What stands behind the thing, as far as the way there minds: 30 cm square, from a little before it on."""
    approach = np.array(handle.approach)
    turn = pin.Quaternion.FromTwoVectors(np.array([1.0, 0.0, 0.0]), approach).toRotationMatrix()
    deep_m = 0.6
    centre = np.array(handle.centre) + (deep_m / 2 - WALL_M) * approach
    return Thing("wall", pin.SE3(turn, centre), coal.Box(deep_m, 0.3, 0.3))


# Motions -------------------------------------------------------------------------------------------------------------


def come_before(led: Led, handle: Handle, entry: Entry, way: Way) -> Ticks:
    """Along a way to before the place, then on a leash to where the straight line in begins."""
    arm = led.arm
    yield from follow_path(arm, way.q[:, arm.upper], 2.5, led.jaws)
    yield from square_up(led, handle, entry)


def square_up(led: Led, handle: Handle, entry: Entry) -> Ticks:
    """Lead the tool to where the straight line in begins."""
    rotation, position = entry.place(led.arm)
    led.goal = entry.path[-1]
    yield from line(led, position - BACK_M * np.array(handle.approach), rotation, 0.5, settle_s=0.4)


def go_in(led: Led, handle: Handle, entry: Entry) -> Generator[Tick, None, TakeReport]:
    """Lead the tool straight in; it stops where it meets something. What was felt: see ``blocked``."""
    rotation, position = entry.place(led.arm)
    approach = np.array(handle.approach)
    led.goal = entry.path[-1]
    yield from line(led, position, rotation, APPROACH_S, lambda: _met_n(led, approach) > BLOCKED_N, settle_s=0.4)
    behind_m = float((position - led.arm.tool()) @ approach)
    return TakeReport(_met_n(led, approach), behind_m, 0.0, ())


def blocked(report: TakeReport) -> str:
    """In words that a hand met something on its way in, or nothing."""
    if report.met_n <= BLOCKED_N and report.behind_m <= BEHIND_M:
        return ""
    return f"{report.met_n:.0f} N, {report.behind_m * 1e3:.0f} mm before it was there"


def _met_n(led: Led, approach: np.ndarray) -> float:
    """Force with which the hand presses on what it meets [N]."""
    return float(led.force() @ approach)
