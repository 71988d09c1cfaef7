"""How busy an operator was, from the records of a run alone."""

from __future__ import annotations

import math
from collections.abc import Iterable

from teleop_sim.core.records import OperatorActed, Record


def utilisation(records: Iterable[Record], start_s: float, end_s: float, role: str = "supervisor") -> float:
    """Share of ``start_s`` to ``end_s`` in which one role was busy, in [0, 1]; NaN for an empty interval.

    Acts of one person never overlap (attention serves one thing at a time), so their lengths add up. An act cut by
    either end counts with the part inside. Not modelled: waiting as mental load.
    """
    if end_s <= start_s:
        return math.nan
    busy_s = sum(
        max(0.0, min(act.t_s, end_s) - max(act.start_s, start_s))
        for act in records
        if isinstance(act, OperatorActed) and act.role == role
    )
    return busy_s / (end_s - start_s)


def acts_sent(records: Iterable[Record]) -> int:
    """Number of operator acts of a run: commands sent, repeats included."""
    return sum(isinstance(act, OperatorActed) and act.kind == "send" for act in records)
