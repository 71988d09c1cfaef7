"""Solves a chain: how often each step is taken, moments of the time, chances of ever meeting something."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teleop_sim.machines.chain import Chain, Step

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Solution:
    """A solved chain.

    Attributes:
        chain: that was solved.
        lasting: by situation that is followed, whether no end can be reached from it.
        visits: by situation that is followed, how often it is met in the mean; zero where it lasts for ever.

    """

    chain: Chain
    lasting: NDArray[np.bool_]
    visits: Array

    @cached_property
    def flow(self) -> Array:
        """How often each step is taken in the mean."""
        return np.asarray(self.visits[self._a.source] * self._a.chance, dtype=np.float64)

    @cached_property
    def cut(self) -> Array:
        """How often each situation that is not followed is met: the chance, as nothing returns from there."""
        return _cut(self.chain, self._a, self.flow)

    @cached_property
    def never(self) -> float:
        """Chance of coming to where no end can be reached any more."""
        if self.lasting.size and self.lasting[0]:
            return 1.0
        inside = (self._a.target >= 0) & (self._a.target < self.chain.followed)
        enters = np.zeros(len(self.flow), dtype=bool)
        enters[inside] = self.lasting[self._a.target[inside]]
        return float(self.flow[enters].sum())

    @cached_property
    def lasts(self) -> NDArray[np.bool_]:
        """By step, whether it is taken again and again for ever."""
        return np.asarray(self.lasting[self._a.source])

    def nested(self, first: Array, second: Callable[[Array], Array], cut: tuple[Array, Array]) -> tuple[float, float]:
        """Sum of a first gain, and of a second one that depends on how much of the first is still to come.

        Args:
            first: by step.
            second: from the first's sum after each step to the second gain of that step.
            cut: what both add up to from each situation on that is not followed.

        """
        a = self._a
        sums = _backward(self.chain, a, self.lasting, first + _onward(a, np.zeros(self.chain.followed), cut[0]))
        gains = second(_onward(a, sums, cut[0]))
        twice = _backward(self.chain, a, self.lasting, gains + _onward(a, np.zeros(self.chain.followed), cut[1]))
        return float(sums[0]), float(twice[0])

    def ever(self, meets: Callable[[Step], bool]) -> tuple[float, float]:
        """Chance of ever taking such a step, and of leaving what is followed before."""
        met = np.array([meets(step) for step in self.chain.steps], dtype=bool)
        a = self._a
        flow = _forward(self.chain, a, self.lasting, ~met)[a.source] * a.chance
        return float(flow[met].sum()), float(_cut(self.chain, a, flow * ~met).sum())

    @cached_property
    def _a(self) -> _Arrays:
        return _arrays(self.chain)


@dataclass(frozen=True)
class _Arrays:
    """Steps as arrays; a target of -1 is an end."""

    source: NDArray[np.intp]
    target: NDArray[np.intp]
    chance: Array


def solve(chain: Chain) -> Solution:
    """Solve a chain. A few seconds for some ten thousand situations."""
    a = _arrays(chain)
    lasting = _lasting(chain)
    return Solution(chain, lasting, _forward(chain, a, lasting, np.ones(len(chain.steps), dtype=bool)))


def _arrays(chain: Chain) -> _Arrays:
    steps = chain.steps
    return _Arrays(
        np.array([s.source for s in steps], dtype=np.intp),
        np.array([s.target for s in steps], dtype=np.intp),
        np.array([s.branch.chance for s in steps]),
    )


def _lasting(chain: Chain) -> NDArray[np.bool_]:
    """From where can neither an end nor the outside be reached?"""
    before: dict[int, list[int]] = {}
    front: list[int] = []
    for step in chain.steps:
        if step.end is not None or step.target >= chain.followed:
            front.append(step.source)
        else:
            before.setdefault(step.target, []).append(step.source)
    lasting = np.ones(chain.followed, dtype=bool)
    while front:
        here = front.pop()
        if lasting[here]:
            lasting[here] = False
            front += before.get(here, ())
    return lasting


def _stays(chain: Chain, a: _Arrays, lasting: NDArray[np.bool_], kept: NDArray[np.bool_]) -> Any:
    """I - Q over what is followed; what lasts for ever is left out, as if each visit there were the last."""
    # Late: it takes a second to load, and no run needs it.
    from scipy.sparse import csc_array, eye_array

    n = chain.followed
    inside = kept & (a.target >= 0) & (a.target < n)
    inside[inside] &= ~lasting[a.source[inside]] & ~lasting[a.target[inside]]
    q = csc_array((a.chance[inside], (a.source[inside], a.target[inside])), shape=(n, n))
    return csc_array(eye_array(n) - q)


def _forward(chain: Chain, a: _Arrays, lasting: NDArray[np.bool_], kept: NDArray[np.bool_]) -> Array:
    """First row of N: how often each situation is met."""
    from scipy.sparse.linalg import splu

    begin = np.zeros(chain.followed)
    begin[0] = 1.0
    found = np.asarray(splu(_stays(chain, a, lasting, kept).T.tocsc()).solve(begin), dtype=np.float64)
    return np.where(lasting, 0.0, found)


def _backward(chain: Chain, a: _Arrays, lasting: NDArray[np.bool_], gain: Array) -> Array:
    """N times what each step adds in the mean: what adds up from each situation on."""
    from scipy.sparse.linalg import splu

    mean = np.bincount(a.source, weights=a.chance * gain, minlength=chain.followed)
    mean[lasting] = 0.0
    kept = np.ones(len(chain.steps), dtype=bool)
    return np.asarray(splu(_stays(chain, a, lasting, kept)).solve(mean), dtype=np.float64)


def _onward(a: _Arrays, values: Array, cut: Array) -> Array:
    """By step, the value at its target, also where it is not followed; zero at ends."""
    # An end's target, -1, is the last.
    return np.concatenate((values, cut, np.zeros(1)))[a.target]


def _cut(chain: Chain, a: _Arrays, flow: Array) -> Array:
    outside = a.target >= chain.followed
    where = a.target[outside] - chain.followed
    return np.bincount(where, weights=flow[outside], minlength=len(chain.cut)).astype(np.float64)
