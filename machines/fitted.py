"""Chances fitted to what happened in runs: maximum likelihood, shares of counts and means of times."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from teleop_sim.core.records import ModeChanged, Record, TransitionTaken
from teleop_sim.machines.analysis_loops import uncounted
from teleop_sim.machines.chances import CONFIRM, Alternative, Alternatives, Chances
from teleop_sim.machines.declare import FELL, Machine

Of = tuple[str, str]
"""A program as (``program``, path), a request as (its kind, path)."""


@dataclass(frozen=True)
class Fitted:
    """Chances, and how well they are known.

    Attributes:
        chances: shares of what was counted. What never came has no chance: nothing is added to any count.
        counts: by program or request, how often each came.
        shared: (path, event) that came and that more than one signal can become; counted as the signal that is not
            counted by the machine, or else as the first row's.

    """

    chances: Chances
    counts: dict[Of, dict[str, int]]
    shared: tuple[tuple[str, str], ...]

    def error(self, of: Of, what: str) -> float:
        """Standard error of a chance: binomial."""
        counts = self.counts[of]
        n = sum(counts.values())
        share = counts.get(what, 0) / n
        return math.sqrt(share * (1.0 - share) / n)


def fit(machine: Machine, records: Iterable[Record]) -> Fitted:
    """Fit a table to records, in the order of the log, of any number of runs one after the other.

    A program's time is that of the visit without waiting for people, so attempts that were rejected are counted into
    the time of the one that passed; attempts that a person cut off tell nothing and are left out. Answers are those to
    requests: what was forced unasked is left out.
    """
    times: dict[Of, dict[str, list[float]]] = {}
    shared: dict[tuple[str, str], None] = {}
    last_s = 0.0
    for record in records:
        if isinstance(record, TransitionTaken):
            for of, what, time_s in _seen(machine, record, shared):
                times.setdefault(of, {}).setdefault(what, []).append(time_s)
            last_s = record.t_s
        elif isinstance(record, ModeChanged) and record.mode == "not_recoverable":
            if record.state in machine.state_names and machine.leaf(record.state).program:
                fell = times.setdefault(("program", record.state), {}).setdefault(FELL, [])
                fell.append(record.t_s - last_s)
            last_s = 0.0
    tables = {of: _alternatives(seen) for of, seen in times.items()}
    return Fitted(
        Chances(
            {path: table for (kind, path), table in tables.items() if kind == "program"},
            {of: table for of, table in tables.items() if of[0] != "program"},
        ),
        {of: {what: len(found) for what, found in seen.items()} for of, seen in times.items()},
        tuple(shared),
    )


def _seen(
    machine: Machine, record: TransitionTaken, shared: dict[tuple[str, str], None]
) -> list[tuple[Of, str, float]]:
    """What a transition tells: of the program, of an answer."""
    path, found = record.state, []
    leaf = machine.leaf(path)
    if leaf.program and record.how != "forced":
        signals = signals_of(machine, path, record.event)
        if len(signals) > 1:
            shared[path, record.event] = None
        found.append((("program", path), signals[0], record.t_s - record.entered_s - record.waited_s))
    kind = "manual" if leaf.manual else "decide" if leaf.decides else "confirm"
    if record.how == "confirmed":
        found.append(((kind, path), CONFIRM, record.waited_s))
    elif record.how == "forced" and (record.waited_s or kind == "manual"):
        found.append(((kind, path), record.event, record.waited_s))
    return found


def signals_of(machine: Machine, path: str, event: str) -> tuple[str, ...]:
    """Signals of a state's program that may become the event, one that is not counted first."""
    direct = (event,) * (event in uncounted(machine, path))
    rows = (
        row.signal
        for row in machine.leaf(path).rows
        if event == row.failed or any(c.event == event and c.limit for c in row.counters)
    )
    return tuple(dict.fromkeys((*direct, *rows))) or (event,)


def _alternatives(seen: dict[str, list[float]]) -> Alternatives:
    n = sum(len(times) for times in seen.values())
    return tuple(Alternative(what, len(times) / n, *_moments(times)) for what, times in seen.items())


def _moments(times_s: list[float]) -> tuple[float, float]:
    """Mean and deviation, of which differences of the clock's own rounding are none."""
    mean_s = math.fsum(times_s) / len(times_s)
    sd_s = math.sqrt(math.fsum((t - mean_s) ** 2 for t in times_s) / len(times_s))
    return max(0.0, mean_s), sd_s if sd_s > 1e-9 * (1.0 + mean_s) and mean_s > 0.0 else 0.0
