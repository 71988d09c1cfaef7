"""Kaplan-Meier curves of a sweep: the share of runs not yet completed, by level, with bands and numbers at risk."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from teleop_sim.reports.parts import Chart
from teleop_sim.reports.sweep_draw import DASHES, SMALL, level_legend, panel_axes, title
from teleop_sim.reports.sweep_layout import (
    Panel,
    at,
    held,
    held_note,
    left_out,
    of_level,
    panels,
    shown_levels,
)
from teleop_sim.reports.sweep_view import SweepRuns, bare
from teleop_sim.stats.runs import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_PANELS: Final = 12
"""In all; more are thinned to 3 rows of 4."""

COLUMNS: Final = 4
MOST_STEPS: Final = 400
"""Of one curve as drawn: finer than a pixel of a panel 1.4 inches wide. The greater of two steps is drawn."""

POOLED: Final = "The design is no grid: the runs of all cells are put together, and mix their settings."


@dataclass(frozen=True)
class Steps:
    """A curve to draw: from each time on the share not yet completed with its 95 % interval, shapes (k,)."""

    times_s: FloatArray
    share: FloatArray
    low: FloatArray
    high: FloatArray


def survival(sweep: SweepRuns) -> Chart | None:
    """Curves for each setting of the link, at most ``MOST_PANELS``; None where no run is finished."""
    if not len(sweep.runs):
        return None
    across, most = _across(sweep)
    notes = [
        "Share of runs not yet completed (Kaplan and Meier) with pointwise 95 % bands; a failed run never completes. "
        "Under each panel, in the order of the legend: runs not yet completed and still watched."
    ]
    if sweep.grid:
        setting = held(sweep, (*across, sweep.compared))
        notes += [left_out(sweep, across, most), held_note(sweep, setting)]
    else:
        notes.append(POOLED)
    by = f" by {bare(sweep.compared)}" if sweep.compared else ""
    alt = f"Share of runs not yet completed over time{by}, with bands and numbers at risk."
    return Chart(lambda: _draw(sweep), alt, " ".join(filter(None, notes)))


def _across(sweep: SweepRuns) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Factors of the panels and how many values of each."""
    if not sweep.grid:
        return (), ()
    across = sweep.link[:2]
    counts = tuple(len(sweep.levels[name]) for name in across)
    if math.prod(counts) <= MOST_PANELS:
        return across, counts
    return across, ((MOST_PANELS,) if len(across) == 1 else (MOST_PANELS // COLUMNS, COLUMNS))


def _panels(sweep: SweepRuns) -> list[Panel]:
    across, most = _across(sweep)
    runs = at(sweep.runs, held(sweep, (*across, sweep.compared))) if sweep.grid else sweep.runs
    return panels(sweep, runs, across, most)


def _draw(sweep: SweepRuns) -> Figure:
    made = _panels(sweep)
    across, most = _across(sweep)
    last = min(most[-1], len(sweep.levels[across[-1]])) if across else 1
    columns = last if last <= COLUMNS else COLUMNS
    rows = math.ceil(len(made) / columns)
    levels = shown_levels(sweep)
    figure, axes = panel_axes(rows, columns, row_in=1.6 + 0.12 * len(levels), share_y=True)
    end_s = _end_s(sweep, made)
    for n, one in enumerate(axes.flat):
        if n < len(made):
            _panel(one, sweep, made[n], end_s)
        else:
            one.remove()
    figure.supxlabel("time [s]", fontsize=SMALL + 1.0)
    figure.supylabel("not yet completed", fontsize=SMALL + 1.0)
    level_legend(figure, sweep, lines=True)
    return figure


def _end_s(sweep: SweepRuns, made: Sequence[Panel]) -> float:
    """A little after the last completion shown; the limit where none completed, and at most."""
    last = max(float(p.rows.loc[p.rows["status"] == "completed", "time_s"].max()) for p in made)
    return min(1.08 * last, sweep.limit_s) if last > 0.0 else sweep.limit_s


def _panel(axes: Axes, sweep: SweepRuns, panel: Panel, end_s: float) -> None:
    from teleop_sim.stats.runs import follow_up

    ticks = _ticks(end_s)
    levels = shown_levels(sweep)
    for n, level in enumerate(levels):
        rows = of_level(sweep, panel.rows, level)
        if not len(rows):
            continue
        times_s, done = follow_up(rows)
        steps = drawn_steps(times_s, done, end_s)
        axes.fill_between(steps.times_s, steps.low, steps.high, step="post", color=f"C{n}", alpha=0.15, linewidth=0.0)
        axes.plot(steps.times_s, steps.share, drawstyle="steps-post", color=f"C{n}", linestyle=DASHES[n], linewidth=1.2)
        for tick in ticks:
            _at_risk(axes, tick, n, int((times_s >= tick).sum()))
    axes.set(xlim=(0.0, end_s), ylim=(0.0, 1.02))
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    title(axes, panel.title.replace(", ", "\n"))


def _at_risk(axes: Axes, time_s: float, level: int, count: int) -> None:
    axes.annotate(
        f"{count}",
        (time_s, 0.0),
        (0.0, -14.0 - 7.5 * level),
        xycoords=("data", "axes fraction"),
        textcoords="offset points",
        ha="center",
        va="top",
        fontsize=SMALL - 0.5,
        color=f"C{level}",
        annotation_clip=False,
    )


def _ticks(end_s: float) -> list[float]:
    """Three to five round times from 0 on."""
    raw = end_s / 4.0
    size = 10.0 ** math.floor(math.log10(raw))
    step = min((m * size for m in (1.0, 2.0, 2.5, 5.0, 10.0) if m * size >= raw), default=raw)
    return [n * step for n in range(int(end_s / step) + 1)]


def drawn_steps(times_s: FloatArray, done: np.ndarray[Any, np.dtype[np.bool_]], end_s: float) -> Steps:
    """The curve of some runs up to a time, with at most ``MOST_STEPS`` steps.

    Args:
        times_s: how long each run was at risk [s].
        done: whether it then completed.
        end_s: of the axis; the curve ends earlier where nobody was watched so long.

    """
    from teleop_sim.stats.survival import kaplan_meier

    curve = kaplan_meier(times_s, done)
    at_s = np.concatenate(([0.0], curve.times_s))
    columns = [
        np.concatenate(([first], steps))
        for first, steps in ((1.0, curve.survival), (curve.first_low, curve.low), (1.0, curve.high))
    ]
    if at_s.size > MOST_STEPS:
        # Of steps that are closer than can be seen, the last; and the start.
        kept = np.append(np.diff(np.floor(at_s / end_s * MOST_STEPS)) > 0.0, True)
        kept[0] = True
        at_s, columns = at_s[kept], [column[kept] for column in columns]
    # A curve that has come to nothing ends there: nobody is left to whom an interval could belong.
    stop_s = at_s[-1] if columns[0][-1] == 0.0 else min(end_s, curve.watched_s)
    return Steps(np.append(at_s, max(stop_s, at_s[-1])), *(np.append(c, c[-1]) for c in columns))
