"""A figure of each cell against the factors of the link, a line a level, with intervals: time and probability.

Of a grid, what is neither axis, panel nor line is held. Of other designs each cell is a point: its other factors differ
from those of its neighbours, and no line joins them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from teleop_sim.core.units import format_time
from teleop_sim.reports.parts import Chart
from teleop_sim.reports.sweep_draw import (
    MARKERS,
    category_axis,
    level_legend,
    number_axis,
    panel_axes,
    title,
)
from teleop_sim.reports.sweep_layout import at, axes_of, held, held_note, left_out, of_level, panels, shown_levels
from teleop_sim.reports.sweep_view import SweepRuns, bare, logarithmic, numeric, words
from teleop_sim.stats.runs import FloatArray

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_PANELS: Final = 5
"""Panels side by side (a choice of layout)."""

MOST_POINTS: Final = 1_000
"""Of a panel: 0.2 kB each in a page, whose size has a bound."""

DODGE: Final = 0.014
"""Between two lines, as a share of the axis, so that their intervals do not cover each other (a choice of layout)."""


@dataclass(frozen=True)
class _Figure:
    """A column of the sweep's table with its interval, and its words."""

    column: str
    words: str
    factor: float = 1.0
    top: float | None = None


def completion(sweep: SweepRuns) -> Chart | None:
    """Restricted mean completion time of each cell; None where nothing varies or no run is there."""
    limit = format_time(sweep.limit_s)
    note = (
        f"Mean completion time with 95 % intervals. It is restricted: a run that had not completed by {limit}, or "
        f"failed, counts {limit}. Cells share their random numbers, so that a difference between two of them is known "
        "better than these intervals tell: see the decision map."
    )
    return _chart(sweep, _Figure("mean_s", "mean completion time [s]"), "Mean completion time", note)


def probability(sweep: SweepRuns) -> Chart | None:
    """Share of the runs of each cell that completed; None as for ``completion``."""
    note = f"Share of runs that completed within their time limit ({format_time(sweep.limit_s)}), 95 % (Wilson)."
    return _chart(sweep, _Figure("completion", "completed [%]", 100.0, 104.0), "Share of completed runs", note)


def _chart(sweep: SweepRuns, shown: _Figure, what: str, note: str) -> Chart | None:
    if not len(sweep.runs) or not sweep.varying:
        return None
    against = axes_of(sweep) or (sweep.compared,)
    others = f" for each {bare(sweep.compared)}" if sweep.compared not in against and sweep.compared else ""
    alt = f"{what} against {' and '.join(map(bare, against))}{others}, with 95 % intervals."
    notes = [note] + ([_grid_note(sweep, against)] if sweep.grid else [_points_note(sweep)])
    draw = _draw_grid if sweep.grid else _draw_points
    return Chart(lambda: draw(sweep, shown, against), alt, " ".join(filter(None, notes)))


