"""Contents to files: which formats there are, and how a report's files are named."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from teleop_sim.reports.formats import csv, latex, markdown, png, svg
from teleop_sim.reports.parts import Content, Part

T = TypeVar("T")

PAGE = "html"
"""The format that shows all parts in one file (``formats/html.py``); each of the others writes a file a part."""

WRITERS: Mapping[str, tuple[str, Callable[[Content], bytes | None]]] = {
    "png": (png.SUFFIX, png.png),
    "svg": (svg.SUFFIX, svg.svg),
    "csv": (csv.SUFFIX, csv.csv),
    "latex": (latex.SUFFIX, latex.latex),
    "markdown": (markdown.SUFFIX, markdown.markdown),
}
"""Format to the ending of its files and what makes them of a content, None where it does not apply."""

FORMATS = (PAGE, *WRITERS)
"""All formats, the default first."""


@dataclass(frozen=True)
class Made:
    """A part of a report with its content: what formats write."""

    name: str
    title: str
    content: Content


def made_of(parts: Iterable[Part[T]], subject: T) -> list[Made]:
    """The parts that apply to a run or a sweep, in order."""
    made = ((part, part.make(subject)) for part in parts)
    return [Made(part.name, part.title, content) for part, content in made if content is not None]


def write_report(
    made: Sequence[Made], folder: Path, stem: str, formats: Sequence[str], page: Callable[[], str]
) -> list[Path]:
    """Write ``<stem>.html``, of what ``page`` gives, and the files of ``write_parts``, as ``formats`` ask for.

    The folder is made if it is missing.

    Raises:
        OSError: a file cannot be written.

    """
    folder.mkdir(parents=True, exist_ok=True)
    pages = []
    if PAGE in formats:
        pages.append(folder / f"{stem}.html")
        pages[0].write_text(page(), encoding="utf-8")
    return [*pages, *write_parts(made, folder, stem, formats)]


def write_parts(made: Iterable[Made], folder: Path, stem: str, formats: Sequence[str]) -> list[Path]:
    """Write ``<stem>.<part>.<ending>`` for each part and format that fit together.

    Args:
        made: what to write.
        folder: where to; must exist.
        stem: beginning of the files' names.
        formats: of ``FORMATS``; ``html`` is passed over.

    Returns:
        the files, in the order of the parts.

    Raises:
        OSError: a file cannot be written.

    """
    wanted = [name for name in WRITERS if name in formats]
    paths = []
    for part in made:
        for suffix, write in (WRITERS[name] for name in wanted):
            data = write(part.content)
            if data is not None:
                path = folder / f"{stem}.{part.name}.{suffix}"
                path.write_bytes(data)
                paths.append(path)
    return paths
