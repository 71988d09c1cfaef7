"""What stands above a timeline: what was run, how it ended, and the settings that the log tells of. Pure functions."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from textwrap import wrap

from teleop_sim.core.records import Record, RunEnded, RunStarted
from teleop_sim.core.units import format_time
from teleop_sim.reports.shares import duration_s


def title(records: Sequence[Record]) -> str:
    """What was run and how it ended, in at most two lines."""
    started = next((r for r in records if isinstance(r, RunStarted)), None)
    ended = next((r for r in records if isinstance(r, RunEnded)), None)
    run = f"{started.scenario}, seed {started.seed}, replicate {started.replicate}" if started else "run"
    if ended is None:
        how = f"INTERRUPTED: the log ends at {format_time(duration_s(records))}"
    elif ended.outcome == "completed":
        how = f"completed in {format_time(ended.completion_time_s)}"
    else:
        how = f"{ended.outcome} at {format_time(ended.t_s)}" + (f": {ended.cause}" if ended.cause else "")
    lines = wrap(f"{run}: {how}", 130)
    return "\n".join([*lines[:1], lines[1] + (" ..." if len(lines) > 2 else "")] if len(lines) > 1 else lines)


def settings(records: Sequence[Record]) -> str:
    """What the run was made with, as far as the log says: level, pacing and link."""
    started = next((r for r in records if isinstance(r, RunStarted)), None)
    try:
        chosen = tomllib.loads(started.scenario_toml) if started else {}
        parts = [f"{key} {chosen[key]}" for key in ("autonomy", "pacing") if key in chosen]
        for direction, link in chosen.get("link", {}).items():
            parts.append(f"{direction}link {_rate(link['rate_bps'])}, {format_time(link['delay_s'])} one way")
    except (tomllib.TOMLDecodeError, AttributeError, KeyError, TypeError):
        return ""
    return " · ".join(parts)


def _rate(rate_bps: float) -> str:
    return f"{rate_bps / 1e3:g} kbit/s" if rate_bps >= 1e3 else f"{rate_bps:g} bit/s"
