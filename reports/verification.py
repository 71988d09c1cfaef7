"""How good a person's judgements of the robot's claims were: hits, misses, false alarms and correct rejections.

What the operator decided (``operator/judgement``) is joined with what was true (``field/claim``) by the picture's
number.
A *hit* is a rejection of a wrong claim; a *correct rejection* of the alarm is a right claim that was accepted.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from teleop_sim.core.records import Claimed, Judged, Record

WRONG_M = {"handle": 0.02, "wheel": 0.45}
"""A claim is wrong if off by more than this. A handle: what a grasp bears (docs/physics.md). A wheel seen from afar: so
much that fine detection would not find it (docs/perception.md); stereo depth alone is off by decimetres."""


@dataclass(frozen=True)
class Verification:
    """Counts of one event, or of all. ``unseen``: the picture did not show what was claimed; it was confirmed."""

    event: str
    hits: int
    misses: int
    false_alarms: int
    correct_rejections: int
    unseen: int

    @property
    def hit_rate(self) -> float | None:
        """Share of the wrong claims that were rejected; None if there was none."""
        wrong = self.hits + self.misses
        return self.hits / wrong if wrong else None

    @property
    def false_alarm_rate(self) -> float | None:
        """Share of the right claims that were rejected; None if there was none."""
        right = self.false_alarms + self.correct_rejections
        return self.false_alarms / right if right else None


def verification(records: Iterable[Record]) -> list[Verification]:
    """A row an event, in the order of the names, and a sum ``all``; no rows if nothing was judged."""
    wrong, judged = dict[int, bool](), list[Judged]()
    for record in records:
        if isinstance(record, Claimed):
            off = record.error_m > WRONG_M[record.what.rpartition("_")[2]]
            wrong[record.picture] = wrong.get(record.picture, False) or off
        elif isinstance(record, Judged):
            judged.append(record)
    known = [j for j in judged if j.picture in wrong]
    rows = [_row(event, [j for j in known if j.event == event], wrong) for event in sorted({j.event for j in known})]
    return [*rows, _row("all", known, wrong)] if rows else []


def _row(event: str, judged: list[Judged], wrong: dict[int, bool]) -> Verification:
    counted = [(wrong[j.picture], j.verdict) for j in judged]
    return Verification(
        event,
        counted.count((True, "rejected")),
        counted.count((True, "accepted")),
        counted.count((False, "rejected")),
        counted.count((False, "accepted")),
        sum(verdict == "unseen" for _, verdict in counted),
    )
