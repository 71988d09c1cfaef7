"""Bounds that hold whatever the counters do: what a way through the outline can add up to at most, and at least.

Whoever knows no counter must allow a signal to become any event that some counter makes of it. Letting an opponent
choose the worst (or best) event each time gives a Markov decision process that is positive and, where every choice of
the opponent ends at last, has one finite optimum, found by policy iteration (Puterman, Markov Decision Processes, 1994,
section 7.2: positive bounded models; Bertsekas and Tsitsiklis, Math. Oper. Res. 16 (1991), 580-595: stochastic shortest
paths with all policies proper). The true process is one of the opponent's, so its sums lie between.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from teleop_sim.machines.chain import Outline
from teleop_sim.machines.situations import Branch, End, Option

Gain = Callable[[Branch, Option], float]
"""What a step adds, zero or more."""

_BETTER = 1e-12
"""Smallest relative gain for which a policy is changed: above what a solve of a few hundred unknowns loses."""


def extremes(whole: Outline, gain: Gain, sign: int) -> NDArray[np.float64]:
    """Most (``sign`` 1) or least (-1) that can add up in the mean from each situation of the outline on.

    The most is infinite for all if the opponent can keep the machine from ending; the least is then zero.
    """
    n = len(whole.situations)
    if can_last(whole):
        return np.full(n, math.inf if sign > 0 else 0.0)
    options = [[_leads(whole, b, gain) for b in branches] for branches in whole.branches]
    policy = [[0] * len(branches) for branches in options]
    while True:
        values = _evaluate(options, policy)
        better = False
        for i, branches in enumerate(options):
            for k, (_, choices) in enumerate(branches):
                worth = [sign * (g + (values[t] if t >= 0 else 0.0)) for t, g in choices]
                best = max(range(len(choices)), key=worth.__getitem__)
                if worth[best] > worth[policy[i][k]] + _BETTER * (1.0 + abs(worth[best])):
                    policy[i][k], better = best, True
        if not better:
            return values


_Leads = tuple[float, list[tuple[int, float]]]


def _leads(whole: Outline, branch: Branch, gain: Gain) -> _Leads:
    targets = ((-1 if isinstance(o.target, End) else whole.place[o.target]) for o in branch.options)
    return branch.chance, [(t, gain(branch, o)) for t, o in zip(targets, branch.options, strict=True)]


def _evaluate(options: list[list[_Leads]], policy: list[list[int]]) -> NDArray[np.float64]:
    n = len(options)
    stays, gains = np.eye(n), np.zeros(n)
    for i, branches in enumerate(options):
        for (chance, choices), choice in zip(branches, policy[i], strict=True):
            target, g = choices[choice]
            gains[i] += chance * g
            if target >= 0:
                stays[i, target] -= chance
    return np.asarray(np.linalg.solve(stays, gains), dtype=np.float64)


def can_last(whole: Outline) -> bool:
    """Can the opponent keep the machine from ending for ever?"""
    lasting = set(range(len(whole.situations)))
    shrunk = True
    while shrunk:
        gone = {i for i in lasting if not all(_stays(whole, b, lasting) for b in whole.branches[i])}
        lasting -= gone
        shrunk = bool(gone)
    return bool(lasting)


def _stays(whole: Outline, branch: Branch, lasting: set[int]) -> bool:
    return any(not isinstance(o.target, End) and whole.place[o.target] in lasting for o in branch.options)
