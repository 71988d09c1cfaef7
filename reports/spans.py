"""When a run ended, and when its field site waited for its operator. Pure functions."""

from __future__ import annotations

from collections.abc import Sequence

from teleop_sim.core.records import Record, Released, Requested, RunEnded, TransitionTaken, Waited
from teleop_sim.reports.intervals import Interval


def duration_s(records: Sequence[Record]) -> float:
    """Time at which the run ended, or of the last record of an interrupted run [s]."""
    ends = [r.t_s for r in records if isinstance(r, RunEnded)]
    return ends[-1] if ends else max((r.t_s for r in records), default=0.0)


def asked(records: Sequence[Record]) -> list[Interval]:
    """When the field site waited for its operator.

    From each request to its end, and whatever the field site itself logged as a wait for the operator.
    """
    waits = [(r.start_s, r.t_s) for r in records if isinstance(r, Waited) and r.kind == "operator"]
    return waits + [(start_s, end_s) for _, start_s, end_s in requests(records)]


def requests(records: Sequence[Record]) -> list[tuple[int, float, float]]:
    """Each request's number, and from when to when it was open at the field site [s].

    It ends with its answer, or with the next transition where something else moved the machine on, or with the run.
    """
    made: list[tuple[int, float, float]] = []
    pending: dict[int, float] = {}
    for r in records:
        if isinstance(r, Requested):
            pending.setdefault(r.request, r.t_s)
        elif isinstance(r, TransitionTaken):
            made += [(number, start_s, r.t_s) for number, start_s in pending.items()]
            pending.clear()
        elif isinstance(r, Released) and r.effect == "answered" and r.request in pending:
            made.append((r.request, pending.pop(r.request), r.t_s))
    end_s = duration_s(records)
    return made + [(number, start_s, end_s) for number, start_s in pending.items()]
