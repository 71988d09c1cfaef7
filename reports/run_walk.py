"""Map of the walk: where the pelvis and the feet were, and what stood there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from teleop_sim.core.records import EpisodeEnded, PlantNames, PlantSample
from teleop_sim.reports.feet import Print, description_of, prints, soles
from teleop_sim.reports.parts import Chart
from teleop_sim.reports.run_view import Run
from teleop_sim.reports.style import COLOURS
from teleop_sim.reports.walk_things import Thing, corners, things

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH_IN, FONT_PT = 6.4, 9.0
LEAST_IN, MOST_IN = 2.0, 7.0
"""Height of the map (a choice of layout)."""
AROUND_M, PIECE_M = 0.5, 0.03
"""Room round all that is shown; least length of a piece of the pelvis' line (a choice of layout)."""
TIME_COLOURS = (COLOURS[4], COLOURS[5], COLOURS[3])
"""From the start of the run to its end; each shows on white and on black."""
FOOT_COLOURS = {"left": COLOURS[0], "right": COLOURS[2]}
GREY, GROUND = "#888888", "#efefef"
"""Pages have colours of their own in place of these (``style.NEUTRALS``)."""
LOOKS: Mapping[str, Mapping[str, Any]] = {
    "ground": {"facecolor": GROUND, "linewidth": 0.0},
    "square": {"facecolor": GROUND, "linewidth": 0.0},
    "plate": {"facecolor": GREY, "alpha": 0.35, "linewidth": 0.0},
    "checkpoint": {"fill": False, "edgecolor": GREY, "linewidth": 0.9, "linestyle": (0, (3, 2))},
    "clutter": {"facecolor": "#bbbbbb", "linewidth": 0.0},
    "drum_red": {"facecolor": COLOURS[3], "linewidth": 0.0},
    "drum_blue": {"facecolor": COLOURS[0], "linewidth": 0.0},
    "wheel": {"facecolor": COLOURS[1], "edgecolor": COLOURS[1], "linewidth": 2.0},
    "door": {"edgecolor": COLOURS[1], "linewidth": 3.0},
    "shut": {"edgecolor": GREY, "linewidth": 1.5, "linestyle": (0, (2, 2))},
    "pipe": {"edgecolor": GREY, "linewidth": 3.0},
}
"""Kind of a thing to how its outline is drawn; others are points."""


@dataclass(frozen=True)
class _Walk:
    """Times (n,) [s], pelvis (n, 7), prints, size of a sole [m], what stands there, and where it fell."""

    t_s: np.ndarray
    pelvis: np.ndarray
    prints: list[Print]
    sole_m: tuple[float, float]
    things: list[Thing]
    fell: bool


def walk_chart(run: Run) -> Chart | None:
    """The map; None where the log has no samples of the plant."""
    walk = _walk(run)
    if walk is None:
        return None
    way_m = float(np.hypot(*np.diff(walk.pelvis[:, :2], axis=0).T).sum())
    steps = len(walk.prints)
    alt = f"Map of the walk: the pelvis went {way_m:.1f} m, the feet left {steps} prints"
    note = (
        "From above. Line: the pelvis, coloured by time. Outlines: where a foot stood; filled: in the end. "
        "A foot is where the legs' joints say; what stands there is drawn anew from the scenario's seed."
    )
    return Chart(lambda: _figure(walk), alt + (", and it fell." if walk.fell else "."), note)


def _walk(run: Run) -> _Walk | None:
    samples = [r for r in run.log.records("field/plant") if isinstance(r, PlantSample)]
    if not samples:
        return None
    t_s, pelvis = np.array([r.t_s for r in samples]), np.array([r.pelvis for r in samples])
    names = [n for r in run.records if isinstance(r, PlantNames) for n in r.joints.split()]
    values = np.array([r.joints for r in samples])
    joints = dict(zip(names, values.T, strict=False))
    body = description_of(str(run.scenario.get("robot", "valkyrie")))
    found = prints(t_s, soles(body, pelvis, joints)) if body else []
    last = {name: float(column[-1]) for name, column in joints.items()}
    sole_m = body.sole.size_m[:2] if body else (0.0, 0.0)
    fell = any(isinstance(r, EpisodeEnded) and r.outcome == "fell" for r in run.records)
    return _Walk(t_s, pelvis, found, sole_m, things(run, last), fell)


