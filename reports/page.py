"""A run's report in the formats that are asked for, written beside its log or elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from teleop_sim.log.load import load
from teleop_sim.reports import run_head
from teleop_sim.reports.formats.files import PAGE, Made, made_of, write_report
from teleop_sim.reports.registry import RUN_PARTS
from teleop_sim.reports.run_view import Run


def write_run(log_path: Path | str, out: Path | str | None = None, formats: Sequence[str] = (PAGE,)) -> list[Path]:
    """Write the report of a run.

    Args:
        log_path: of the log; may be cut off or interrupted.
        out: folder for the files, made if it is missing; None: the log's own.
        formats: of ``formats.files.FORMATS``.

    Returns:
        the files: ``<log>.html``, and of other formats ``<log>.<part>.<ending>``, part by part.

    Raises:
        LogDamaged: there is no log at that path, or a record does not fit its schema.
        OSError: a file cannot be written.

    """
    return write_view(Run(load(log_path)), out, formats)


def write_view(run: Run, out: Path | str | None = None, formats: Sequence[str] = (PAGE,)) -> list[Path]:
    """As ``write_run``, of a run that is loaded."""
    made = made_of(RUN_PARTS, run)
    folder = run.log.path.parent if out is None else Path(out)
    stem = run.log.path.name.removesuffix(".part").removesuffix(".mcap")
    return write_report(made, folder, stem, formats, lambda: run_html(run, made))


def run_html(run: Run, made: Sequence[Made]) -> str:
    """The page of a run as the text of one file."""
    from teleop_sim.reports.formats.html import Page, commands, page_html, tone

    toml = run_head.started(run)
    return page_html(
        Page(
            title=run_head.title(run),
            verdict=run_head.verdict(run),
            tone=tone(run_head.outcome(run)),
            lede=run_head.question(run),
            facts=run_head.facts(run),
            made=tuple(made),
            commands=commands(run_head.again(run)),
            source=("The scenario as it was run", toml.scenario_toml if toml else ""),
        )
    )
