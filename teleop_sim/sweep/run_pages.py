"""Pages of the runs to which a sweep's report links: best, median and worst of each cell, an example of each cause."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from teleop_sim.reports.sweep_causes import examples
from teleop_sim.reports.sweep_cells import MOST_ROWS, picked_runs
from teleop_sim.reports.sweep_view import SweepRuns

Tell = Callable[[int, int], None]
"""Called with how many pages are written, and of how many."""


def _untold(_done: int, _of: int) -> None:
    pass


def linked_logs(sweep: SweepRuns) -> list[str]:
    """Logs that the report links to, from the sweep's directory, in the order of cells; empty where none were kept."""
    picked = picked_runs(sweep.runs)
    shown = [run["log"] for cell in list(picked)[:MOST_ROWS] for run in picked[cell].values()]
    return [log for log in dict.fromkeys([*shown, *(run["log"] for run in examples(sweep))]) if log]


def write_pages(directory: Path, logs: Sequence[str], workers: int, tell: Tell = _untold) -> list[Path]:
    """Write the page of each run beside its log, whatever was there.

    Args:
        directory: of the sweep.
        logs: from it.
        workers: processes at once.
        tell: of progress.

    Returns:
        the pages.

    Raises:
        LogDamaged: a log is not there or does not read.
        OSError: a page cannot be written.

    """
    made: list[Path] = []
    if not logs:
        return made
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(workers, len(logs)), mp_context=spawn) as pool:
        for page in pool.map(_page, [directory / log for log in logs]):
            made.append(page)
            tell(len(made), len(logs))
    return made


def _page(log: Path) -> Path:
    from teleop_sim.reports.page import write_run

    return write_run(log)[0]
