"""The command ``report``: pages, pictures and tables of a run's log or of a sweep."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from teleop_sim.cli_errors import errors_shown
from teleop_sim.core.errors import BadInput, LogDamaged, Problem, unknown_name

ALL = "all"
DEFAULT = "html"
JOURNAL = "sweep.json"
"""What makes a directory a sweep's."""


def report(
    path: Annotated[
        Path,
        typer.Argument(help="A run's log, such as runs/src-dish_seed1.mcap, or a sweep's directory.", metavar="PATH"),
    ],
    formats: Annotated[
        list[str] | None,
        typer.Option(
            "--format",
            help="html, png, svg, csv, latex, markdown or all; several with commas or by repeating it. Left out: html.",
            metavar="FORMATS",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Directory for the files; left out: beside the log, or in it.", metavar="DIR")
    ] = None,
    choose: Annotated[
        str, typer.Option(help="Of a sweep: the factor whose levels are compared, such as autonomy.", metavar="FACTOR")
    ] = "",
    run_pages: Annotated[
        bool, typer.Option("--pages", help="Of a sweep: first write the page of each run that its report links to.")
    ] = False,
    show: Annotated[bool, typer.Option("--open", help="Open the page in a browser.")] = False,
) -> None:
    """Write the report of PATH: a page to be opened offline, or figures and tables; and print its tables."""
    with errors_shown():
        from teleop_sim.cli_show import print_report
        from teleop_sim.cli_sweep_report import print_sweep_report

        wanted, problems = chosen(formats or [DEFAULT])
        problems += [*path_problems(path), *_out_problems(path, out)]
        if show and not problems and DEFAULT not in wanted:
            problems.append(Problem("--open", "there is no page to open", "Add --format html."))
        for option, given in (("--choose", choose), ("--pages", run_pages)):
            if given and not path.is_dir():
                problems.append(Problem(option, "belongs to a sweep", "Give a sweep's directory, or leave it out."))
        if problems:
            raise BadInput((*problems, *_log_problems(path)))
        if path.is_dir():
            pages = print_sweep_report(path, out, wanted, choose, run_pages)
        else:
            pages = print_report(path, out, wanted)
        if show:
            typer.launch(pages[0].absolute().as_uri())


def chosen(texts: list[str]) -> tuple[list[str], list[Problem]]:
    """The formats asked for, each once and in the order of ``FORMATS``, and what was wrong with the words."""
    from teleop_sim.reports.formats.files import FORMATS

    words = [word.strip() for text in texts for word in text.split(",")]
    bad = [word for word in dict.fromkeys(words) if word not in (*FORMATS, ALL)]
    wanted = [name for name in FORMATS if name in words or ALL in words]
    return wanted, [unknown_name("--format", word, (*FORMATS, ALL)) for word in bad]


def is_sweep(path: Path) -> bool:
    """Whether a path is a sweep's directory."""
    return path.is_dir() and (path / JOURNAL).is_file()


def path_problems(path: Path) -> list[Problem]:
    """What keeps a path from being reported on; what is inside a file is found when it is read."""
    if not path.is_dir() or is_sweep(path):
        return []
    logs = sorted(p for p in path.iterdir() if p.name.endswith((".mcap", ".mcap.part")))
    which = f"Give one of its logs, such as {logs[0]}." if logs else "Give a log or a sweep's directory."
    what = f"is a directory of {len(logs)} logs without {JOURNAL}"
    return [Problem(str(path), what, which)]


def _log_problems(path: Path) -> list[Problem]:
    """What is wrong with a log, to be told along with other problems."""
    from teleop_sim.log.load import load

    try:
        if not path.is_dir():
            load(path)
    except LogDamaged as error:
        return [Problem(*error.args)]
    return []


def _out_problems(path: Path, out: Path | None) -> list[Problem]:
    from teleop_sim.cli_options import out_problems

    if out is not None:
        return out_problems(out)
    # A missing log is said of the log, not of its directory.
    place = path if path.is_dir() else path.parent
    return out_problems(place) if path.exists() else []
