"""What a report is made of. A part makes a content of a run or a sweep; formats write contents and know no part.

Contents hold plain values and functions that draw; nothing here imports matplotlib.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Generic, TypeVar

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Cell = str | int | float | None
"""A value of a table: text, a number, or None (or NaN) for what is not known or does not apply."""


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes:
        name: for CSV and pandas, with its unit as suffix, such as ``queue_s``.
        words: for people, with its unit, such as ``queueing [s]``.
        decimals: of numbers shown to people; None: text, or numbers as they are.
        group: heading above this and its neighbours of the same group, such as ``paper``.
        help: a sentence on what it says.

    """

    name: str
    words: str
    decimals: int | None = None
    group: str = ""
    help: str = ""

    def shown(self, cell: Cell) -> str:
        """A cell as people see it; nothing for what is not known."""
        if cell is None or (isinstance(cell, float) and math.isnan(cell)):
            return ""
        if isinstance(cell, float) and self.decimals is not None:
            return f"{cell:.{self.decimals}f}"
        return f"{cell:g}" if isinstance(cell, float) else str(cell)


@dataclass(frozen=True)
class Sheet:
    """A table: full values, one row a tuple in the order of the columns.

    Attributes:
        columns: at least one.
        rows: in the order in which they are shown.
        total: a last row; empty: none. It is shown and not written to CSV.
        note: a paragraph under it: what it counts, where figures beside ours come from.
        links: (row, column) to an address, relative to the report's folder.

    """

    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    total: tuple[Cell, ...] = ()
    note: str = ""
    links: Mapping[tuple[int, int], str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse rows of another length.

        Raises:
            ValueError: a row has more or fewer cells than there are columns.

        """
        for row in (*self.rows, *([self.total] if self.total else [])):
            if len(row) != len(self.columns):
                raise ValueError(f"{len(row)} cells in a table of {len(self.columns)} columns: {row[:3]}")


@dataclass(frozen=True)
class Chart:
    """A figure that matplotlib draws.

    Attributes:
        draw: makes it anew; called inside the style of the format (``style.py``), which sets fonts and neutral colours.
        alt: what it shows, in a sentence, for who cannot see it.
        note: a paragraph under it.

    """

    draw: Callable[[], Figure]
    alt: str
    note: str = ""


@dataclass(frozen=True)
class Drawing:
    """A picture that comes as a file, such as Graphviz's.

    Attributes:
        render: ``svg`` or ``png`` to the file's bytes.
        alt: what it shows, in a sentence.
        note: a paragraph under it.

    """

    render: Callable[[str], bytes]
    alt: str
    note: str = ""


@dataclass(frozen=True)
class Picture:
    """One picture: its file's bytes, such as ``image/jpeg``, and what stands under it."""

    data: bytes
    media: str
    caption: str


@dataclass(frozen=True)
class Pictures:
    """Pictures in order. Only pages show them."""

    items: tuple[Picture, ...]
    note: str = ""


@dataclass(frozen=True)
class Timeline:
    """Lanes over time, to be zoomed in a page; ``still`` is the same as a figure for paper.

    Attributes:
        data: for the page's script, of JSON's types; ``reports/html/timeline.js`` says what it reads.
        still: for the formats that cannot zoom.
        note: a paragraph under it.

    """

    data: Mapping[str, Any]
    still: Chart
    note: str = ""


Content = Sheet | Chart | Drawing | Pictures | Timeline
T = TypeVar("T")


@dataclass(frozen=True)
class Part(Generic[T]):
    """One part of a report of ``T``, a run or a sweep.

    Attributes:
        name: in file names and addresses, such as ``waterfall``.
        title: above it.
        make: its content, or None where it does not apply.

    """

    name: str
    title: str
    make: Callable[[T], Content | None]
