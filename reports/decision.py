"""The decision map as a picture: the best level of each cell, by how much, and how sure. Pure but for the file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.core.units import format_quantity
from teleop_sim.reports.sweep_view import bare

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from teleop_sim.stats.runs import Measure

WIDTH_IN: Final = 6.4
SUFFIXES: Final = (".svg", ".png")

COLOURS: Final = ("#0072b2", "#e69f00", "#009e73", "#d55e00", "#56b4e9", "#cc79a7", "#999999")
"""Told apart by colour-blind people, too. Source: Okabe and Ito, Color Universal Design (2008)."""

ORDER: Final = ("off", "low", "high", "full")
UNSURE: Final = 0.3
"""Of its colour a level keeps where it is not sure; the rest is white (a choice of layout)."""

MOST_PANELS: Final = 3
"""Side by side; more stand below each other (a choice of layout)."""


def draw_decision(found: pd.DataFrame, link: Sequence[str], choose: str, measure: Measure, path: Path) -> None:
    """Draw a decision map into a file; arguments as for ``decision_figure``.

    Args:
        path: ``.svg`` or ``.png``; written in one go, with the same bytes each time.

    Raises:
        BadInput: nothing to draw.

    """
    import matplotlib as mpl

    if not len(found) or not link:
        raise BadInput((Problem("--plot", "there is no map to draw", "It needs a factor beside the one to choose."),))
    with mpl.rc_context({"svg.hashsalt": "teleop-sim", "font.size": 9.0}):
        figure = decision_figure(found, link, choose, measure)
        figure.savefig(path, dpi=150, metadata={"Date": None} if path.suffix.lower() == ".svg" else {})


def decision_figure(
    found: pd.DataFrame, link: Sequence[str], choose: str, measure: Measure, levels: Sequence[str] = ()
) -> Figure:
    """A decision map with one panel for each setting of all but the last two of ``link``.

    Args:
        found: of ``stats.decision.decision_map``; not empty.
        link: its columns, one or more.
        choose: the factor whose best level is shown.
        measure: for the title.
        levels: all of ``choose``, in the order of their colours; left out: those that are best somewhere.

    """
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    across, up = (link[-1], link[-2]) if len(link) > 1 else (link[0], "")
    panels = [((), found)] if len(link) < 3 else list(found.groupby(list(link[:-2]), sort=False))
    best = sorted(dict.fromkeys(map(str, found["best"])), key=lambda v: ORDER.index(v) if v in ORDER else -1)
    levels = list(map(str, levels)) or best
    colour = {level: COLOURS[n % len(COLOURS)] for n, level in enumerate(levels)}
    columns = min(len(panels), MOST_PANELS)
    rows = math.ceil(len(panels) / columns)
    wide = min(max(1.6 + 0.95 * found[across].nunique() * columns, 4.2), WIDTH_IN)
    high = (0.75 + 0.5 * (found[up].nunique() if up else 1)) * rows
    figure = Figure(figsize=(wide, high + 0.7), layout="constrained")
    drawn = figure.subplots(rows, columns, squeeze=False)
    for axes in drawn.flat[len(panels) :]:
        axes.remove()
    for axes, (key, cells) in zip(drawn.flat, panels, strict=False):
        _panel(axes, cells, across, up, colour)
        named = zip(link[:-2], key if isinstance(key, tuple) else (key,), strict=False)
        axes.set_title(", ".join(f"{bare(name)} {format_quantity(name, value)}" for name, value in named), fontsize=8)
    unit = " [s]" if measure.kind == "time" else ""
    figure.suptitle(
        f"Best {bare(choose)} by {measure.kind}, margin{unit} over the second; pale: not sure", fontsize=8.5
    )
    patches = [Patch(facecolor=colour[level], label=level) for level in levels]
    figure.legend(handles=patches, loc="outside lower center", ncols=len(levels), frameon=False, fontsize=8)
    return figure


def _panel(axes: Axes, rows: pd.DataFrame, across: str, up: str, colour: dict[str, str]) -> None:
    xs = list(dict.fromkeys(rows[across]))
    ys = list(dict.fromkeys(rows[up])) if up else [""]
    small = 7.0 if len(xs) < 6 else 6.0
    for row in rows.to_dict("records"):
        x, y = xs.index(row[across]), ys.index(row[up]) if up else 0
        ground = tint(colour[str(row["best"])], 1.0 if row["verdict"] == "clear" else UNSURE)
        axes.add_patch(_square(x, y, ground))
        words = f"{row['best']}\n+{_short(row['margin'])} ± {_short((row['high'] - row['low']) / 2)}"
        axes.text(x, y, words, ha="center", va="center", fontsize=small, color=ink_on(ground))
    axes.set(xlim=(-0.5, len(xs) - 0.5), ylim=(-0.5, len(ys) - 0.5), xlabel=bare(across), ylabel=bare(up) if up else "")
    axes.set_xticks(range(len(xs)), [format_quantity(across, v) for v in xs])
    axes.set_yticks(range(len(ys)), [format_quantity(up, v) for v in ys])
    axes.tick_params(length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)


def tint(colour: str, share: float) -> str:
    """A colour mixed with white, so much of it."""
    from matplotlib.colors import to_hex, to_rgb

    red, green, blue = (share * c + 1.0 - share for c in to_rgb(colour))
    return to_hex((red, green, blue))


def ink_on(ground: str) -> str:
    """Dark or light text, whichever stands out more; neither is black nor white, which pages exchange.

    Contrast as in WCAG 2.2, relative luminance of sRGB; half way between both inks lies a luminance of 0.18.
    """
    from matplotlib.colors import to_rgb

    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(ground)]
    luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    return "#111111" if luminance > 0.18 else "#fefefe"


def _square(x: int, y: int, colour: str) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((x - 0.48, y - 0.46), 0.96, 0.92, facecolor=colour, linewidth=0)


def _short(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 10.0 else f"{value:.2g}"
