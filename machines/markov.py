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
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teleop_sim.machines.chain import Chain, Outline, expand, outline
from teleop_sim.machines.chances import Chances, refuse_bad_chances
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.engine import check_level
from teleop_sim.machines.extremes import Gain, extremes
from teleop_sim.machines.net import Net
from teleop_sim.machines.remembered import NOTHING, Counted, Uncounted
from teleop_sim.machines.situations import NEVER, End, Ways
from teleop_sim.machines.solve import Solution, solve

MOST_SITUATIONS = 20_000
"""Situations that are followed; a few seconds."""

MOST_OUTLINE = 2_000
"""Situations there may be without counters."""


@dataclass(frozen=True, slots=True)
class Figure:
    """A number that is known to lie between two; they are equal where it is exact."""

    low: float
    high: float

    @property
    def value(self) -> float:
        """The middle."""
        return self.low if self.low == self.high else 0.5 * (self.low + self.high)

    @property
    def error(self) -> float:
        """How far the middle may be off."""
        return 0.0 if self.low == self.high else 0.5 * (self.high - self.low)

    def __str__(self) -> str:
        return f"{self.value:.6g}" + (f" ± {self.error:.2g}" if self.error else "")


@dataclass(frozen=True)
class Forecast:
    """What is to be expected of a machine.

    Attributes:
        machine: its name.
        level: of autonomy.
        situations: that were followed.
        cut: chance of a way that leaves them; 0: all figures are exact.
        time_s: mean time until it ends, whichever way, or until nobody answers [s].
        sd_s: standard deviation of that time [s]; of the ways that are followed.
        waits_s: of the mean time, with people only being waited for [s].
        completed: chance that the task is executed.
        completed_s: mean time of those that are [s]; of the ways that are followed.
        manual: chance that it is ever in manual mode, or an event is ever forced.
        ends: chance of each way to end, likeliest first; a fall is ``not recoverable``.
        visits: mean number of times that each state is left, self-loops counted, by path.
        time_in_s: mean time in each state [s], by path.

    """

    machine: str
    level: int
    situations: int
    cut: float
    time_s: Figure
    sd_s: float
    waits_s: Figure
    completed: Figure
    completed_s: float
    manual: Figure
    ends: tuple[tuple[End, Figure], ...]
    visits: dict[str, Figure]
    time_in_s: dict[str, Figure]

    @property
    def not_completed(self) -> Figure:
        """Chance that it ends otherwise: it does not recover."""
        return Figure(1.0 - self.completed.high, 1.0 - self.completed.low)

    def chance_of(self, end: str) -> Figure:
        """Chance of an end or outcome by its name, completed or not."""
        found = [figure for (name, _), figure in self.ends if name == end]
        return Figure(sum(f.low for f in found), min(1.0, sum(f.high for f in found)))

    def __str__(self) -> str:
        exact = "exact" if not self.cut else f"ways left out: {self.cut:.2g}"
        ends = (f"  {end.name:30s} {'completed' if end.completed else 'failed':10s} {f}" for end, f in self.ends)
        states = (
            f"  {path:44s} {figure!s:>24s} {self.time_in_s[path]!s:>24s}"
            for path, figure in self.visits.items()
            if figure.high
        )
        lines = (
            f"{self.machine} at level {self.level}: {self.situations} situations, {exact}",
            f"time         {self.time_s} s, standard deviation {self.sd_s:.4g} s",
            f"  waiting    {self.waits_s} s for people",
            f"completed    {self.completed}, in the mean after {self.completed_s:.6g} s",
            f"ever manual  {self.manual}",
            "ends",
            *ends,
            f"  {'state':44s} {'visits':>24s} {'seconds':>24s}",
            *states,
        )
        return "\n".join(lines)


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
            sd_s=self.solution.sd_s,
            waits_s=self.figure(lambda b, _: b.mean_s if b.waits else 0.0),
            completed=_chance(self.figure(lambda _, o: _completes(o.target))),
            completed_s=self.solution.completed_s,
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
