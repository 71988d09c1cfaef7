"""The decision map as a picture: the best level of each cell, by how much, and how sure. Pure but for the file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.core.units import format_quantity

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from teleop_sim.stats.runs import Measure

SUFFIXES: Final = (".svg", ".png")

COLOURS: Final = ("#4477aa", "#ccbb44", "#228833", "#ee6677", "#aa3377", "#66ccee", "#bbbbbb")
"""Told apart by colour-blind people, too. Source: Paul Tol, Colour Schemes, SRON/EPS/TN/09-002 (2021), bright."""

ORDER: Final = ("off", "low", "high", "full")
UNSURE_ALPHA: Final = 0.35


def draw_decision(found: pd.DataFrame, link: Sequence[str], choose: str, measure: Measure, path: Path) -> None:
    """Draw a decision map with one panel for each setting of all but the last two of ``link``.

    Args:
        found: of ``stats.decision.decision_map``.
        link: its columns, one or more.
        choose: the factor whose best level is shown.
        measure: for the title.
        path: ``.svg`` or ``.png``; written in one go, with the same bytes each time.

    Raises:
        BadInput: nothing to draw.

    """
    if not len(found) or not link:
        raise BadInput((Problem("--plot", "there is no map to draw", "It needs a factor beside the one to choose."),))
    import matplotlib
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    across, up = (link[-1], link[-2]) if len(link) > 1 else (link[0], "")
    panels = [((), found)] if len(link) < 3 else list(found.groupby(list(link[:-2]), sort=False))
    levels = sorted(dict.fromkeys(map(str, found["best"])), key=lambda v: ORDER.index(v) if v in ORDER else -1)
    colour = {level: COLOURS[n % len(COLOURS)] for n, level in enumerate(levels)}
    wide = max(2.2 + 1.05 * found[across].nunique(), 4.2)
    high = 1.5 + 0.62 * (found[up].nunique() if up else 1)
    with matplotlib.rc_context({"svg.hashsalt": "teleop-sim", "font.size": 9.0}):
        figure = Figure(figsize=(wide * len(panels), high + 0.5), layout="constrained")
        for axes, (key, rows) in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
            _panel(axes, rows, across, up, colour)
            named = zip(link[:-2], key if isinstance(key, tuple) else (key,), strict=False)
            axes.set_title(", ".join(f"{name} {value}" for name, value in named), fontsize=9)
        unit = " [s]" if measure.kind == "time" else ""
        figure.suptitle(f"Best {choose} by {measure.kind}\nmargin{unit} over the second; pale: not sure", fontsize=9)
        patches = [Patch(facecolor=colour[level], label=level) for level in levels]
        figure.legend(handles=patches, loc="outside lower center", ncols=len(levels), frameon=False)
        figure.savefig(path, dpi=150, metadata={"Date": None} if path.suffix.lower() == ".svg" else {})


def _panel(axes: Axes, rows: pd.DataFrame, across: str, up: str, colour: dict[str, str]) -> None:
    xs = list(dict.fromkeys(rows[across]))
    ys = list(dict.fromkeys(rows[up])) if up else [""]
    for row in rows.to_dict("records"):
        x, y = xs.index(row[across]), ys.index(row[up]) if up else 0
        sure = row["verdict"] == "clear"
        axes.add_patch(_square(x, y, colour[str(row["best"])], 1.0 if sure else UNSURE_ALPHA))
        words = f"{row['best']}\n+{_short(row['margin'])} ± {_short((row['high'] - row['low']) / 2)}"
        axes.text(x, y, words, ha="center", va="center", fontsize=7.5, color="black")
    axes.set(xlim=(-0.5, len(xs) - 0.5), ylim=(-0.5, len(ys) - 0.5), xlabel=across, ylabel=up)
    axes.set_xticks(range(len(xs)), [format_quantity(across, v) for v in xs])
    axes.set_yticks(range(len(ys)), [format_quantity(up, v) for v in ys])
    axes.tick_params(length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _square(x: int, y: int, colour: str, alpha: float) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((x - 0.48, y - 0.46), 0.96, 0.92, facecolor=colour, alpha=alpha, linewidth=0)


def _short(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 10.0 else f"{value:.2g}"
