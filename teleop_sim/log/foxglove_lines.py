"""Records as lines of a log for people: what happened, who says so, how bad it is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

from teleop_sim.core.records import (
    Blackout,
    Disturbed,
    EpisodeEnded,
    Judged,
    Layer,
    MessageEnded,
    ModeChanged,
    OperatorActed,
    PacketEnded,
    Record,
    Released,
    Requested,
    RunEnded,
    RunStarted,
    Scored,
    TransitionTaken,
)
from teleop_sim.core.views import LogLine

Level = Literal["info", "warning", "error"]
Words = tuple[Level, str, str]
"""Level, who says it, what."""

_MODES: dict[str, Level] = {"normal": "info", "auto": "warning", "manual": "warning", "not_recoverable": "error"}
_ENDS: dict[str, Level] = {"completed": "info", "censored": "warning", "failed": "error"}
_STOPPED_SHORT = ("blocked", "cut", "lost", "missed", "refused", "stopped")
_FOUND_NOTHING = ("no_ground", "no_motion", "no_plan", "not_felt", "not_found")
_BAD_SKILLS = frozenset((*_STOPPED_SHORT, *_FOUND_NOTHING))
"""Outcomes of skills that came to nothing (``robot/skills``)."""
_GOOD_ENDS = frozenset({"delivered", "in_flight"})


def line_of(record: Record) -> LogLine | None:
    """The line of a record; None for what happens all the time and as it should."""
    say = _SAYS.get(type(record))
    words = say(record) if say is not None else None
    return None if words is None else LogLine(record.t_s, *words)


def _started(r: RunStarted) -> Words:
    return "info", "run", f"{r.scenario}, seed {r.seed}, replicate {r.replicate}; limit {r.time_limit_s:g} s"


def _ended(r: RunEnded) -> Words:
    return _ENDS.get(r.outcome, "warning"), "run", f"{r.outcome} after {r.t_s:.1f} s" + (f": {r.cause}" * bool(r.cause))


def _transition(r: TransitionTaken) -> Words:
    waited = f", after waiting {r.waited_s:.1f} s" if r.waited_s > 0.0 else ""
    note = f" ({r.note})" if r.note else ""
    level: Level = "warning" if r.mode == "manual" or r.how == "forced" else "info"
    return level, "machine", f"{r.state} -> {r.next_state}: {r.event}, {r.how}{waited}{note}"


def _mode(r: ModeChanged) -> Words:
    return _MODES.get(r.mode, "warning"), "machine", f"{r.state}: mode {r.mode}"


def _requested(r: Requested) -> Words:
    about = f" {r.event}" if r.event else ""
    return "warning", "field", f"asks ({r.request}) in {r.state}: {r.kind}{about}" + (f": {r.text}" * bool(r.text))


def _released(r: Released) -> Words:
    level: Level = "warning" if r.effect == "ignored" else "info"
    return level, "field", f"{r.command}: {r.effect}" + (f" ({r.note})" * bool(r.note))


def _episode(r: EpisodeEnded) -> Words:
    level: Level = "error" if r.outcome == "fell" else "warning" if r.outcome in _BAD_SKILLS else "info"
    took = f"{r.skill} in {r.t_s - r.start_s:.1f} s: {r.outcome}"
    return level, "robot", took + (f", {r.cause}" * bool(r.cause))


def _acted(r: OperatorActed) -> Words:
    return "info", r.role, f"{r.kind}: {r.text}" if r.text else r.kind


def _judged(r: Judged) -> Words:
    level: Level = "info" if r.verdict == "accepted" else "warning"
    return level, "supervisor", f"{r.event}: {r.verdict}" + (f", for {r.what}" * bool(r.what))


def _layer(r: Layer) -> Words:
    return "info", "operator", f"{r.layer} for {r.t_s - r.start_s:.1f} s: {r.text}"


def _blackout(r: Blackout) -> Words:
    return ("warning", f"link {r.direction}", "dark") if r.dark else ("info", f"link {r.direction}", "back")


def _packet(r: PacketEnded | MessageEnded) -> Words | None:
    if r.outcome in _GOOD_ENDS:
        return None
    return "warning", f"link {r.direction}", f"{r.topic} {r.outcome}: {r.reason}"


def _scored(r: Scored) -> Words:
    return "info", "task", r.text


def _disturbed(r: Disturbed) -> Words:
    return "info", "world", f"{r.what}: {r.text or ', '.join(f'{v:.4g}' for v in r.values)}"


_SAYS: dict[type[Record], Callable[[Any], Words | None]] = {
    RunStarted: _started,
    RunEnded: _ended,
    TransitionTaken: _transition,
    ModeChanged: _mode,
    Requested: _requested,
    Released: _released,
    EpisodeEnded: _episode,
    OperatorActed: _acted,
    Judged: _judged,
    Layer: _layer,
    Blackout: _blackout,
    PacketEnded: _packet,
    MessageEnded: _packet,
    Scored: _scored,
    Disturbed: _disturbed,
}
