"""What the figures of a sweep have in common: panels, axes in units of people, one legend of levels.

Drawn within the style of the format that asks, so colours are ``C0`` and so on. matplotlib is loaded where it draws.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from teleop_sim.reports.sweep_layout import shown_levels, spread
from teleop_sim.reports.sweep_view import SweepRuns, logarithmic, words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH_IN: Final = 6.4
"""Of a figure: two columns of most journals, or the text of a thesis (a choice of layout)."""

MARKERS: Final = ("o", "s", "^", "D", "v", "P")
"""Of levels, so that a print without colours tells them apart, too."""

DASHES: Final[tuple[Any, ...]] = ("-", (0, (5, 1.2)), (0, (2.5, 1)), (0, (1, 0.8)), (0, (5, 1, 1, 1)), (0, (4, 2)))
"""Likewise, of lines without markers."""

SMALL: Final = 7.0
"""Points of the lesser text."""

MOST_TICKS: Final = 6


def panel_axes(rows: int, columns: int, row_in: float, share_y: bool, least: int = 1) -> tuple[Figure, Any]:
    """A figure with panels, and its axes as an array (rows, columns).

    Args:
        rows: of panels.
        columns: of panels.
        row_in: height of a row [in].
        share_y: whether the panels of a figure have one scale.
        least: columns for which there is room, so that few panels do not get too wide.

    """
    from matplotlib.figure import Figure

    width_in = min(WIDTH_IN, 0.9 + 3.0 * columns) if columns < 3 else WIDTH_IN
    figure = Figure(figsize=(width_in if least <= 1 else WIDTH_IN, row_in * rows + 0.35), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharey=share_y)
    for one in axes.flat:
        one.grid(True, axis="y", linewidth=0.4, alpha=0.7)
        one.set_axisbelow(True)
        one.spines[["top", "right"]].set_visible(False)
        one.tick_params(labelsize=SMALL, length=2.5)
    return figure, axes


def title(axes: Axes, text: str) -> None:
    """A panel's own."""
    axes.set_title(text, fontsize=SMALL + 0.5)


def level_legend(figure: Figure, sweep: SweepRuns, lines: bool = False) -> None:
    """The levels of what is compared, above all panels; nothing where there is one."""
    from matplotlib.lines import Line2D

    if not sweep.compared:
        return
    handles = [
        Line2D([], [], color=f"C{n}", linestyle=DASHES[n], linewidth=1.2, label=sweep.says(sweep.compared, level))
        if lines
        else Line2D([], [], color=f"C{n}", marker=MARKERS[n], markersize=4, linewidth=1.1, markeredgewidth=0.0,
                    label=sweep.says(sweep.compared, level))
        for n, level in enumerate(shown_levels(sweep))
    ]  # fmt: skip
    figure.legend(
        handles=handles,
        title=words(sweep.compared),
        loc="outside upper center",
        ncols=len(handles),
        frameon=False,
        fontsize=SMALL + 0.5,
        title_fontsize=SMALL + 0.5,
        handlelength=2.4 if lines else 1.8,
    )


def number_axis(axes: Axes, sweep: SweepRuns, name: str) -> None:
    """An x axis at the values that were run; logarithmic where they span a factor of ``LOG_RATIO``."""
    values = sweep.levels[name]
    if logarithmic(values):
        axes.set_xscale("log")
        axes.minorticks_off()
    if len(values) <= 2 * MOST_TICKS:
        shown = spaced(values, logarithmic(values))
        axes.set_xticks(shown, [number(v) for v in shown])
    else:
        axes.xaxis.set_major_formatter(lambda value, _: number(value))


def category_axis(axes: Axes, sweep: SweepRuns, name: str) -> None:
    """An x axis with a place for each value."""
    values = sweep.levels[name]
    shown = spread(range(len(values)), 2 * MOST_TICKS)
    texts = [sweep.says(name, values[n]) for n in shown]
    axes.set_xticks(shown, texts)
    slant(axes, texts, 40)
    axes.set_xlim(-0.5, len(values) - 0.5)


def slant(axes: Axes, texts: Sequence[str], room: int) -> None:
    """Set the ticks' texts aslant where they have more letters than there is room for."""
    if sum(map(len, texts)) > room:
        for label in axes.get_xticklabels():
            label.set(rotation=30, ha="right", rotation_mode="anchor")


def number(value: float) -> str:
    """A tick's number: ``380``, ``4k``."""
    return f"{value / 1e6:g}M" if value >= 1e6 else f"{value / 1e3:g}k" if value >= 1e3 else f"{value:g}"


def spaced(values: Sequence[float], logs: bool) -> list[float]:
    """Values that stand far enough apart for their numbers, a sixth of the axis; first and last always."""
    from math import log

    places = [log(v) for v in values] if logs else list(values)
    apart = (places[-1] - places[0]) / 6.0
    kept = [len(values) - 1]
    for n in reversed(range(1, len(values) - 1)):
        if min(places[kept[-1]] - places[n], places[n] - places[0]) >= apart:
            kept.append(n)
    return [values[n] for n in sorted({0, *kept})]
