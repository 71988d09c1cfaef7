"""How long a machine takes, how it ends and who must help: expectations without running it.

A machine whose programs and people answer from a table is an absorbing Markov chain over situations (``situations``).
With Q the chances of going from one transient situation to another, N = (I - Q)^-1 holds how often each is visited, and
sums over N give every figure here (Kemeny and Snell, Finite Markov Chains, 1960, chapter III, theorems 3.2.1 to 3.3.7;
second moments by conditioning on the first step). It is solved sparsely, N itself is not made.

Counters make the situations many. Those with the likeliest way to them are followed; what then flows out of the part
that is followed is bounded, not guessed: from there on every figure lies between the ``extremes`` over whatever the
counters may do. So each figure is an interval, whose ends are equal where everything was followed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teleop_sim.machines.chain import Chain, Outline, expand, outline
from teleop_sim.machines.chances import Chances, refuse_bad_chances
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.engine import check_level
from teleop_sim.machines.extremes import Gain, extremes
from teleop_sim.machines.forecasts import Figure, Forecast
from teleop_sim.machines.net import Net
from teleop_sim.machines.remembered import NOTHING, Counted, Uncounted
from teleop_sim.machines.situations import NEVER, Branch, End, Option, Ways
from teleop_sim.machines.solve import Solution, solve

__all__ = ["MOST_OUTLINE", "MOST_SITUATIONS", "Figure", "Forecast", "forecast"]

MOST_SITUATIONS = 20_000
"""Situations that are followed; a few seconds."""

Later = Callable[[Branch, Option, float], float]
"""What a step adds, given how much of something else is still to come after it."""

MOST_OUTLINE = 2_000
"""Situations there may be without counters."""


def forecast(machine: Machine, chances: Chances, level: int, most: int = MOST_SITUATIONS) -> Forecast:
    """What is to be expected of a machine at an autonomy level.

    Args:
        machine: any; concurrent states must have fixed times.
        chances: what its programs and people answer.
        level: 0 to 3.
        most: situations that are followed, at least one.

    Raises:
        BadInput: the table does not fit, a state that can be reached is not in it, times of concurrent states vary, or
            they make more than ``MOST_OUTLINE`` situations even without counters.

    """
    check_level(level)
    refuse_bad_chances(machine, chances)
    whole = outline(Ways(machine, chances, level, Uncounted(machine)), MOST_OUTLINE)
    counted = Counted(machine)
    chain = expand(Ways(machine, chances, level, counted), counted, whole, most)
    begins_manual = any(counted.manual(NOTHING, node) for node in machine.net.begin().active)
    return _Reader(machine, level, whole, chain, solve(chain), begins_manual).forecast()


@dataclass(frozen=True)
class _Reader:
    """Reads figures off a solved chain."""

    machine: Machine
    level: int
    whole: Outline
    chain: Chain
    solution: Solution
    begins_manual: bool

    def forecast(self) -> Forecast:
        return Forecast(
            machine=self.machine.name,
            level=self.level,
            situations=self.chain.followed,
            cut=float(self.solution.cut.sum()),
            time_s=self.figure(lambda b, _: b.mean_s),
            sd_s=self._sd_s(),
            waits_s=self.figure(lambda b, _: b.mean_s if b.waits else 0.0),
            completed=_chance(self.figure(lambda _, o: _completes(o.target))),
            completed_s=self._completed_s(),
            manual=self._manual(),
            ends=self._ends(),
            visits=self._visits(),
            time_in_s=self._times_in(),
        )

    def figure(self, gain: Gain) -> Figure:
        """Sum of a gain over all steps, with bounds for what was cut; infinite if it is gained again and again."""
        steps = self.chain.steps
        gains = np.fromiter((gain(s.branch, s.branch.options[0]) for s in steps), dtype=np.float64, count=len(steps))
        return self._bounded(float(self._weighed(gains).sum()), gain)

    def _weighed(self, gains: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gains by step, as often as it is taken."""
        found = gains * self.solution.flow
        found[self.solution.lasts & (gains > 0.0)] = math.inf
        return found

    def _bounded(self, sure: float, gain: Gain) -> Figure:
        if not self.chain.cut:
            return Figure(sure, sure)
        low, high = (self._beyond(extremes(self.whole, gain, sign)) for sign in (-1, 1))
        return Figure(sure + low, sure + high)

    def _beyond(self, values: NDArray[np.float64]) -> float:
        return float(sum(c * values[place] for c, place in zip(self.solution.cut, self.chain.cut, strict=True) if c))

    def _sd_s(self) -> Figure:
        """By conditioning on the first step: what is squared is its time and all that is still to come."""
        if self.solution.never:
            return Figure(math.nan, math.nan)
        (low, squares_low), (high, squares_high) = self._twice(
            lambda b, _: b.mean_s, lambda b, _, later: b.square_s2 + (2.0 * b.mean_s * later if b.mean_s else 0.0)
        )
        lows, highs = max(0.0, squares_low - high**2), max(0.0, squares_high - low**2)
        return Figure(math.sqrt(lows), math.sqrt(highs))

    def _completed_s(self) -> Figure:
        (low, times_low), (high, times_high) = self._twice(
            lambda _, o: _completes(o.target),
            lambda b, o, later: b.mean_s * (_completes(o.target) + later) if b.mean_s else 0.0,
        )
        if not high:
            return Figure(math.nan, math.nan)
        return Figure(times_low / high, times_high / low if low else math.inf)

    def _twice(self, first: Gain, second: Later) -> tuple[tuple[float, float], tuple[float, float]]:
        """Least and most of a gain, and of a second one that depends on how much of the first is still to come."""
        if not self.chain.cut:
            found = self._nested(first, second, np.zeros(0), np.zeros(0))
            return found, found
        low, high = (self._nested(first, second, *self._beyond_twice(first, second, sign)) for sign in (-1, 1))
        return low, high

    def _beyond_twice(self, first: Gain, second: Later, sign: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        place = self.whole.place
        once = extremes(self.whole, first, sign)

        def later(option: Option) -> float:
            return 0.0 if isinstance(option.target, End) else float(once[place[option.target]])

        twice = extremes(self.whole, lambda b, o: second(b, o, later(o)), sign)
        cut = np.array(self.chain.cut, dtype=np.intp)
        return once[cut], twice[cut]

    def _nested(
        self, first: Gain, second: Later, once: NDArray[np.float64], twice: NDArray[np.float64]
    ) -> tuple[float, float]:
        if not (np.isfinite(once).all() and np.isfinite(twice).all()):
            return math.inf, math.inf
        pairs = [(s.branch, s.branch.options[0]) for s in self.chain.steps]
        gains = np.array([first(b, o) for b, o in pairs])
        return self.solution.nested(
            gains,
            lambda later: np.array([second(b, o, x) for (b, o), x in zip(pairs, later, strict=True)]),
            (once, twice),
        )

    def _visits(self) -> dict[str, Figure]:
        net = self.machine.net
        pairs = [(k, net.source[e]) for k, s in enumerate(self.chain.steps) for e in s.branch.options[0].edges]
        sure = self._by_node(pairs, np.ones(len(self.chain.steps)))
        return {n.path: self._bounded(sure[n.number], _leaves(net, n.number)) for n in net.nodes[1:]}

    def _times_in(self) -> dict[str, Figure]:
        pairs = [(k, n) for k, s in enumerate(self.chain.steps) for n in s.branch.nodes]
        sure = self._by_node(pairs, np.array([s.branch.mean_s for s in self.chain.steps]))
        return {n.path: self._bounded(sure[n.number], _stays(n.number)) for n in self.machine.net.nodes[1:]}

    def _by_node(self, pairs: list[tuple[int, int]], gains: NDArray[np.float64]) -> list[float]:
        """Sums by node over pairs (step, node)."""
        step, node = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
        weights = self._weighed(gains)[step]
        return [float(x) for x in np.bincount(node, weights=weights, minlength=len(self.machine.net.nodes))]

    def _ends(self) -> tuple[tuple[End, Figure], ...]:
        leads = [o.target for branches in self.whole.branches for b in branches for o in b.options]
        ends = dict.fromkeys(target for target in leads if isinstance(target, End))
        found = [(end, _chance(self.figure(_ending(end)))) for end in ends]
        if self.solution.never:
            found.append((NEVER, Figure(self.solution.never, min(1.0, self.solution.never + self._cut))))
        return tuple(sorted((pair for pair in found if pair[1].high), key=lambda pair: (-pair[1].value, pair[0])))

    @property
    def _cut(self) -> float:
        return float(self.solution.cut.sum())

    def _manual(self) -> Figure:
        if self.begins_manual:
            return Figure(1.0, 1.0)
        first, cut = self.solution.ever(lambda step: step.branch.options[0].manual)
        return _chance(Figure(first, first + cut))


def _chance(figure: Figure) -> Figure:
    """Sums of chances may pass one by a rounding, and bounds by more."""
    return Figure(min(1.0, figure.low), min(1.0, figure.high))


def _leaves(net: Net, node: int) -> Gain:
    return lambda _, o: float(sum(net.source[edge] == node for edge in o.edges))


def _stays(node: int) -> Gain:
    return lambda b, _: b.mean_s if node in b.nodes else 0.0


def _completes(target: object) -> float:
    return float(isinstance(target, End) and target.completed)


def _ending(end: End) -> Gain:
    return lambda _, o: float(o.target == end)