def _points(sweep: SweepRuns) -> pd.DataFrame:
    """Cells to draw as points: all, or every second, third, ... of very many."""
    return sweep.table.iloc[:: -(-len(sweep.table) // MOST_POINTS)]


def _points_note(sweep: SweepRuns) -> str:
    cut = len(_points(sweep))
    said = f" Shown are {cut:,} of {len(sweep.table):,} cells, evenly chosen." if cut < len(sweep.table) else ""
    return SCATTER_NOTE + said


SCATTER_NOTE: Final = "The design is no grid: each point is a cell, and its other factors differ, too."


def _facet(sweep: SweepRuns, x: str) -> tuple[str, ...]:
    return tuple(name for name in sweep.link if name != x)[:1]


def _grid_note(sweep: SweepRuns, against: Sequence[str]) -> str:
    facets = {name for x in against for name in _facet(sweep, x)}
    notes = [left_out(sweep, sorted(facets), [MOST_PANELS] * len(facets))]
    for x in against:
        notes.append(held_note(sweep, held(sweep, (x, *_facet(sweep, x), sweep.compared))))
    return " ".join(dict.fromkeys(filter(None, notes)))


def _draw_grid(sweep: SweepRuns, shown: _Figure, against: Sequence[str]) -> Figure:
    rows = [_row(sweep, x) for x in against]
    figure, axes = panel_axes(len(rows), max(map(len, rows)), row_in=1.95, share_y=True)
    for y, (x, row) in enumerate(zip(against, rows, strict=True)):
        for n, panel in enumerate(row):
            _panel(axes[y, n], sweep, panel.rows, x, shown, joined=True)
            title(axes[y, n], panel.title)
            axes[y, n].set_xlabel(words(x) if n == len(row) // 2 or len(row) < 3 else "")
        for spare in axes[y, len(row) :]:
            spare.remove()
        axes[y, 0].set_ylabel(shown.words)
    # The panels share it; once all is drawn, so that it holds all.
    axes[0, 0].set_ylim(0.0, shown.top)
    if sweep.compared not in against:
        level_legend(figure, sweep)
    return figure


def _row(sweep: SweepRuns, x: str) -> list[Any]:
    facet = _facet(sweep, x)
    cells = at(sweep.table, held(sweep, (x, *facet, sweep.compared)))
    return panels(sweep, cells, facet, [MOST_PANELS] * len(facet))


def _draw_points(sweep: SweepRuns, shown: _Figure, against: Sequence[str]) -> Figure:
    figure, axes = panel_axes(1, len(against), row_in=2.5, share_y=True)
    for n, x in enumerate(against):
        _panel(axes[0, n], sweep, _points(sweep), x, shown, joined=False)
        axes[0, n].set_xlabel(words(x))
    axes[0, 0].set_ylabel(shown.words)
    axes[0, 0].set_ylim(0.0, shown.top)
    if sweep.compared not in against:
        level_legend(figure, sweep)
    return figure


def _panel(axes: Axes, sweep: SweepRuns, cells: pd.DataFrame, x: str, shown: _Figure, joined: bool) -> None:
    levels = shown_levels(sweep) if x != sweep.compared else (None,)
    values = sweep.levels[x]
    for n, level in enumerate(levels):
        rows = of_level(sweep, cells, level) if x != sweep.compared else cells
        if len(rows):
            _line(
                axes,
                _places(rows[x], values, (n - (len(levels) - 1) / 2) * DODGE),
                rows,
                shown,
                n,
                joined and numeric(values),
            )
    (number_axis if numeric(values) else category_axis)(axes, sweep, x)


def _places(column: pd.Series[Any], values: Sequence[Any], shift: float) -> FloatArray:
    """Where values stand on an axis, moved by a share of its length."""
    if not numeric(values):
        return np.array([values.index(v) for v in column], dtype=float) + shift * max(len(values) - 1, 1)
    numbers = column.to_numpy(dtype=float)
    if logarithmic(values):
        return np.asarray(numbers * np.exp(np.log(max(values) / min(values)) * shift))
    return np.asarray(numbers + shift * (max(values) - min(values)))


def _line(axes: Axes, x: FloatArray, rows: pd.DataFrame, shown: _Figure, n: int, joined: bool) -> None:
    """One level: points, intervals, and a line where cells differ in nothing else. One run alone has no interval."""
    order = np.argsort(x, kind="stable")
    column = shown.column
    value, low, high = (
        shown.factor * rows[name].to_numpy(dtype=float)[order] for name in (column, f"{column}_low", f"{column}_high")
    )
    alone = rows["runs"].to_numpy()[order] < 2
    low, high = np.where(alone, value, low), np.where(alone, value, high)
    axes.errorbar(
        x[order],
        value,
        yerr=np.maximum([value - low, high - value], 0.0),
        color=f"C{n}",
        linestyle="-" if joined else "none",
        linewidth=1.1,
        marker=MARKERS[n],
        markersize=3.2,
        markeredgewidth=0.0,
        elinewidth=0.8,
    )
