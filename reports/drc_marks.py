"""What a crew does besides confirming: when the level changed, when somebody acted in lieu of a behaviour and so on.

From a run's records alone. The layers of control, from the highest: behaviour, object template, Cartesian
teleoperation (Romay, Kohlbrecher, Stumpf, von Stryk et al., Collaborative Autonomy Between High-level Behaviors and
Human Operators for Remote Manipulation Tasks using Different Humanoid Robots, sections 3 and 6.3). Pure functions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

from teleop_sim.core.records import (
    Layer,
    MessageEnded,
    PacketEnded,
    Record,
    Released,
    RunEnded,
    TransitionTaken,
)
from teleop_sim.reports.drc_times import behaviour_spans, in_hands
from teleop_sim.reports.intervals import Interval

RANKS = {"behaviour": 2, "template": 1, "teleoperation": 0}
"""Layers of control by rank."""
MARKS = {
    "level": "level of autonomy changed",
    "forced": "transition forced",
    "in lieu": "a person acted in lieu of a state",
    "anew": "template laid anew",
    "down": "fell back a layer",
    "up": "handed back to the layer above",
}
"""Kind of a mark to words."""


@dataclass(frozen=True)
class Mark:
    """Something that happened at a time [s]: its kind, and the layer that it concerns."""

    t_s: float
    kind: str
    layer: str


def marks(records: Sequence[Record]) -> list[Mark]:
    """All marks of a run, in the order of time."""
    found = [Mark(r.t_s, "level", "behaviour") for r in records if isinstance(r, Released) and r.effect == "level"]
    found += [Mark(t_s, "forced", "behaviour") for t_s in forced(records)]
    found += [Mark(start_s, "in lieu", "behaviour") for start_s, _ in in_lieu(records)]
    found += [Mark(start_s, "anew", "alignment") for start_s, _ in laid_anew(records)]
    return sorted([*found, *_falls(records)], key=lambda mark: mark.t_s)


def counts(records: Sequence[Record]) -> dict[str, int]:
    """How many marks of each kind; the order is that of ``MARKS``."""
    kinds = [mark.kind for mark in marks(records)]
    return {kind: kinds.count(kind) for kind in MARKS}


def forced(records: Sequence[Record]) -> list[float]:
    """Manual transitions of a behaviour [s]; leaving a state that was in a person's hands anyway is none."""
    hands = in_hands(records)
    taken = (r.t_s for r in records if isinstance(r, TransitionTaken) and r.how == "forced")
    return [t_s for t_s in taken if not any(start_s < t_s <= end_s for start_s, end_s in hands)]


def in_lieu(records: Sequence[Record]) -> list[Interval]:
    """When a person acted in lieu of a behaviour's state; where there is no behaviour, nobody does."""
    return in_hands(records) if behaviour_spans(records) else []


def laid_anew(records: Sequence[Record]) -> list[Interval]:
    """Alignments with which a template that lay already was moved; comparing alone moves none."""
    moved = {
        r.sent_s
        for r in records
        if isinstance(r, PacketEnded | MessageEnded) and r.direction == "up" and r.topic == "template_move"
    }
    work = [r for r in records if isinstance(r, Layer) and r.layer == "alignment"]
    return [(r.start_s, r.t_s) for r in work if any(r.start_s < t_s <= r.t_s for t_s in moved)]


def _falls(records: Sequence[Record]) -> list[Mark]:
    """Steps down and up between the layers.

    Work below the behaviour belongs together until the machine moves on or gets its state back: then the behaviour has
    control again. Without a behaviour the first layer that people work at is where they start from.
    """
    whole_s = [r.t_s for r in records if isinstance(r, RunEnded)]
    behaviour = bool(behaviour_spans(records))
    turns = sorted({*(r.t_s for r in records if isinstance(r, TransitionTaken)), *(b for _, b in in_hands(records))})
    work = sorted((r for r in records if isinstance(r, Layer) and r.layer in RANKS), key=lambda r: (r.start_s, r.t_s))
    found: list[Mark] = []
    at = "behaviour" if behaviour else work[0].layer if work else ""
    for _, row in groupby(work, key=lambda r: sum(t_s <= r.start_s for t_s in turns)):
        last_s = 0.0
        for r in row:
            step = RANKS[r.layer] - RANKS[at]
            found += [Mark(r.start_s, "down" if step < 0 else "up", r.layer)] if step else []
            at, last_s = r.layer, r.t_s
        back_s = next((t_s for t_s in turns if t_s >= last_s), None)
        if behaviour and back_s is not None and back_s not in whole_s:
            found.append(Mark(back_s, "up", "behaviour"))
            at = "behaviour"
    return found
