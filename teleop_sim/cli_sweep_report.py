"""``teleop-sim report DIR``: the report of a sweep, and pages of the runs that it links to."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from pathlib import Path

from teleop_sim.cli_io import say, warn
from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.core.units import format_time

PAGE_S = 2.0
"""CPU time of a run's page, about (measured: docs/sweeps.md)."""


def print_sweep_report(
    path: Path, out: Path | None, formats: Sequence[str], choose: str = "", pages: bool = False
) -> list[Path]:
    """Write the report of a sweep and print the files' paths; with ``pages`` first those of the runs it links to.

    Raises:
        BadInput: pages are asked for, and the sweep kept no logs. UnknownName: no such factor. SweepBroken: no sweep.
        OSError: a file cannot be written.

    """
    from teleop_sim.sweep.report import write_sweep

    if pages:
        _write_pages(path)
    paths = write_sweep(path, out, formats, choose)
    for written in paths:
        say(f"wrote {written}")
    return paths


def _write_pages(path: Path) -> None:
    from teleop_sim.sweep.report import sweep_runs
    from teleop_sim.sweep.run_pages import linked_logs, write_pages

    sweep = sweep_runs(path)
    logs, workers = linked_logs(sweep), len(os.sched_getaffinity(0))
    if not logs:
        what = "no run is finished" if not len(sweep.runs) else f"the sweep was made with --detail {sweep.detail}"
        hint = "Sweep again with --detail events or full, or leave --pages out."
        raise BadInput((Problem("--pages", f"{what}: there are no logs", hint),))
    warn(f"{len(logs)} pages of runs, about {format_time(PAGE_S * len(logs) / workers)} with {workers} workers")
    started_s = time.monotonic()
    written = write_pages(path, logs, workers)
    say(f"wrote {len(written)} pages of runs in {format_time(time.monotonic() - started_s)}")
