"""Where the time went in each cell: stacked bars as long as the mean run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from teleop_sim.reports.parts import Chart
from teleop_sim.reports.run_waterfall import GROUP_COLOURS
from teleop_sim.reports.shares import SHARES
from teleop_sim.reports.sweep_draw import SMALL, WIDTH_IN, number, slant, title
from teleop_sim.reports.sweep_layout import (
    at,
    axes_of,
    held,
    held_note,
    left_out,
    of_level,
    panels,
    shown_levels,
    spread,
)
from teleop_sim.reports.sweep_view import SweepRuns, bare, numeric, words

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_ROWS: Final = 5
"""Rows of panels, along a second factor (a choice of layout)."""

MOST_BARS: Final = 8
"""Of a panel (a choice of layout)."""


def where(sweep: SweepRuns) -> Chart | None:
    """A bar a cell: mean time in each of ``SHARES``, over all runs; None where no run is finished or no time passed."""
    if not len(sweep.runs) or not sweep.runs["time_s"].sum() > 0.0:
        return None
    axes = _axes(sweep)
    notes = ["Mean over all runs, completed or not; the parts add up to the mean time at which a run ended."]
    if sweep.grid:
        notes += [left_out(sweep, axes, _most(axes)), held_note(sweep, held(sweep, (*axes, sweep.compared)))]
    else:
        notes.append("The design is no grid: each bar is the mean over all cells of its level.")
    alt = f"Mean time of a run, split into {', '.join(SHARES.values())}, for each cell."
    return Chart(lambda: _draw(sweep, axes), alt, " ".join(filter(None, notes)))


def _axes(sweep: SweepRuns) -> tuple[str, ...]:
    """The factor of the bars, then that of the rows of panels; none in designs that are no grid."""
    if not sweep.grid:
        return ()
    against = axes_of(sweep, most=1)
    return (*against, *[name for name in sweep.link if name not in against][:1])


def _most(axes: Sequence[str]) -> tuple[int, ...]:
    return (MOST_BARS, MOST_ROWS)[: len(axes)]


def _draw(sweep: SweepRuns, axes: Sequence[str]) -> Figure:
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    # Without a factor of the link the levels themselves are the bars.
    bars, columns = (axes[0], shown_levels(sweep)) if axes else (sweep.compared, (None,))
    runs = at(sweep.runs, held(sweep, (*axes, sweep.compared))) if sweep.grid else sweep.runs
    rows = panels(sweep, runs, axes[1:], _most(axes)[1:])
    values = spread(sweep.levels[bars], MOST_BARS) if bars else (None,)
    wide = min(WIDTH_IN, 1.8 + len(columns) * max(1.0, 0.34 * len(values)))
    figure = Figure(figsize=(wide, 0.95 + max(1.0 * len(rows), 1.8)), layout="constrained")
    drawn = figure.subplots(len(rows), len(columns), squeeze=False, sharex=True, sharey=True)
    for y, row in enumerate(rows):
        for x, level in enumerate(columns):
            _panel(drawn[y, x], of_level(sweep, row.rows, level) if axes else row.rows, bars, values)
        said = [bare(axes[1]), row.title.removeprefix(bare(axes[1])).strip()] if row.title else []
        drawn[y, 0].set_ylabel("\n".join([*said, "time [s]"]), fontsize=SMALL)
    for x, level in enumerate(columns):
        title(drawn[0, x], f"{bare(sweep.compared)} {sweep.says(sweep.compared, level)}" if level is not None else "")
    texts = [_said(sweep, bars, value) for value in values]
    drawn[0, 0].set_xticks(range(len(values)), texts)
    for one in drawn[-1]:
        slant(one, texts, 6 * len(values))
    figure.supxlabel(words(bars) if bars else "", fontsize=SMALL + 1.0)
    handles = [Patch(color=GROUP_COLOURS[key], label=said) for key, said in SHARES.items() if runs[key].sum() > 0.0]
    figure.legend(handles=handles, loc="outside upper center", ncols=2 if wide < 6.0 else 5, frameon=False,
                  fontsize=SMALL, handlelength=1.2, columnspacing=1.2)  # fmt: skip
    return figure


def _said(sweep: SweepRuns, name: str, value: Any) -> str:
    if not name:
        return ""
    return number(value) if numeric((value,)) else sweep.says(name, value)


def _panel(axes: Axes, runs: pd.DataFrame, bars: str, values: Sequence[Any]) -> None:
    groups = [runs[runs[bars] == value] if bars else runs for value in values]
    means = np.array([rows[[*SHARES]].mean().to_numpy() if len(rows) else [0.0] * len(SHARES) for rows in groups])
    bottom = np.zeros(len(values))
    for n, key in enumerate(SHARES):
        axes.bar(range(len(values)), means[:, n], bottom=bottom, width=0.8, color=GROUP_COLOURS[key], linewidth=0.0)
        bottom = bottom + means[:, n]
    axes.grid(True, axis="y", linewidth=0.4, alpha=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=SMALL, length=0)
