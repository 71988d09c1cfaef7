"""A sweep's report in the formats that are asked for; ``teleop_sim.sweep.report`` reads the directory, calls this."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from teleop_sim.core.units import format_time
from teleop_sim.reports.formats.files import Made, made_of, write_report
from teleop_sim.reports.registry import SWEEP_PARTS
from teleop_sim.reports.sweep_view import SweepRuns, bare

DETAILS: Final = {"full": "whole logs", "events": "logs without the robot's motion", "summary": "no logs"}
MOST_VALUES: Final = 8
"""Of a factor, named at the head of the page."""


def write_sweep_view(sweep: SweepRuns, folder: Path, stem: str, formats: Sequence[str]) -> list[Path]:
    """Write the report of a sweep.

    Args:
        sweep: what to report on.
        folder: for the files, made if it is missing.
        stem: beginning of the files' names.
        formats: of ``formats.files.FORMATS``.

    Returns:
        the files: ``<stem>.html``, and of other formats ``<stem>.<part>.<ending>``, part by part.

    Raises:
        OSError: a file cannot be written.

    """
    made = made_of(SWEEP_PARTS, sweep)
    return write_report(made, folder, stem, formats, lambda: sweep_html(sweep, made))


def sweep_html(sweep: SweepRuns, made: Sequence[Made]) -> str:
    """The page of a sweep as the text of one file."""
    from teleop_sim.reports.formats.html import Page, commands, page_html

    return page_html(
        Page(
            title=f"{sweep.name}, a sweep of {_count(sweep.cells, 'cell')}",
            verdict=verdict(sweep),
            tone="good" if sweep.finished else "open",
            lede=sweep.question,
            facts=facts(sweep),
            made=tuple(made),
            commands=commands(_again(sweep)),
            source=("The scenario that was varied", sweep.scenario),
        )
    )


def verdict(sweep: SweepRuns) -> str:
    """How far it is, and how many runs completed."""
    runs = len(sweep.runs)
    if not runs:
        return "no run is finished"
    share = int((sweep.runs["status"] == "completed").sum()) / runs
    so_far = f"{runs:,} runs" if sweep.finished else f"not finished: {runs:,} of {sweep.planned:,} runs so far"
    # 99.96 % is not all.
    shown = f"{share:.0%}" if share in (0.0, 1.0) or 0.005 <= share < 0.995 else f"{share:.2%}"
    return f"{so_far}, {shown} completed"


def facts(sweep: SweepRuns) -> tuple[tuple[str, str], ...]:
    """Name and value of what a reader wants to know first."""
    runs = sweep.runs
    status = runs["status"].value_counts()
    ended = ", ".join(f"{status[name]:,} {name}" for name in ("completed", "failed", "censored") if name in status)
    found = {
        "Task": sweep.task,
        **{_capital(bare(name)): _values(sweep, name) for name in sweep.factors if len(runs)},
        "Compared": bare(sweep.compared) if sweep.compared else "",
        "Design": f"{sweep.design}, {_count(sweep.cells, 'cell')}",
        "Replicates": f"{runs['replicate'].nunique():,}" + (", until known well enough" if sweep.until else ""),
        "Runs": ended,
        "Times restricted to": format_time(sweep.limit_s) if len(runs) else "",
        "Seed": str(sweep.seed),
        "Kept": DETAILS.get(sweep.detail, sweep.detail),
        "Versions": sweep.versions,
    }
    return tuple((name, value) for name, value in found.items() if value)


def _count(number: int, what: str) -> str:
    return f"{number:,} {what}{'' if number == 1 else 's'}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _values(sweep: SweepRuns, name: str) -> str:
    levels = sweep.levels[name]
    if len(levels) <= MOST_VALUES:
        return ", ".join(sweep.says(name, value) for value in levels)
    return f"{sweep.says(name, levels[0])} … {sweep.says(name, levels[-1])} ({len(levels)} values)"


def _again(sweep: SweepRuns) -> tuple[tuple[str, str], ...]:
    """In words what for, and what to type."""
    where = shlex.quote(sweep.where)
    lines = [("This page is made of the sweep's index, by:", f"teleop-sim report {where}")]
    if not sweep.finished:
        lines.insert(0, ("The sweep is not finished. To run what is missing:", f"teleop-sim sweep --resume {where}"))
    lines.append(
        (
            "Its tables and figures as files, and the runs in pandas:",
            f"teleop-sim report {where} --format all\n"
            f"python -c 'import teleop_sim; print(teleop_sim.load_sweep(\"{sweep.where}\"))'",
        )
    )
    return tuple(lines)
