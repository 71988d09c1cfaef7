"""When a cell has run often enough: its interval is narrow.

Looking again and again and stopping when the interval happens to be narrow favours samples that vary too little by
luck, so that fewer than 95 % of the intervals reported cover. Three guards: a minimum number of runs, looks that lie
apart by a factor instead of one after each run, and a tightened bound. What they leave is measured in
docs/statistics.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from teleop_sim.stats.estimate import CONFIDENCE, Estimate, refuse
from teleop_sim.stats.runs import Measure
from teleop_sim.stats.summary import estimate

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, slots=True)
class StopRule:
    """How narrow is narrow enough, and when to look.

    Attributes:
        relative: half width wanted, as a share of the value; 0.05 is "ci=5%".
        absolute: half width that suffices in any case, in the unit of the measure: for shares near 0.
        minimum: runs before the first look.
        maximum: runs after which a cell stops however wide its interval.
        growth: each look comes at this many times the runs of the one before, at least one run later.
        confidence: of the interval.

    Raises:
        BadInput: a bound below zero or both zero, or a minimum below 2, above the maximum, or a growth below 1.

    """

    relative: float = 0.05
    absolute: float = 0.0
    minimum: int = 20
    maximum: int = 1000
    growth: float = 1.2
    confidence: float = CONFIDENCE

    def __post_init__(self) -> None:
        if min(self.relative, self.absolute) < 0.0 or self.relative + self.absolute <= 0.0:
            raise refuse("stop rule", f"half widths {self.relative}, {self.absolute}", "Give one above zero.")
        if not 2 <= self.minimum <= self.maximum or self.growth < 1.0:
            what = f"looks from {self.minimum} to {self.maximum} runs, times {self.growth}"
            raise refuse("stop rule", what, "Give 2 <= minimum <= maximum and a growth of 1 or more.")


@dataclass(frozen=True, slots=True)
class Progress:
    """Where a cell stands.

    Attributes:
        stop: no more runs are needed, or allowed.
        reached: the interval is as narrow as wanted.
        next_look: number of runs at which to ask again; the runs so far if stopped.
        estimate: of the measure.

    """

    stop: bool
    reached: bool
    next_look: int
    estimate: Estimate


def looks(rule: StopRule) -> tuple[int, ...]:
    """The numbers of runs at which the rule is asked, the last one being the maximum."""
    at = [rule.minimum]
    while at[-1] < rule.maximum:
        at.append(min(rule.maximum, max(at[-1] + 1, math.ceil(at[-1] * rule.growth))))
    return tuple(at)


def narrow(found: Estimate, rule: StopRule) -> bool:
    """Whether an interval is as narrow as the rule wants.

    The half width is held against r / (1 + r) of the value, not r: what lies within that share of the *estimate* lies
    within r of the *truth*. Source: Law, Simulation Modeling and Analysis (5th ed. 2015), section 9.4.1.
    """
    wanted = rule.relative / (1.0 + rule.relative) * abs(found.value)
    return found.half_width <= max(wanted, rule.absolute)


def progress(rows: pd.DataFrame, measure: Measure, rule: StopRule) -> Progress:
    """Whether one cell may stop, from its runs so far; between looks it never may.

    Use the replicates 0 to n - 1 without gaps: taking whichever finished first would favour short runs.

    Raises:
        BadInput: a measure that the runs do not tell.

    """
    runs = len(rows)
    found = estimate(rows, measure, rule.confidence)
    ahead = [n for n in looks(rule) if n > runs]
    at_look = runs in looks(rule) or not ahead
    reached = at_look and narrow(found, rule)
    stop = reached or not ahead
    return Progress(stop, reached, runs if stop else ahead[0], found)
