"""Runs as Fig. 17 of the ViGIR paper draws them: who or what was at work, at which layer of control.

Source: Romay, Kohlbrecher, Stumpf, von Stryk et al., Collaborative Autonomy Between High-level Behaviors and Human
Operators for Remote Manipulation Tasks using Different Humanoid Robots, Fig. 17 and section 6.3, which names the
colours: a behaviour's requests yellow, templates laid light green, answers purple, stepping blue, motions of the body
dark green, behaviours grey, object templates cyan, Cartesian teleoperation red, manual transitions black. Here each has
a row of its own, so that none hides another and nobody needs to tell the colours apart. Added to the paper's rows:
states that a person acted in lieu of, checkpoints of the task, and marks for changes of the level, templates laid anew,
and steps down and up between the layers (``drc_marks.py``).

The picture is a pure function of the records. The time of the manipulation (``drc_times.evaluated``) is white, the rest
shaded.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from teleop_sim.core.records import EpisodeEnded, Layer, OperatorActed, Record, Requested
from teleop_sim.reports.captions import crew, title
from teleop_sim.reports.drc_marks import MARKS, forced, in_lieu, marks
from teleop_sim.reports.drc_times import (
    BY_HAND,
    SENSING,
    STEPPING,
    behaviour_spans,
    evaluated,
    layer_spans,
    request_spans,
)
from teleop_sim.reports.intervals import Interval, union
from teleop_sim.reports.lanes import scores
from teleop_sim.reports.parts import Chart
from teleop_sim.reports.shares import duration_s
from teleop_sim.reports.style import drawn

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS: Mapping[str, str] = {
    "request": "#F2D600",
    "alignment": "lightgreen",
    "answer": "purple",
    "stepping": "royalblue",
    "body motion": "darkgreen",
    "behaviour": "gray",
    "object template": "darkturquoise",
    "teleoperation": "red",
    "in lieu of a state": "darkorange",
    "manual transition": "black",
    "checkpoint": "#009E73",
}
"""Row, from the top, to its colour; yellow and cyan a little darker than the paper's, for white paper."""

SHAPES: Mapping[str, tuple[str, str]] = {
    "level": ("D", "magenta"),
    "anew": ("o", "#00441B"),
    "down": ("v", "black"),
    "up": ("^", "white"),
}
"""Kind of a mark to its shape and colour; the other kinds have rows."""
ROWS_OF_LAYERS = {"template": "object template"}
"""Layer to the row on which its marks stand, where the names differ."""
OUTSIDE = "#EFEFEF"

WIDTH_IN, LEFT_IN, RIGHT_IN = 12.0, 1.3, 0.25
ROW_IN, TITLE_IN, AXIS_IN, LEGEND_IN = 0.16, 0.56, 0.42, 0.28


def has_layers(records: Sequence[Record]) -> bool:
    """Whether the crew worked at layers of control: only then is there something to draw."""
    return any(isinstance(r, Layer) for r in records)


