"""Maps of a sweep over two factors: where which level is best, and how long and how surely the job is done."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from teleop_sim.core.units import format_time
from teleop_sim.reports.decision import decision_figure, ink_on
from teleop_sim.reports.parts import Chart
from teleop_sim.reports.sweep_draw import SMALL, WIDTH_IN, number, title
from teleop_sim.reports.sweep_layout import at, held, held_note, left_out, of_level, shown_levels, spread
from teleop_sim.reports.sweep_view import SweepRuns, bare, numeric, words

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_VALUES: Final = 8
"""Of a map's axis (a choice of layout)."""

MOST_SHEETS: Final = 6
"""Panels of a decision map, along a third factor (a choice of layout)."""


def decision(sweep: SweepRuns) -> Chart | None:
    """For each setting of the link the level with the best mean, how much better, and how sure.

    None where nothing is compared, nothing else varies, or no setting has two levels with two replicates in common; and
    of a design that is no grid where its factors have more values than a map has places.
    """
    if not sweep.compared or not sweep.link or not len(sweep.runs):
        return None
    from teleop_sim.stats.decision import decision_map
    from teleop_sim.stats.runs import Measure

    link = sweep.link[:3]
    setting = held(sweep, (*link, sweep.compared))
    # Designs of sensitivity visit a setting twice; the same replicate there is the same run.
    runs = at(sweep.runs, setting).drop_duplicates([*sweep.factors, "replicate"])
    most = (MOST_VALUES, MOST_VALUES, MOST_SHEETS)[: len(link)]
    if sweep.grid:
        for name, count in zip(link, most, strict=True):
            runs = runs[runs[name].isin(spread(sweep.levels[name], count))]
    elif any(len(sweep.levels[name]) > count for name, count in zip(link, most, strict=True)):
        return None
    measure = Measure("time", sweep.limit_s)
    found = decision_map(runs, list(link), sweep.compared, measure, sweep.seed)
    if not len(found):
        return None
    # The third factor is the panel's.
    order = (*link[2:], *link[:2])
    found = found.sort_values(list(order), key=lambda c: c.map(_places(sweep, str(c.name))), kind="stable")
    tied = int((found["verdict"] != "clear").sum())
    notes = [
        f"Best {bare(sweep.compared)} by mean completion time, where a run that had not completed by "
        f"{format_time(sweep.limit_s)}, or failed, counts so much; by how much, ± half of the paired 95 % interval. "
        f"Pale: not clearly better than each other one, {tied} of {len(found)} settings (docs/statistics.md).",
        left_out(sweep, link, most),
        held_note(sweep, setting),
    ]
    alt = f"The best {bare(sweep.compared)} for each setting of {' and '.join(map(bare, link))}."
    draw = partial(decision_figure, found, order, sweep.compared, measure, sweep.levels[sweep.compared])
    return Chart(draw, alt, " ".join(filter(None, notes)))


def _places(sweep: SweepRuns, name: str) -> Mapping[Any, int]:
    return {value: place for place, value in enumerate(sweep.levels[name])}


def heat(sweep: SweepRuns) -> Chart | None:
    """Mean completion time and share of completed runs over two factors, a column a level.

    None without two factors that vary beside the compared one, or where the cells are no grid.
    """
    if len(sweep.link) < 2 or not sweep.grid or not len(sweep.runs):
        return None
    over = sweep.link[:2]
    setting = held(sweep, (*over, sweep.compared))
    by = f" for each {bare(sweep.compared)}" if sweep.compared else ""
    notes = [
        f"Above: mean completion time [s], restricted to {format_time(sweep.limit_s)}, dark: long. "
        "Below: share of runs that completed [%], dark: few.",
        left_out(sweep, over, (MOST_VALUES, MOST_VALUES)),
        held_note(sweep, setting),
    ]
    alt = f"Completion time and share of completed runs over {' and '.join(map(bare, over))}{by}."
    return Chart(lambda: _heat(sweep, over, setting), alt, " ".join(filter(None, notes)))