def _figure(walk: _Walk) -> Figure:
    from matplotlib.collections import LineCollection
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure

    low, high = _frame_of(walk)
    wide_m, high_m = high - low
    height_in = float(np.clip((WIDTH_IN - 1.6) * high_m / wide_m, LEAST_IN, MOST_IN))
    figure = Figure(figsize=(WIDTH_IN, height_in + 1.0), layout="constrained")
    ax = figure.add_subplot()
    for thing in walk.things:
        _draw_thing(ax, thing)
    _draw_prints(ax, walk)
    kept = _far_apart(walk.pelvis[:, :2])
    points, t_s = walk.pelvis[kept, None, :2], walk.t_s[kept]
    colours = LinearSegmentedColormap.from_list("time", TIME_COLOURS)
    pieces = list(np.concatenate([points[:-1], points[1:]], axis=1))
    lines = LineCollection(pieces, cmap=colours, linewidths=1.8, zorder=4.0)
    lines.set_array(0.5 * (t_s[:-1] + t_s[1:]))
    lines.set_clim(0.0, max(float(walk.t_s[-1]), 1e-3))
    ax.add_collection(lines)
    bar = figure.colorbar(lines, ax=ax, shrink=0.8, pad=0.02)
    bar.set_label("time [s]", fontsize=FONT_PT)
    bar.ax.tick_params(labelsize=FONT_PT)
    bar.outline.set_visible(False)
    _draw_ends(ax, walk)
    ax.set_aspect("equal")
    ax.set_xlim(low[0], high[0])
    ax.set_ylim(low[1], high[1])
    ax.set_xlabel("x [m]", fontsize=FONT_PT)
    ax.set_ylabel("y [m]", fontsize=FONT_PT)
    ax.tick_params(labelsize=FONT_PT)
    ax.spines[["top", "right"]].set_visible(False)
    _legend(figure, walk)
    return figure


def _far_apart(points: np.ndarray) -> list[int]:
    """Numbers of points with no less than ``PIECE_M`` from one to the next, the first and the last among them."""
    kept = [0]
    for i in range(1, len(points)):
        if np.hypot(*(points[i] - points[kept[-1]])) >= PIECE_M:
            kept.append(i)
    return [*kept, len(points) - 1] if kept[-1] != len(points) - 1 else kept


def _frame_of(walk: _Walk) -> tuple[np.ndarray, np.ndarray]:
    """Lower left and upper right corner of the map [m]: the walk and what it led to, with room for the feet."""
    near = [p for thing in walk.things if thing.kind not in ("ground", "clutter") for p in thing.outline]
    points = np.concatenate([walk.pelvis[:, :2], *([np.array(near)] if near else [])])
    low, high = points.min(axis=0) - AROUND_M, points.max(axis=0) + AROUND_M
    return low, high


def _draw_thing(ax: Axes, thing: Thing) -> None:
    from matplotlib.patches import Polygon

    look = LOOKS.get(thing.kind)
    middle = np.mean(np.array(thing.outline), axis=0)
    if look is not None:
        closed = len(thing.outline) > 2
        ax.add_patch(Polygon(np.array(thing.outline), closed=closed, zorder=1.0, **{"fill": closed, **look}))
    elif thing.kind != "name":
        ax.plot(*middle, "o", color=COLOURS[1], markersize=6, zorder=1.0)
    if thing.name:
        place, shift = middle, (6, 6)
        if thing.kind == "square":
            # Towards its upper left corner: the middle is walked on.
            corner = np.array(max(thing.outline, key=lambda p: p[1] - p[0]))
            place, shift = middle + 0.7 * (corner - middle), (-10, -4)
        ax.annotate(thing.name, tuple(place), shift, textcoords="offset points", fontsize=FONT_PT, zorder=5.0)


def _draw_prints(ax: Axes, walk: _Walk) -> None:
    from matplotlib.patches import Polygon

    last = {p.side: i for i, p in enumerate(walk.prints)}
    for i, p in enumerate(walk.prints):
        box = np.array(corners(p.x_m, p.y_m, p.yaw_rad, 0.5 * walk.sole_m[0], 0.5 * walk.sole_m[1]))
        colour = FOOT_COLOURS[p.side]
        filled = last[p.side] == i
        ax.add_patch(
            Polygon(box, facecolor=colour if filled else "none", edgecolor=colour, linewidth=0.8, zorder=3.0)
        )  # fmt: skip


def _draw_ends(ax: Axes, walk: _Walk) -> None:
    (x0, y0), (x1, y1) = walk.pelvis[0, :2], walk.pelvis[-1, :2]
    ax.plot(x0, y0, "o", color=TIME_COLOURS[0], markersize=6, zorder=5.0)
    ax.plot(x1, y1, "X" if walk.fell else "s", color=TIME_COLOURS[-1], markersize=9 if walk.fell else 6, zorder=5.0)


def _legend(figure: Figure, walk: _Walk) -> None:
    from matplotlib.artist import Artist
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Artist] = [
        Patch(facecolor="none", edgecolor=colour, label=f"{side} foot")
        for side, colour in FOOT_COLOURS.items()
        if any(p.side == side for p in walk.prints)
    ]
    end = ("X", "fell") if walk.fell else ("s", "end")
    for (marker, words), colour in ((("o", "start"), TIME_COLOURS[0]), (end, TIME_COLOURS[-1])):
        handles.append(Line2D([], [], marker=marker, color=colour, linestyle="", label=words))
    figure.legend(
        handles=handles, loc="outside upper left", ncols=len(handles), frameon=False, fontsize=FONT_PT,
        handlelength=1.0, columnspacing=1.4,
    )  # fmt: skip
