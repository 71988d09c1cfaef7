"""How long a manipulation took and who did it: the columns of the ViGIR paper's Table 2, from a run's records alone.

Source: Romay, Kohlbrecher, Stumpf, von Stryk et al., Collaborative Autonomy Between High-level Behaviors and Human
Operators for Remote Manipulation Tasks using Different Humanoid Robots, section 6.3, Table 2 and Fig. 17;
``drc_table2.csv`` beside this file. "Time starts after the robot has stopped locomotion" and ends "when the main
objective is achieved". As there, columns overlap (a behaviour moves the robot) and leave out what people only look at,
so they do not add up to the overall time.

Our reading, where the paper does not say: where the template was laid in before the last walk and not in a pause of
the contest, that time counts, and belongs to the overall time. Time in which a behaviour waits for an answer is the
behaviour's, as in the paper's two lab rows; time in which a person moves the robot meanwhile is that person's.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache
from importlib.resources import files

from teleop_sim.core.records import (
    EpisodeEnded,
    Layer,
    Record,
    Released,
    Requested,
    RunEnded,
    RunStarted,
    TransitionTaken,
)
from teleop_sim.reports.intervals import Interval, both, length_s, minus, union
from teleop_sim.reports.lanes import SKILLS, scores
from teleop_sim.reports.shares import duration_s

STEPPING = frozenset(skill for skill, family in SKILLS.items() if family == "walk")
SENSING = frozenset({"scan", "detect"})
"""Skills in which no part of the body moves."""
TAKING = frozenset({"pregrasp", "grasp", "take", "act", "cartesian", "reach", "follow"})
"""Skills that are manipulation and nothing else; postures and fingers may come before a walk, too."""
BY_HAND = ("act", "manual")
"""Kinds of requests in which a person acts in lieu of a state."""


@dataclass(frozen=True)
class Times:
    """Columns of Table 2 [s]. NaN: not known, or not told."""

    overall_s: float
    alignment_s: float
    teleoperation_s: float
    template_s: float
    behaviour_s: float
    motion_s: float


COLUMNS: Mapping[str, str] = {
    "overall_s": "overall",
    "alignment_s": "template alignment",
    "teleoperation_s": "teleoperation",
    "template_s": "object template",
    "behaviour_s": "behaviours",
    "motion_s": "robot motion",
}
"""Field of ``Times`` to words."""


@dataclass(frozen=True)
class PaperRow:
    """A row of the paper's table: its name, the scenario that runs it, and whether the first alignment counts."""

    name: str
    scenario: str
    first_alignment: bool
    times: Times


@cache
def paper_rows() -> Mapping[str, PaperRow]:
    """Scenario to the paper's row, in the paper's order: from the longest overall time to the shortest."""
    text = files("teleop_sim.reports").joinpath("drc_table2.csv").read_text(encoding="utf-8")
    lines = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return {line["scenario"]: _paper_row(line) for line in lines}


def _paper_row(line: Mapping[str, str]) -> PaperRow:
    times = Times(*(float(line[field.name] or math.nan) for field in fields(Times)))
    return PaperRow(line["row"], line["scenario"], line["first_alignment"] == "counts", times)


def drc_times(records: Iterable[Record]) -> Times:
    """The columns for one run, up to its last checkpoint, or to its end if it did not complete.

    Of a scenario that is no row of the paper, the first alignment counts.
    """
    records = list(records)
    scenario = next((r.scenario for r in records if isinstance(r, RunStarted)), "")
    row = paper_rows().get(scenario)
    start_s, end_s = evaluated(records)
    window = [(start_s, max(start_s, end_s))]
    aligning = layer_spans(records, "alignment")
    moving = union((r.start_s, r.t_s) for r in records if isinstance(r, EpisodeEnded) and _moves_body(r))
    before_s = length_s(both(aligning, [(0.0, start_s)])) if row is None or row.first_alignment else 0.0
    return Times(
        overall_s=before_s + length_s(window),
        alignment_s=before_s + length_s(both(window, aligning)),
        teleoperation_s=length_s(both(window, layer_spans(records, "teleoperation"))),
        template_s=length_s(both(window, layer_spans(records, "template"))),
        behaviour_s=length_s(both(window, behaviour_spans(records))),
        motion_s=length_s(both(window, moving)),
    )


