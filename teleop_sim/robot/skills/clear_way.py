"""Ways of a hand to a crank and home that touch nothing: quick ones first, then by optimisation."""

from __future__ import annotations

import functools

import numpy as np

from teleop_sim.robot.arm_path import optimise
from teleop_sim.robot.chain_ik import ChainIk
from teleop_sim.robot.collision import Collisions
from teleop_sim.robot.commands import CircularAffordance
from teleop_sim.robot.crank_scene import Thing, crank_things
from teleop_sim.robot.skills.manipulate import Arm, home, plan_stance, rest_posture
from teleop_sim.robot.ways import MARGIN_M, Way, drawn_back, free_way


def way_there(arm: Arm, solver: ChainIk, goal: np.ndarray, affordance: CircularAffordance) -> Way:
    """A free way from the present reference to a configuration over a handle."""
    start, stance = plan_stance(arm)
    return _way(arm, solver, (solver.settle(start), goal), rest_posture(arm, stance), affordance, reverse=False)


def way_home(arm: Arm, solver: ChainIk, start: np.ndarray, affordance: CircularAffordance) -> Way:
    """A free way from a configuration over a handle to the arm at home."""
    goal = start.copy()
    goal[arm.upper] = home(arm)
    return _way(arm, solver, (start, solver.settle(goal)), rest_posture(arm, solver.stance), affordance, reverse=True)


def _way(
    arm: Arm,
    solver: ChainIk,
    ends: tuple[np.ndarray, np.ndarray],
    elbow_out: np.ndarray,
    affordance: CircularAffordance,
    reverse: bool,
) -> Way:
    things = crank_things(affordance, arm.side)
    collisions = Collisions(arm.robot, things)
    back = functools.partial(drawn_back, solver, ends[0] if reverse else ends[1])
    way = free_way(collisions, *ends, elbow_out, back, reverse)
    if way.touches is None or min(collisions.nearest(q).gap_m for q in ends) <= 0.0:
        return way
    return searched(arm, solver, collisions, ends, elbow_out, things) or way


def searched(
    arm: Arm,
    solver: ChainIk,
    collisions: Collisions,
    ends: tuple[np.ndarray, np.ndarray],
    elbow_out: np.ndarray,
    things: tuple[Thing, ...],
) -> Way | None:
    """A way by optimisation, if it finds one that coal finds free with half the usual margin."""
    path = optimise(arm.kinematics, arm.body.spec, arm.side, *ends, elbow_out, things)
    rows = np.array([*(solver.settle(q) for q in path.q[:-1]), ends[1]])
    free = path.solved and collisions.along([ends[0], *rows], MARGIN_M / 2) is None
    return Way(rows, None) if free else None
