"""What went on in a run at any time, in words: under a video's picture, and in the viewer.

The truth as the log has it, of both sites at once; nobody in the run knew all of it.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from teleop_sim.core.records import (
    Blackout,
    EpisodeEnded,
    ModeChanged,
    OperatorActed,
    PacketEnded,
    Record,
    RunEnded,
    TransitionTaken,
    Waited,
)
from teleop_sim.log.load import Log

DIRECTIONS = ("up", "down")
LINES = "log"
"""Topic of the packets that carry the robot's log lines."""
TOPICS = (
    "machine/transition",
    "machine/mode",
    "field/episode",
    "field/wait",
    "operator/act",
    "link/packet",
    "link/blackout",
    "run/ended",
)

T = TypeVar("T")


@dataclass(frozen=True)
class Told:
    """What went on at one time.

    Attributes:
        state: of the machine at the field site. mode: of the machine.
        doing: the skill under way, or what the field site waits for.
        crew: what the people do, one a role.
        link: each direction: ``idle``, ``busy`` or ``dark``.
        line: the last log line that has arrived at the control station.
        ended: how the run ended, once it has.

    """

    state: str
    mode: str
    doing: str
    crew: str
    link: dict[str, str]
    line: str
    ended: str


@dataclass(frozen=True)
class _Steps(Generic[T]):
    """A value that changes at times and stays in between."""

    start: T
    times_s: Sequence[float] = ()
    values: Sequence[T] = ()

    def at(self, t_s: float) -> T:
        k = bisect_right(self.times_s, t_s)
        return self.values[k - 1] if k else self.start


@dataclass(frozen=True)
class _Spans:
    """Stretches with words; several may hold at once."""

    spans: Sequence[tuple[float, float, str]] = field(default_factory=tuple)

    def at(self, t_s: float) -> list[str]:
        return [words for a, b, words in self.spans if a <= t_s < b]


class Telling:
    """A run's log as words over time."""

    def __init__(self, records: Iterable[Record]) -> None:
        by_kind: dict[type[Record], list[Record]] = {}
        for record in records:
            by_kind.setdefault(type(record), []).append(record)

        def of(kind: type[_R]) -> list[_R]:
            return [r for r in by_kind.get(kind, []) if isinstance(r, kind)]

        taken, packets, episodes, waits = of(TransitionTaken), of(PacketEnded), of(EpisodeEnded), of(Waited)
        begun = (
            [(r.t_s, r.state) for r in taken]
            + [(r.start_s, r.state) for r in episodes]
            + [(r.start_s, r.state) for r in waits]
        )
        self._state = _steps(taken, lambda r: r.t_s, lambda r: r.next_state, min(begun)[1] if begun else "")
        self._mode = _steps(of(ModeChanged), lambda r: r.t_s, lambda r: r.mode, "normal")
        self._skills = _Spans([(r.start_s, r.t_s, r.skill) for r in episodes])
        self._waits = _Spans([(r.start_s, r.t_s, _waiting(r)) for r in waits])
        self._crew = _Spans(
            [(r.start_s, r.t_s, f"{r.role} {_DOES.get(r.kind, r.kind)}: {r.text}") for r in of(OperatorActed)]
        )
        lines = [r for r in packets if r.direction == "down" and r.topic == LINES and r.outcome == "delivered"]
        self._lines = _steps(lines, lambda r: r.arrived_s, lambda r: r.text, "")
        self._busy = {way: _Spans([_sending(r) for r in packets if r.direction == way]) for way in DIRECTIONS}
        self._dark = {
            way: _steps([r for r in of(Blackout) if r.direction == way], lambda r: r.t_s, lambda r: r.dark, False)
            for way in DIRECTIONS
        }
        self._ended = _steps(of(RunEnded), lambda r: r.t_s, lambda r: ": ".join(filter(None, (r.outcome, r.cause))), "")

    @staticmethod
    def of(log: Log) -> Telling:
        """What a log tells."""
        return Telling(record for topic in TOPICS for record in log.records(topic))

    def at(self, t_s: float) -> Told:
        """What went on at a time."""
        return Told(
            state=self._state.at(t_s),
            mode=self._mode.at(t_s),
            doing=(self._skills.at(t_s) or self._waits.at(t_s) or [""])[-1],
            crew="; ".join(dict.fromkeys(self._crew.at(t_s))),
            link={way: self._link(way, t_s) for way in DIRECTIONS},
            line=self._lines.at(t_s),
            ended=self._ended.at(t_s),
        )

    def _link(self, way: str, t_s: float) -> str:
        if self._dark[way].at(t_s):
            return "dark"
        return "busy" if self._busy[way].at(t_s) else "idle"


_R = TypeVar("_R", bound=Record)
_DOES = {"read": "reads", "decide": "decides", "send": "sends", "talk": "talks"}


def _steps(records: Iterable[_R], when: Callable[[_R], float], what: Callable[[_R], T], start: T) -> _Steps[T]:
    ordered = sorted(records, key=when)
    return _Steps(start, [when(r) for r in ordered], [what(r) for r in ordered])


def _waiting(wait: Waited) -> str:
    return "waits for the operator" if wait.kind == "operator" else f"waits: {wait.why}"


def _sending(packet: PacketEnded) -> tuple[float, float, str]:
    """From a packet's first bit to its last, also where the dark came in between: that is told as such."""
    if math.isfinite(packet.arrived_s):
        return packet.service_s, packet.arrived_s - packet.propagation_s, packet.topic
    # Nothing is in the span of what never went out: its start is NaN.
    return packet.service_s, packet.service_s + packet.serialisation_s, packet.topic