def completed(records: Iterable[Record]) -> bool:
    """Whether the run reached its objective."""
    return any(isinstance(r, RunEnded) and r.outcome == "completed" for r in records)


def evaluated(records: Sequence[Record]) -> Interval:
    """When the manipulation began and ended [s].

    From the end of the last stepping before the hand went to the thing (0 where the robot did not walk) to the last
    checkpoint of a completed run, else to the end.
    """
    episodes = [r for r in records if isinstance(r, EpisodeEnded)]
    first_s = min((r.start_s for r in episodes if r.skill in TAKING), default=math.inf)
    stops = (r.t_s for r in episodes if r.skill in STEPPING and r.start_s < first_s)
    passed = [t_s for t_s, _, new in scores(records) if new] if completed(records) else []
    return max(stops, default=0.0), passed[-1] if passed else duration_s(records)


def layer_spans(records: Iterable[Record], layer: str) -> list[Interval]:
    """When somebody worked at a layer."""
    return union((r.start_s, r.t_s) for r in records if isinstance(r, Layer) and r.layer == layer)


def behaviour_spans(records: Sequence[Record]) -> list[Interval]:
    """When a behaviour ran and no person moved the robot.

    It runs from the machine's first sign of life until it is preempted or the run ends, but not while it is paused,
    while a person acts in lieu of a state, or while somebody works at the layers below.
    """
    signs = [r.entered_s if isinstance(r, TransitionTaken) else r.t_s for r in records if isinstance(r, _OF_MACHINE)]
    if not signs:
        return []
    running = [(min(signs), min([r.t_s for r in _releases(records, "preempted")] + [duration_s(records)]))]
    people = union([*in_hands(records), *layer_spans(records, "template"), *layer_spans(records, "teleoperation")])
    return minus(minus(union(running), union(_paused(records))), people)


def in_hands(records: Sequence[Record]) -> list[Interval]:
    """When a state was in a person's hands: from the request to act until the state was left or handed back."""
    return request_spans(records, by_hand=True)


def request_spans(records: Sequence[Record], by_hand: bool) -> list[Interval]:
    """From each request, either to act or any other, until it was answered, replaced or its state left."""
    spans: list[Interval] = []
    open_since: dict[str, tuple[int, float]] = {}
    for r in records:
        over = [path for path, (number, _) in open_since.items() if _ends(r, path, number)]
        spans += [(open_since.pop(path)[1], r.t_s) for path in over]
        if isinstance(r, Requested) and (r.kind in BY_HAND) == by_hand:
            open_since[r.state] = (r.request, r.t_s)
    return union([*spans, *((since_s, duration_s(records)) for _, since_s in open_since.values())])


_OF_MACHINE = (TransitionTaken, Requested)


def _ends(r: Record, path: str, request: int) -> bool:
    """Is a state's request over with this record? Leaving a container leaves what is in it."""
    if isinstance(r, TransitionTaken):
        return path == r.state or path.startswith(f"{r.state}/")
    return (isinstance(r, Released) and r.request == request) or (isinstance(r, Requested) and r.state == path)


def _releases(records: Iterable[Record], effect: str) -> list[Released]:
    return [r for r in records if isinstance(r, Released) and r.effect == effect]


def _paused(records: Sequence[Record]) -> list[Interval]:
    resumed = [r.t_s for r in _releases(records, "resumed")] + [duration_s(records)]
    return [(r.t_s, min((t_s for t_s in resumed if t_s >= r.t_s), default=r.t_s)) for r in _releases(records, "paused")]


def _moves_body(r: EpisodeEnded) -> bool:
    return r.skill not in STEPPING and r.skill not in SENSING
