"""An estimate with its interval, and Wilson's for a share."""

from __future__ import annotations

import math
from dataclasses import dataclass

from teleop_sim.core.errors import BadInput, Problem

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Estimate:
    """A figure from a sample, with a two-sided interval.

    Attributes:
        value: the estimate, in the unit of what was measured; infinite if it lies beyond what was watched.
        low: lower end of the interval.
        high: upper end; infinite if the runs set no bound.
        runs: how many runs it rests on.
        note: what a reader must know, such as that no run differed from another; empty as a rule.

    """

    value: float
    low: float
    high: float
    runs: int
    note: str = ""

    @property
    def half_width(self) -> float:
        """Half of the interval's width."""
        return (self.high - self.low) / 2.0


def refuse(where: str, what: str, hint: str) -> BadInput:
    """The error for one thing that is wrong with an argument."""
    return BadInput((Problem(where, what, hint),))


def check_confidence(confidence: float) -> None:
    """Refuse what is no confidence level.

    Raises:
        BadInput: not strictly between 0.5 and 1.

    """
    if not 0.5 < confidence < 1.0:
        raise refuse("confidence", f"{confidence} is no confidence level", "Give one between 0.5 and 1, such as 0.95.")


def normal_quantile(confidence: float) -> float:
    """Half-width of a two-sided interval of the standard normal distribution [standard deviations]."""
    # Here, not above: factors are parsed by a command line that loads no scipy.
    from scipy.special import ndtri

    check_confidence(confidence)
    return float(ndtri(0.5 + confidence / 2.0))


def student_quantile(confidence: float, freedom: int) -> float:
    """The same for Student's t with ``freedom`` degrees of freedom, at least 1."""
    from scipy.special import stdtrit

    check_confidence(confidence)
    return float(stdtrit(freedom, 0.5 + confidence / 2.0))


def wilson(successes: int, runs: int, confidence: float = CONFIDENCE) -> Estimate:
    """Share of runs that did something, with Wilson's score interval (no continuity correction).

    It never leaves [0, 1] and has a width even when all runs, or none, succeeded.

    Raises:
        BadInput: no runs, or successes that are not between 0 and runs.

    Source: Wilson, J. Am. Stat. Assoc. 22 (1927), 209-212; method 3 of Newcombe, Statist. Med. 17 (1998), 857-872.

    """
    if runs < 1 or not 0 <= successes <= runs:
        raise refuse("wilson", f"{successes} of {runs} is no share", "Give at least one run and 0 to all successes.")
    z2 = normal_quantile(confidence) ** 2
    share = successes / runs
    middle = (successes + z2 / 2.0) / (runs + z2)
    half = math.sqrt(z2) * math.sqrt(share * (1.0 - share) * runs + z2 / 4.0) / (runs + z2)
    # At the ends the formula gives 0 and 1 exactly, arithmetic only nearly.
    low = 0.0 if successes == 0 else middle - half
    high = 1.0 if successes == runs else middle + half
    return Estimate(share, low, high, runs)
