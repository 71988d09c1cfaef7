"""What the commands print: a run's summary, its JSON, a report."""

from __future__ import annotations

import json
import math
import shlex
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.measure import Measurement

from teleop_sim.cli_io import forget_reader
from teleop_sim.core.units import format_time

if TYPE_CHECKING:
    from rich.table import Table

    from teleop_sim.core.records import Record
    from teleop_sim.run import RunResult

_WIDTH_OF_A_FILE = 120


class Paper(Console):
    """Standard output; wide where it is no terminal; a reader that went away is no error."""

    def __init__(self) -> None:
        super().__init__(highlight=False, markup=False, width=None if sys.stdout.isatty() else _WIDTH_OF_A_FILE)

    def on_broken_pipe(self) -> None:
        """See rich: whoever read has gone away."""
        forget_reader(sys.stdout)


def result_json(result: RunResult) -> str:
    """One JSON object; what is not known (the completion time of a failure) is null.

    A door or valve has ``times`` (columns of the ViGIR paper's Table 2) and ``crew`` (what it did, counted), too.
    """
    told = asdict(result) | (_told_of_drc(result.log) if result.log.exists() else {})
    return json.dumps({name: _plain(value) for name, value in told.items()}, allow_nan=False)


def _told_of_drc(path: Path) -> dict[str, Any]:
    from teleop_sim.log.load import load
    from teleop_sim.reports.drc_show import is_drc, times_json

    log = load(path)
    return dict(times_json(list(log.records()))) if is_drc(list(log.records("run/started"))) else {}


def _plain(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, dict):
        return {name: _plain(inner) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    return str(value) if isinstance(value, Path) else value


def print_summary(result: RunResult) -> None:
    """Outcome, a table beside the paper's, where the time went, and what to type next."""
    from teleop_sim.log.load import load

    paper = Paper()
    _print_tables(paper, list(load(result.log).records()))
    for line in summary_lines(result):
        paper.print(line, soft_wrap=True)


def summary_lines(result: RunResult) -> list[str]:
    """How the run ended and where its log is."""
    done = result.outcome == "completed"
    how = f"completed in {format_time(result.completion_time_s)}" if done else f"{result.outcome}: {result.cause}"
    exact = f" ({result.completion_time_s:.3f} s of simulated time)" if done else ""
    return [
        "",
        f"{result.scenario} seed {result.seed}: {how}{exact}",
        f"round trips {result.round_trips}, operator acts {result.operator_acts}, "
        f"computed in {result.wall_s:.1f} s, {result.physics_s:.1f} s of it physics",
        f"log:  {result.log}",
        f"next: teleop-sim report {shlex.quote(str(result.log))}",
    ]


def print_report(path: Path, out: Path | None, formats: Sequence[str]) -> list[Path]:
    """Write the report of a log, print its tables and the files' paths, and return these.

    Raises:
        LogDamaged: the log cannot be read.
        OSError: a file cannot be written.

    """
    from teleop_sim.log.load import load
    from teleop_sim.reports.page import write_view
    from teleop_sim.reports.run_view import Run

    paper, run = Paper(), Run(load(path))
    paths = write_view(run, out, formats)
    _print_tables(paper, list(run.records))
    _print_ledger(paper, list(run.records))
    if run.log.interrupted:
        paper.print(f"\nThe run was interrupted: the log reads up to {run.log.end_s:.1f} s.")
    for written in paths:
        paper.print(f"wrote {written}", soft_wrap=True)
    return paths


def _print_tables(paper: Console, records: list[Record]) -> None:
    """What papers tell of such a run, and where its time went."""
    from teleop_sim.reports.drc_show import crew_lines, is_drc
    from teleop_sim.reports.shares import where_time_went
    from teleop_sim.reports.terminal import rich_shares

    if is_drc(records):
        _print_times(paper, records)
    else:
        _print_states(paper, records)
    paper.print(rich_shares(where_time_went(records)))
    for line in crew_lines(records) if is_drc(records) else ():
        paper.print(line, soft_wrap=True)


def _print_times(paper: Console, records: list[Record]) -> None:
    from teleop_sim.reports.terminal import rich_times

    times = rich_times(records)
    paper.print(times if _fits(paper, times) else _plain_ruled(rich_times(records, narrow=True)))


def _print_states(paper: Console, records: list[Record]) -> None:
    from teleop_sim.reports.table import state_table
    from teleop_sim.reports.terminal import rich_table

    rows = state_table([records])
    states = rich_table(rows)
    if not _fits(paper, states):
        states = _plain_ruled(states)
    if not _fits(paper, states):
        states = _plain_ruled(rich_table(rows, narrow=True))
    paper.print(states)


def _print_ledger(paper: Console, records: list[Record]) -> None:
    from teleop_sim.reports.ledger import ledger, message_ledger
    from teleop_sim.reports.terminal import rich_ledger

    for rows, messages in ((message_ledger(records), True), (ledger(records), False)):
        if rows:
            table = rich_ledger(rows, messages=messages)
            narrow = _plain_ruled(rich_ledger(rows, narrow=True, messages=messages))
            paper.print(table if _fits(paper, table) else narrow)


def _fits(paper: Console, table: Table) -> bool:
    options = paper.options.update(max_width=_WIDTH_OF_A_FILE)
    return Measurement.get(paper, options, table).maximum <= paper.width


def _plain_ruled(table: Table) -> Table:
    table.box, table.padding, table.pad_edge = None, (0, 1, 0, 0), False
    return table
