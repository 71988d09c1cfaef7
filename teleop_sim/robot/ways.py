"""Ways from posture to posture that touch nothing: straight in joint space if they can be, else over others in between.

Two ways in and out are all that a console asks: over a posture with the elbow out, or with the hand drawn further back
along the approach axis first. What these do not find is left to ``teleop_sim.robot.arm_path``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from teleop_sim.robot.chain_ik import ChainIk, Target
from teleop_sim.robot.collision import Collisions

MARGIN_M = 0.01
"""Kept from everything: half for tracking, half for what perception is off (assumed)."""
ENDS_M = 0.001
"""Ends are given: a way may come as near as they are, less this."""
DRAWN_BACK_M = (0.08, 0.16)
"""How much further back along the approach axis the hand goes in a posture in between (assumed)."""
VIA_ERROR_M = 0.03


@dataclass(frozen=True)
class Way:
    """Configurations (n, nq) after the start, the last is the goal; what the straight way touches if none is free."""

    q: np.ndarray
    touches: tuple[str, str] | None


def drawn_back(solver: ChainIk, q: np.ndarray) -> list[np.ndarray]:
    """Configurations with the hand drawn back from where it is in ``q``, as far as it can be."""
    rotation, position = solver.kinematics.tool_pose(q, solver.side)
    found = []
    for back_m in DRAWN_BACK_M:
        solution = solver.solve(q, Target(position - back_m * rotation[:, 2], rotation[:, 2]), 30)
        if solution.position_error_m <= VIA_ERROR_M:
            found.append(solution.q)
    return found


def free_way(
    collisions: Collisions,
    start: np.ndarray,
    goal: np.ndarray,
    elbow_out: np.ndarray,
    back: Callable[[], Sequence[np.ndarray]],
    reverse: bool = False,
) -> Way:
    """The first way from start to goal that keeps ``MARGIN_M``; else the straight one, with what it touches.

    ``back`` is asked only if straight is not free: postures with the hand drawn back from the goal, or, if ``reverse``,
    from the start.
    """
    ends = [collisions.nearest(q) for q in (start, goal)]
    closest = min(ends, key=lambda end: end.gap_m)
    if closest.gap_m <= 0.0:
        return Way(goal[None, :], (closest.first, closest.second))
    margin_m = max(min(MARGIN_M, closest.gap_m - ENDS_M), 0.0)
    touches = collisions.along([start, goal], margin_m)
    if touches is None:
        return Way(goal[None, :], None)
    drawn = back()
    between = [*([q] for q in drawn), [elbow_out]]
    between += [[q, elbow_out] if reverse else [elbow_out, q] for q in drawn]
    for vias in between:
        if collisions.along([start, *vias, goal], margin_m) is None:
            return Way(np.array([*vias, goal]), None)
    return Way(goal[None, :], touches)