def _heat(sweep: SweepRuns, over: Sequence[str], setting: Mapping[str, Any]) -> Figure:
    from matplotlib.figure import Figure

    cells, levels = at(sweep.table, setting), shown_levels(sweep)
    up, across = (spread(sweep.levels[name], MOST_VALUES) for name in over)
    row_in = 0.55 + min(0.32 * len(up), 2.2)
    width_in = min(WIDTH_IN, 1.2 + len(levels) * (0.5 + 0.55 * len(across)))
    figure = Figure(figsize=(width_in, 2.0 * row_in + 0.5), layout="constrained")
    axes = figure.subplots(2, len(levels), squeeze=False, sharex=True, sharey=True)
    for y, (column, factor) in enumerate((("mean_s", 1.0), ("completion", 100.0))):
        tables = [factor * _values(of_level(sweep, cells, v), over, (up, across), column) for v in levels]
        # Pale is good in both: soon, and surely.
        low, high = (0.0, 100.0) if column == "completion" else _ends(tables)
        for x, (level, table) in enumerate(zip(levels, tables, strict=True)):
            _map(axes[y, x], table, (low, high), dark_is_low=column == "completion")
            if y == 0 and sweep.compared:
                title(axes[y, x], f"{bare(sweep.compared)} {sweep.says(sweep.compared, level)}")
        axes[y, 0].set_ylabel(("time [s]\n" if y == 0 else "completed [%]\n") + words(over[0]), fontsize=SMALL)
    _ticks(sweep, axes, over, (up, across))
    figure.supxlabel(words(over[1]), fontsize=SMALL + 1.0)
    return figure


def _values(
    cells: pd.DataFrame, over: Sequence[str], values: Sequence[Sequence[Any]], column: str
) -> np.ndarray[Any, np.dtype[np.float64]]:
    """A table (up, across) of a column, NaN where no run is finished."""
    found = {(u, a): v for u, a, v in zip(cells[over[0]], cells[over[1]], cells[column], strict=True)}
    return np.array([[found.get((u, a), math.nan) for a in values[1]] for u in values[0]], dtype=np.float64)


def _ends(tables: Sequence[np.ndarray[Any, np.dtype[np.float64]]]) -> tuple[float, float]:
    known = np.concatenate([table[np.isfinite(table)] for table in tables])
    return float(known.min()), float(known.max())


def _map(
    axes: Axes, table: np.ndarray[Any, np.dtype[np.float64]], ends: tuple[float, float], dark_is_low: bool
) -> None:
    from matplotlib import colormaps
    from matplotlib.colors import to_hex
    from matplotlib.patches import Rectangle

    low, high = ends
    shades = colormaps["Blues"]
    small = SMALL if table.shape[1] < 6 else SMALL - 1.0
    for (y, x), value in np.ndenumerate(table):
        if not math.isfinite(value):
            continue
        share = (value - low) / (high - low) if high > low else 0.0
        ground = to_hex(shades(0.08 + 0.82 * (1.0 - share if dark_is_low else share)))
        axes.add_patch(Rectangle((x - 0.5, y - 0.5), 1.0, 1.0, facecolor=ground, linewidth=0))
        axes.text(x, y, f"{value:.0f}", ha="center", va="center", fontsize=small, color=ink_on(ground))
    axes.set(xlim=(-0.5, table.shape[1] - 0.5), ylim=(-0.5, table.shape[0] - 0.5))
    axes.tick_params(length=0, labelsize=SMALL)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _ticks(sweep: SweepRuns, axes: Any, over: Sequence[str], values: Sequence[Sequence[Any]]) -> None:
    """One for all panels, which share them."""
    texts = [
        [number(v) if numeric((v,)) else sweep.says(name, v) for v in levels]
        for name, levels in zip(over, values, strict=True)
    ]
    axes[0, 0].set_yticks(range(len(values[0])), texts[0])
    axes[0, 0].set_xticks(range(len(values[1])), texts[1])
