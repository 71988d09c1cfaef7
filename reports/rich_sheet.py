"""A table as a terminal shows it: chosen columns, under headings that are short enough."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from typing import TYPE_CHECKING

from teleop_sim.reports.parts import Cell, Column, Sheet

if TYPE_CHECKING:
    from rich.table import Table


def rich_sheet(
    sheet: Sheet,
    title: str,
    headings: Mapping[str, str],
    caption: str | None = None,
    dashes: Collection[str] = (),
    unknown: str = "",
    dim: str = "",
    fold: bool = False,
    ends: Callable[[tuple[Cell, ...]], bool] = lambda _row: False,
) -> Table:
    """A table of rich's.

    Args:
        sheet: what is shown.
        title: above it.
        headings: of the columns that are shown, by name, in that order; names that the sheet has not are left out.
        caption: under it; None: the sheet's note.
        dashes: columns in which ``-`` stands for zero and for nothing.
        unknown: what stands for a number that is not known.
        dim: columns whose names begin so are dim; empty: none.
        fold: whether texts may be folded.
        ends: whether a row is the last of its section.

    """
    from rich.table import Table

    numbers = _numbers(sheet)
    places = {c.name: i for i, c in enumerate(sheet.columns)}
    shown = [places[name] for name in headings if name in places]
    note = sheet.note if caption is None else caption
    table = Table(title=title, caption=note or None, caption_justify="left", show_footer=bool(sheet.total))

    def text(column: Column, cell: Cell) -> str:
        if column.name in dashes and not cell:
            return "" if cell is None else "-"
        known = not (isinstance(cell, float) and math.isnan(cell))
        return column.shown(cell) if known else unknown

    for i in shown:
        column = sheet.columns[i]
        footer = column.shown(sheet.total[i]) if sheet.total else ""
        table.add_column(
            headings[column.name],
            footer,
            justify="right" if numbers[i] or column.name in dashes else "left",
            no_wrap=not fold,
            overflow="fold" if fold else "ellipsis",
            style="dim" if dim and column.name.startswith(dim) else None,
        )
    for row in sheet.rows:
        table.add_row(*(text(sheet.columns[i], row[i]) for i in shown), end_section=ends(row))
    return table


def _numbers(sheet: Sheet) -> list[bool]:
    """Which columns hold no text."""
    return [not any(isinstance(row[i], str) for row in sheet.rows) and i > 0 for i in range(len(sheet.columns))]