def draw_layers(runs: Sequence[Sequence[Record]], path: Path | str) -> None:
    """Draw ``layers_figure`` into a file for paper.

    Args:
        runs: records of each, without the plant's; at least one run.
        path: of the picture; ``.svg`` or ``.png`` decides what it is.

    Raises:
        ValueError: the path ends otherwise.
        OSError: the picture cannot be written.

    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".svg", ".png"):
        raise ValueError(f"{path}: a timeline is drawn as .svg or .png")
    Path(path).write_bytes(drawn(Chart(lambda: layers_figure(runs), ""), suffix[1:]))


def layers_figure(runs: Sequence[Sequence[Record]]) -> Figure:
    """One run, or several below one another with the time at which each manipulation began in line.

    Args:
        runs: records of each, without the plant's; at least one run.

    """
    from matplotlib.figure import Figure

    zeros_s = [evaluated(run)[0] if len(runs) > 1 else 0.0 for run in runs]
    ends = [(-zero_s, duration_s(run) - zero_s) for run, zero_s in zip(runs, zeros_s, strict=True)]
    limits = (min(start_s for start_s, _ in ends), max(max(end_s for _, end_s in ends), 1e-3))
    panel_in = ROW_IN * len(COLOURS)
    height_in = len(runs) * (panel_in + TITLE_IN) + AXIS_IN + LEGEND_IN
    figure = Figure(figsize=(WIDTH_IN, height_in))
    for i, (run, zero_s) in enumerate(zip(runs, zeros_s, strict=True)):
        below_in = height_in - (i + 1) * (panel_in + TITLE_IN)
        wide = (WIDTH_IN - LEFT_IN - RIGHT_IN) / WIDTH_IN
        box = (LEFT_IN / WIDTH_IN, below_in / height_in, wide, panel_in / height_in)
        _panel(figure.add_axes(box, label=str(i)), run, zero_s, limits, i == len(runs) - 1, len(runs) > 1)
    _legend(figure, height_in)
    return figure


def rows_of(records: Sequence[Record]) -> dict[str, list[Interval]]:
    """Each row of the picture, in the order of ``COLOURS``: when it was at work [s]. A transition takes no time."""
    episodes = [r for r in records if isinstance(r, EpisodeEnded)]
    still = STEPPING | SENSING
    return {
        "request": request_spans(records, by_hand=False),
        "alignment": layer_spans(records, "alignment"),
        "answer": _answered(records),
        "stepping": union((r.start_s, r.t_s) for r in episodes if r.skill in STEPPING),
        "body motion": union((r.start_s, r.t_s) for r in episodes if r.skill not in still),
        "behaviour": behaviour_spans(records),
        "object template": layer_spans(records, "template"),
        "teleoperation": layer_spans(records, "teleoperation"),
        "in lieu of a state": in_lieu(records),
        "manual transition": [(t_s, t_s) for t_s in forced(records)],
        "checkpoint": [(t_s, t_s) for t_s, _, new in scores(records) if new],
    }


def _answered(records: Sequence[Record]) -> list[Interval]:
    """When somebody entered the answer to such a request."""
    asked = {r.request for r in records if isinstance(r, Requested) and r.kind not in BY_HAND}
    acts = (r for r in records if isinstance(r, OperatorActed) and r.kind == "send" and r.request in asked)
    return union((r.start_s, r.t_s) for r in acts)


def _panel(ax: Axes, records: Sequence[Record], zero_s: float, limits: Interval, last: bool, zeroed: bool) -> None:
    from matplotlib.ticker import FuncFormatter, MultipleLocator

    ax.set_xlim(*limits)
    ax.set_ylim(len(COLOURS), 0.0)
    ax.xaxis.set_major_locator(MultipleLocator(_tick_s(limits[1] - limits[0])))
    ax.xaxis.set_major_formatter(FuncFormatter(_minutes))
    ax.grid(axis="x", color="#E4E4E4", linewidth=0.6)
    ax.set_axisbelow(True)
    ax.set_yticks([row + 0.5 for row in range(len(COLOURS))], list(COLOURS), fontsize=6.5)
    ax.tick_params(axis="y", length=0)
    ax.tick_params(axis="x", length=3 if last else 0, labelbottom=last)
    for spine in ax.spines.values():
        spine.set_color("#BBBBBB")
    start_s, end_s = evaluated(records)
    for shaded in ((limits[0], start_s - zero_s), (end_s - zero_s, limits[1])):
        if shaded[1] > shaded[0]:
            ax.axvspan(*shaded, facecolor=OUTSIDE, linewidth=0.0, zorder=0.2)
    for row, (name, spans) in enumerate(rows_of(records).items()):
        shifted = [(a - zero_s, b - zero_s) for a, b in spans]
        if name == "checkpoint":
            _stars(ax, row, [t_s for t_s, _ in shifted])
        else:
            _bars(ax, row, shifted, COLOURS[name])
    _marks(ax, records, zero_s)
    ax.set_title(title(records), loc="left", fontsize=8.5, pad=14, parse_math=False)
    ax.annotate(crew(records), (0, 1), (0, 4), "axes fraction", "offset points", fontsize=7.0, color="#555555",
                parse_math=False)  # fmt: skip
    if last:
        ax.set_xlabel("simulated time [min:s]" + (", from when the robot stood there" if zeroed else ""))


def _bars(ax: Axes, row: int, spans: Sequence[Interval], colour: str) -> None:
    """Bars, and ticks for what takes no time; a hair of edge keeps the shortest visible."""
    wide = [(a, b - a) for a, b in spans if b > a]
    ax.broken_barh(wide, (row + 0.1, 0.8), facecolor=colour, edgecolor=colour, linewidth=0.5)
    ticks = [a for a, b in spans if b == a]
    ax.vlines(ticks, row + 0.1, row + 0.9, colors=colour, linewidth=1.6)


def _stars(ax: Axes, row: int, times_s: Sequence[float]) -> None:
    colour = COLOURS["checkpoint"]
    for t_s in times_s:
        ax.axvline(t_s, color=colour, linewidth=0.8, linestyle=(0, (2, 2)), zorder=0.6)
    ax.plot(times_s, [row + 0.5] * len(times_s), "*", color=colour, markersize=7, mew=0.0, clip_on=False)


def _marks(ax: Axes, records: Sequence[Record], zero_s: float) -> None:
    names = list(COLOURS)
    for mark in marks(records):
        if mark.kind in SHAPES:
            row = names.index(ROWS_OF_LAYERS.get(mark.layer, mark.layer))
            shape, colour = SHAPES[mark.kind]
            ax.plot([mark.t_s - zero_s], [row + 0.5], clip_on=False, zorder=5.0, **_style(shape, colour))


def _style(shape: str, colour: str) -> dict[str, Any]:
    edge = "black" if colour == "white" else "white"
    return {"marker": shape, "color": colour, "mec": edge, "mew": 0.6, "markersize": 6.0, "linestyle": ""}


def _legend(figure: Figure, height_in: float) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Artist] = [Line2D([], [], label=MARKS[kind], **_style(*look)) for kind, look in SHAPES.items()]
    handles.append(
        Patch(
            facecolor=OUTSIDE,
            edgecolor="#BBBBBB",
            linewidth=0.5,
            label="before the robot stood there; after the last checkpoint",
        )
    )
    figure.legend(
        handles=handles,
        ncols=len(handles),
        loc="center left",
        bbox_to_anchor=(LEFT_IN / WIDTH_IN, LEGEND_IN / 2 / height_in),
        frameon=False,
        borderpad=0.0,
        borderaxespad=0.0,
        handlelength=1.2,
        handleheight=0.8,
        columnspacing=1.8,
        fontsize=7.5,
    )


def _tick_s(span_s: float) -> float:
    steps: tuple[float, ...] = (1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1200, 3600)
    return next((step for step in steps if span_s / step <= 20), span_s / 10)


def _minutes(t_s: float, _place: float) -> str:
    whole = round(abs(t_s))
    return f"{'-' if t_s < 0 else ''}{whole // 60}:{whole % 60:02d}"
