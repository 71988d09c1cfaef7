"""What stands at the head of a run's page: what was run, with whom and over which link, how it ended, and how to repeat
it. Everything is from the log; what it does not say is left out.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any

from teleop_sim.core.records import RunEnded, RunStarted
from teleop_sim.core.units import format_rate, format_time
from teleop_sim.reports.run_view import Run


def started(run: Run) -> RunStarted | None:
    """The record with which the run began."""
    return next((r for r in run.records if isinstance(r, RunStarted)), None)


def ended(run: Run) -> RunEnded | None:
    """The record with which it ended; None: it was interrupted."""
    return next((r for r in run.records if isinstance(r, RunEnded)), None)


def title(run: Run) -> str:
    """What was run."""
    begun = started(run)
    return f"{begun.scenario}, seed {begun.seed}" if begun else run.log.path.name


def verdict(run: Run) -> str:
    """How it came out, in a sentence."""
    end = ended(run)
    if end is None:
        return f"interrupted: the log ends at {format_time(run.end_s)}"
    if end.outcome == "completed":
        return f"completed in {format_time(end.completion_time_s)}"
    if end.outcome == "censored":
        return f"not completed within {format_time(end.t_s)}"
    return f"{end.outcome} at {format_time(end.t_s)}" + (f": {end.cause}" if end.cause else "")


def outcome(run: Run) -> str:
    """The outcome's word; empty: it was interrupted."""
    end = ended(run)
    return end.outcome if end else ""


def question(run: Run) -> str:
    """The scenario's question."""
    return _word(run.scenario, "question")


def facts(run: Run) -> tuple[tuple[str, str], ...]:
    """Name and value of what a reader wants to know first, as far as the log says."""
    tables, begun, end = run.scenario, started(run), ended(run)
    time = f"{end.completion_time_s:.3f} s" if end and end.outcome == "completed" else ""
    found = {
        "Task": _word(tables, "task"),
        "Robot": _word(tables, "robot"),
        "Completion time": time,
        "Simulated time": "" if time else f"{run.end_s:.3f} s",
        "Control": _control(tables),
        "Crew": _crew(_table(tables, "operator")),
        "Link": _link(_table(tables, "link")),
        "Pacing": _word(tables, "pacing"),
        "Round trips": str(end.round_trips) if end else "",
        "Seed": f"{begun.seed}, replicate {begun.replicate}" if begun else "",
        "Time limit": format_time(begun.time_limit_s) if begun else "",
        "Versions": _versions(begun.versions) if begun else "",
        "Log": run.log.path.name + ("" if run.log.whole else " (cut off)"),
    }
    return tuple((name, value) for name, value in found.items() if value)


def again(run: Run) -> tuple[tuple[str, str], ...]:
    """In words what for, and what to type: the page made anew, the run repeated."""
    log = shlex.quote(run.log.path.name)
    page = ("This page is made of the run's log alone, by:", f"teleop-sim report {log}")
    begun = started(run)
    if begun is None or not run.scenario:
        return (page,)
    if begun.replicate:
        words = (
            f"The run was replicate {begun.replicate} of a sweep; the scenario below, run as that replicate, gives it."
        )
        return (page, (words, f"teleop-sim log info {log}"))
    words = "To repeat the run, save the scenario below as scenario.toml, and:"
    return (page, (words, "teleop-sim run scenario.toml"))


def _table(tables: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    found = tables.get(key)
    return found if isinstance(found, Mapping) else {}


def _word(tables: Mapping[str, Any], key: str) -> str:
    found = tables.get(key)
    return str(found) if isinstance(found, str | int | float) else ""


def _control(tables: Mapping[str, Any]) -> str:
    if tables.get("layer") == "template":
        return "by people only, with templates"
    level = _word(tables, "autonomy")
    return f"behaviour, autonomy {level}" if level else ""


def _crew(operator: Mapping[str, Any]) -> str:
    if not operator:
        return ""
    team = _word(operator, "team")
    people = {"": "one person", "1": "one person"}.get(team, f"{team} people")
    words = [people, _word(operator, "policy")]
    expertise = _word(operator, "expertise")
    words += [f"times × {expertise}"] if expertise not in ("", "1", "1.0") else []
    return ", ".join(word for word in words if word)


def _link(link: Mapping[str, Any]) -> str:
    if "preset" in link:
        return _word(link, "preset")
    ways = {way: _table(link, way) for way in ("up", "down")}
    return "; ".join(f"{way} {words}" for way, of in ways.items() if (words := _way(of)))


def _way(of: Mapping[str, Any]) -> str:
    rate, delay = of.get("rate_bps"), of.get("delay_s")
    words = [format_rate(float(rate))] if isinstance(rate, int | float) else []
    words += [f"{format_time(float(delay))} one way"] if isinstance(delay, int | float) else []
    return ", ".join(words)


def _versions(text: str) -> str:
    words = text.split()
    return ", ".join(" ".join(words[i : i + 2]) for i in range(0, len(words), 2))
