"""How busy an operator is, from the records of a run alone, and what that does to him while it runs."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

from teleop_sim.core.records import OperatorActed, Record


def utilisation(records: Iterable[Record], start_s: float, end_s: float, role: str | None = "supervisor") -> float:
    """Share of ``start_s`` to ``end_s`` in which one role was busy, in [0, 1]; NaN for an empty interval.

    Acts of one person never overlap (attention serves one thing at a time), so their lengths add up. An act cut by
    either end counts with the part inside. ``role`` None: all roles together, right for a crew of one. Not modelled:
    waiting as mental load.
    """
    if end_s <= start_s:
        return math.nan
    busy_s = sum(
        max(0.0, min(act.t_s, end_s) - max(act.start_s, start_s))
        for act in records
        if isinstance(act, OperatorActed) and role in (None, act.role)
    )
    return busy_s / (end_s - start_s)


def acts_sent(records: Iterable[Record]) -> int:
    """Number of operator acts of a run: commands sent, repeats included."""
    return sum(isinstance(act, OperatorActed) and act.kind == "send" for act in records)


@dataclass(frozen=True)
class Curve:
    """What utilisation does to a person: nothing up to a ceiling, then ever more.

    Attributes:
        window_s: utilisation is the busy share of so many seconds just past (assumed).
        ceiling: share up to which nobody gets worse. M. L. Cummings, S. Guerlain, Human Factors 49 (2007), 1-15: 70 %
            (remembered, not checked).
        slowing: how much longer everything takes at 100 % (assumed).
        erring: how much more often things go wrong at 100 % (assumed).

    The form above the ceiling is a parabola: waits due to attention grow with utilisation, parabolically with workload
    (B. Donmez, C. Nehme, M. L. Cummings, IEEE Trans. SMC A 40 (2010), 1180-1190, by its abstract). Not modelled: its
    other branch, that people who have nothing to do get worse too.

    """

    window_s: float = 300.0
    ceiling: float = 0.7
    slowing: float = 0.5
    erring: float = 1.0

    def strain(self, busy: float) -> float:
        """0 up to the ceiling, 1 at a utilisation of 1."""
        return (max(0.0, busy - self.ceiling) / (1.0 - self.ceiling)) ** 2


class Load:
    """One person's utilisation in the moving window of a curve; before the run nobody was busy."""

    def __init__(self, curve: Curve) -> None:
        self._curve, self._acts, self._busy_s = curve, deque[tuple[float, float]](), 0.0

    def note(self, start_s: float, end_s: float) -> None:
        """Busy from then to then; acts come in order and do not overlap."""
        self._acts.append((start_s, end_s))
        self._busy_s += end_s - start_s

    def utilisation(self, now_s: float) -> float:
        """Busy share of the window that ends now."""
        since_s = now_s - self._curve.window_s
        while self._acts and self._acts[0][1] <= since_s:
            start_s, end_s = self._acts.popleft()
            self._busy_s -= end_s - start_s
        before_s = max(0.0, since_s - self._acts[0][0]) if self._acts else 0.0
        return max(0.0, self._busy_s - before_s) / self._curve.window_s

    def slowing(self, now_s: float) -> float:
        """Factor on times."""
        return 1.0 + self._curve.slowing * self._curve.strain(self.utilisation(now_s))

    def erring(self, now_s: float) -> float:
        """Factor on rates of errors."""
        return 1.0 + self._curve.erring * self._curve.strain(self.utilisation(now_s))
