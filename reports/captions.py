"""What stands above a timeline: what was run, how it ended, and the settings that the log tells of. Pure functions."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from textwrap import wrap
from typing import Any

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
    tables = chosen(records)
    try:
        parts = [f"{key} {tables[key]}" for key in ("autonomy", "pacing") if key in tables]
        return " · ".join([*parts, *_link(tables.get("link", {}))])
    except (AttributeError, KeyError, TypeError):
        return ""


def crew(records: Sequence[Record]) -> str:
    """Who did it: the robot, the layer and level, the crew, the link; as far as the log says."""
    tables = chosen(records)
    try:
        parts = [str(tables["robot"])] if "robot" in tables else []
        by_people = tables.get("layer") == "template"
        parts.append("people only" if by_people else f"behaviour at level {tables.get('autonomy', '?')}")
        people = tables.get("operator", {})
        parts.append(f"{people['team']} at the station" if "team" in people else "one at the station")
        parts += [str(people["policy"])] if "policy" in people else []
        return " · ".join([*parts, *_link(tables.get("link", {}))]) if tables else ""
    except (AttributeError, KeyError, TypeError):
        return ""


def task(records: Sequence[Record]) -> str:
    """Name of the task; empty where the log does not say."""
    return str(chosen(records).get("task", ""))


def chosen(records: Sequence[Record]) -> dict[str, Any]:
    """The scenario's tables."""
    started = next((r for r in records if isinstance(r, RunStarted)), None)
    try:
        return tomllib.loads(started.scenario_toml) if started else {}
    except tomllib.TOMLDecodeError:
        return {}


def _link(link: Mapping[str, Any]) -> list[str]:
    if "preset" in link:
        return [f"link {link['preset']}"]
    # Keys of the link as a whole stand beside its directions.
    ways = {way: link[way] for way in ("up", "down") if way in link}
    return [f"{way}link {_rate(of['rate_bps'])}, {format_time(of['delay_s'])} one way" for way, of in ways.items()]


def _rate(rate_bps: float) -> str:
    if rate_bps >= 1e6:
        return f"{rate_bps / 1e6:g} Mbit/s"
    return f"{rate_bps / 1e3:g} kbit/s" if rate_bps >= 1e3 else f"{rate_bps:g} bit/s"
