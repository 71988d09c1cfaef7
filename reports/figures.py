"""A run in one row: outcome, times, modes, link and workload, from its records alone. Pure functions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from teleop_sim.channel.counters import Counters
from teleop_sim.core.records import (
    Blackout,
    EpisodeEnded,
    OperatorActed,
    PacketEnded,
    Record,
    Requested,
    RunEnded,
    Scored,
)
from teleop_sim.reports.intervals import length_s, union
from teleop_sim.reports.shares import SHARES, duration_s, where_time_went
from teleop_sim.reports.visits import MODES, visits

Figure = float | int | str
RUN_FIGURES: Mapping[str, str] = {
    "outcome": "completed, failed, censored (the time limit came first) or refused (nothing could ever get across)",
    "status": "the same for statistics: completed, failed (refused too) or censored",
    "cause": "in words; of a failure the physical one",
    "completion_time_s": "NaN unless completed",
    "time_s": "when the run ended",
    "score": "the last checkpoint scored",
    "round_trips": "requests that were answered",
    "requests": "made to the operator",
    "retries": "failures of attempts, over all states",
    "normal_s": "time in states left in normal mode",
    "auto_s": "time in states left in autonomous recovery",
    "manual_s": "time in states left in manual mode, or not recoverable",
    **SHARES,
    "episodes": "skills carried out",
    "operator_acts": "commands that the operator sent",
    "operator_busy": "share of the run in which the operator was at work",
    **{
        f"{way}_{key}": f"{words}, {way}link"
        for way in ("up", "down")
        for key, words in {
            "packets": "packets offered",
            "delivered": "packets that arrived",
            "dropped": "packets that were dropped",
            "bits": "bits delivered, with headers",
            "busy": "share of the run in which delivered bits went out",
            "queue_s": "time that delivered packets queued, summed",
            "dark_s": "time in which it was dark",
        }.items()
    },
}
"""Column to what it says."""


def run_figures(records: Sequence[Record]) -> dict[str, Figure]:
    """The columns of ``RUN_FIGURES`` for one run; records of the plant are not needed."""
    ended = next(r for r in reversed(records) if isinstance(r, RunEnded))
    end_s = duration_s(records)
    shares = where_time_went(records)
    figures: dict[str, Figure] = {
        "outcome": ended.outcome,
        "status": ended.outcome,
        "cause": ended.cause,
        "completion_time_s": ended.completion_time_s,
        "time_s": end_s,
        "score": max((r.checkpoint for r in records if isinstance(r, Scored)), default=0),
        "round_trips": ended.round_trips,
        "requests": len({r.request for r in records if isinstance(r, Requested)}),
        **_modes(records),
        **{key: shares[key] for key in SHARES},
        "episodes": sum(isinstance(r, EpisodeEnded) for r in records),
        "operator_acts": ended.operator_acts,
        "operator_busy": _busy(records, end_s),
    }
    return {**figures, **_way("up", records, end_s), **_way("down", records, end_s)}


def refused_figures(cause: str) -> dict[str, Figure]:
    """The row of a run that could not be begun: nothing is known but why."""
    empty: dict[str, Figure] = dict.fromkeys(RUN_FIGURES, math.nan)
    return (
        empty
        | dict.fromkeys(_COUNTS, 0)
        | {
            "outcome": "refused",
            "status": "failed",
            "cause": cause,
            "time_s": 0.0,
        }
    )


_OF_A_WAY = tuple(f"{way}_{key}" for way in ("up", "down") for key in ("packets", "delivered", "dropped", "bits"))
_COUNTS = ("score", "round_trips", "requests", "retries", "episodes", "operator_acts", *_OF_A_WAY)


def _modes(records: Sequence[Record]) -> dict[str, Figure]:
    times_s = dict.fromkeys(MODES, 0.0)
    retries = 0
    for visit in visits(records):
        retries += visit.retries
        for attempt in visit.attempts:
            times_s[attempt.mode if attempt.mode in times_s else "normal"] += attempt.end_s - attempt.start_s
    return {
        "retries": retries,
        "normal_s": times_s["normal"],
        "auto_s": times_s["auto"],
        "manual_s": times_s["manual"] + times_s["not_recoverable"],
    }


def _busy(records: Sequence[Record], end_s: float) -> float:
    """Of all roles together: people work side by side, so an instant counts once."""
    spans = union((r.start_s, min(r.t_s, end_s)) for r in records if isinstance(r, OperatorActed))
    return length_s(spans) / end_s if end_s > 0.0 else 0.0


def _way(way: str, records: Sequence[Record], end_s: float) -> dict[str, Figure]:
    counters = Counters()
    for record in records:
        if isinstance(record, PacketEnded) and record.direction == way:
            counters(record)
    total = counters.total
    return {
        f"{way}_packets": total.offered,
        f"{way}_delivered": total.delivered,
        f"{way}_dropped": sum(total.dropped.values()),
        f"{way}_bits": total.delivered_bits,
        f"{way}_busy": total.serialisation_s / end_s if end_s > 0.0 else 0.0,
        f"{way}_queue_s": total.queue_s,
        f"{way}_dark_s": _dark_s(way, records, end_s),
    }


def _dark_s(way: str, records: Sequence[Record], end_s: float) -> float:
    since_s, dark_s = math.nan, 0.0
    for record in records:
        if isinstance(record, Blackout) and record.direction == way:
            if record.dark:
                since_s = record.t_s
            elif not math.isnan(since_s):
                dark_s, since_s = dark_s + record.t_s - since_s, math.nan
    return dark_s + (end_s - since_s if not math.isnan(since_s) else 0.0)
