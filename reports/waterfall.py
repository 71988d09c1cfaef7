"""Where a run's time went, split until every instant has one cause. Whole nanoseconds, so that sums are exact.

An instant counts once, for the first of these that fits:

1. a skill was under way: the robot moves, by the kind of its motion (of two at once, the first in ``MOTIONS``);
2. a pacing wait of the program;
3. the field site waited for its operator, and

   a. a command was on its way to it, else a request was on its way to the operator: the link, by direction and by what
      the oldest one on that way was waiting for (``ways.py``); what people do meanwhile holds up nothing;
   b. somebody was at work: people, by what they did (of two at once, the first in ``WORK``);
   c. a command or request had been lost, and nothing had been sent for it yet: the link, lost;
   d. something else than a heartbeat was on its way to the operator, such as a picture or a report: the link, by what
      it was waiting for;
   e. the request had arrived: people, who have not begun; if not even that, the link, lost;

4. the rest, such as a machine that stands finished.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from teleop_sim.channel.messages import MESSAGES
from teleop_sim.core.records import EpisodeEnded, Layer, OperatorActed, Record, Waited
from teleop_sim.reports.intervals import Interval, both, length_s, minus, union
from teleop_sim.reports.lanes import SKILLS
from teleop_sim.reports.spans import asked, duration_s
from teleop_sim.reports.ways import PHASES, Way, darkness_ns, ns, one_at_a_time, ways

HEARTBEATS = frozenset({"sync_hash", "sync_state", "template_hash"})
"""Topics for which nobody waits."""
MOTIONS = {
    "walk": "walking",
    "see": "looking, scanning, detecting",
    "hand": "moving arms and hands",
    "follow": "following an affordance",
    "posture": "taking a posture",
    "other": "other motion",
}
WORK = {
    "send": "entering",
    "align": "laying a template",
    "decide": "deciding",
    "read": "reading",
    "talk": "talking to one another",
    "else": "busy with other things",
}
"""What people do while the robot waits for them; other kinds of acts are ``else``."""
WAYS = {"up": "uplink", "down": "downlink"}


@dataclass(frozen=True)
class Cause:
    """What time went into: its group in ``shares.SHARES``, and words for people."""

    group: str
    words: str


CAUSES: Mapping[str, Cause] = {
    **{f"robot_{kind}_s": Cause("robot_s", words) for kind, words in MOTIONS.items()},
    "pacing_s": Cause("pacing_s", "fixed waits of the program"),
    **{
        f"{way}_{phase}_s": Cause("link_s", f"{name}: {words}")
        for way, name in WAYS.items()
        for phase, words in PHASES.items()
    },
    "lost_s": Cause("link_s", "lost, and nobody knows yet"),
    **{f"operator_{kind}_s": Cause("operator_s", words) for kind, words in WORK.items()},
    "operator_idle_s": Cause("operator_s", "not begun"),
    "other_s": Cause("other_s", "nothing under way"),
}
"""Key of ``time_by_cause`` to what it says, in the order in which it is shown."""


def time_by_cause(records: Iterable[Record]) -> dict[str, int]:
    """Nanoseconds of a run by the keys of ``CAUSES``; they add up to the nanosecond in which it, or its log, ended."""
    records = list(records)
    return {key: int(length_s(spans)) for key, spans in spans_by_cause(records).items()}


def spans_by_cause(records: Sequence[Record]) -> dict[str, list[Interval]]:
    """When each of ``CAUSES`` held [ns]: apart from one another, together all of the run."""
    left = _Left(records)
    for kind in MOTIONS:
        left.take(f"robot_{kind}_s", [r for r in left.episodes if SKILLS.get(r.skill.lower(), "other") == kind])
    left.take("pacing_s", [r for r in records if isinstance(r, Waited) and r.kind == "pacing"])
    asking = both(left.spans, union((ns(a), ns(b)) for a, b in asked(records)))
    rest = minus(left.spans, asking)
    left.spans = asking
    sent = ways(records)
    critical = [w for w in sent if w.topic == "request" or (w.direction == "up" and w.topic in MESSAGES)]
    left.take_ways([w for w in critical if w.direction == "up"])
    left.take_ways([w for w in critical if w.direction == "down"])
    for kind, spans in _work(records).items():
        left.take_spans(f"operator_{kind}_s", spans)
    lost, known = _after_the_last(critical)
    left.take_spans("lost_s", lost)
    left.take_ways([w for w in sent if w.direction == "down" and w.topic not in HEARTBEATS])
    left.take_spans("operator_idle_s", known)
    left.take_spans("lost_s", list(left.spans))
    left.found["other_s"] = rest
    return {key: left.found.get(key, []) for key in CAUSES}


class _Left:
    """The time of a run that has no cause yet, and what has been found so far."""

    def __init__(self, records: Sequence[Record]) -> None:
        self.episodes = [r for r in records if isinstance(r, EpisodeEnded)]
        self.spans: list[Interval] = union([(0, ns(duration_s(records)))])
        self.found: dict[str, list[Interval]] = {}
        self._darkness = darkness_ns(records)

    def take(self, key: str, some: Sequence[EpisodeEnded | Waited]) -> None:
        self.take_spans(key, union((ns(r.start_s), ns(r.t_s)) for r in some))

    def take_spans(self, key: str, spans: list[Interval]) -> None:
        if spans and (mine := both(self.spans, spans)):
            self.found[key] = union([*self.found.get(key, []), *mine])
            self.spans = minus(self.spans, mine)

    def take_ways(self, some: Sequence[Way]) -> None:
        """Each instant by what the oldest on its way was waiting for."""
        phases: dict[str, list[Interval]] = {}
        for way, own in one_at_a_time(some):
            for phase, spans in way.phases(self._darkness[way.direction]).items():
                phases.setdefault(f"{way.direction}_{phase}_s", []).extend(both(spans, [own]))
        for key, spans in phases.items():
            self.take_spans(key, union(spans))


def _work(records: Sequence[Record]) -> dict[str, list[Interval]]:
    """When people did what [ns]. Laying a template in is told apart from other deciding."""
    spans: dict[str, list[Interval]] = {kind: [] for kind in WORK}
    for r in records:
        if isinstance(r, OperatorActed):
            kind = r.kind if r.kind in WORK and (r.request or r.kind == "talk") else "else"
            spans[kind].append((ns(r.start_s), ns(r.t_s)))
    laying = union((ns(r.start_s), ns(r.t_s)) for r in records if isinstance(r, Layer) and r.layer == "alignment")
    merged = {kind: union(some) for kind, some in spans.items()}
    return merged | {"align": union([*merged["align"], *both(merged["decide"], laying)])}


def _after_the_last(critical: Sequence[Way]) -> tuple[list[Interval], list[Interval]]:
    """Since a command or request was lost, and since one arrived, until the next is sent or ends [ns]."""
    ends = sorted((way.end_ns, way.lost) for way in critical)
    turns = sorted({t_ns for way in critical for t_ns in (way.start_ns, way.end_ns)})
    following = dict(pairwise(turns))
    spans = [((end_ns, following.get(end_ns, _NEVER_NS)), lost) for end_ns, lost in ends]
    gone = union(span for span, lost in spans if lost)
    return gone, minus(union(span for span, lost in spans if not lost), gone)


_NEVER_NS = 1 << 62
