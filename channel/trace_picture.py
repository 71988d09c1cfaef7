"""A trace as a picture: a bar a message, from when it was sent to when it arrived, in pieces that say why it waited."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from teleop_sim.channel.blackouts import Schedule
from teleop_sim.channel.trace import TraceRow

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WAITS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "queue_s": ("others ahead", "#bbbbbb"),
        "blackout_s": ("dark", "#333333"),
        "retransmission_s": ("sent in vain", "#cc3311"),
        "serialisation_s": ("going out", "#ee7733"),
        "propagation_s": ("on its way", "#0077bb"),
    }
)
"""Field of a row to its words and colour (Paul Tol's scheme for the colour-blind). Not the order within the wait."""

SUFFIXES = (".svg", ".png")
WIDTH_IN, ROW_IN, LABELS_MAX, HEIGHT_MAX_IN = 10.0, 0.2, 60, 14.0


def draw_trace(rows: Sequence[TraceRow], path: Path | str, title: str, blackouts: Schedule = ()) -> None:
    """Draw a trace. The same rows give the same bytes.

    The lengths of the pieces are the waits of the row; where a message waited twice for one reason (dark, light, dark)
    its pieces are put together.

    Args:
        rows: of ``trace``.
        path: of the picture; ``.svg`` or ``.png`` decides what it is.
        title: stands above it.
        blackouts: shaded behind the bars.

    Raises:
        ValueError: the path ends otherwise.
        OSError: the picture cannot be written.

    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"{path}: a trace is drawn as .svg or .png")
    import matplotlib as mpl

    with mpl.rc_context({"svg.hashsalt": "teleop-sim", "font.size": 8.0, "font.family": "DejaVu Sans"}):
        figure = _figure(rows, title, blackouts)
        figure.savefig(path, format=suffix[1:], dpi=130, metadata={"Date": None} if suffix == ".svg" else None)


def _figure(rows: Sequence[TraceRow], title: str, blackouts: Schedule) -> Figure:
    from matplotlib.figure import Figure

    height_in = min(HEIGHT_MAX_IN, 1.3 + ROW_IN * max(5, len(rows)))
    figure = Figure(figsize=(WIDTH_IN, height_in), layout="constrained")
    ax = figure.add_subplot()
    _bars(ax, rows)
    _ends(ax, rows)
    ax.set_title(title, loc="left", parse_math=False)
    ax.set_xlabel("time [s]")
    ax.set_ylim(max(len(rows), 1) - 0.4, -0.6)
    end_s = 1.05 * max([_end_s(row) for row in rows], default=1.0) or 1.0
    ax.set_xlim(0.0, end_s)
    for start_s, stop_s in blackouts:
        if start_s < end_s:
            ax.axvspan(start_s, min(stop_s, end_s), color="#eeeeee", linewidth=0.0, zorder=0.0)
    if len(rows) <= LABELS_MAX:
        ax.set_yticks(range(len(rows)), [f"{_short(row.topic)}  {row.bytes} B  {row.id}" for row in rows])
        for label in ax.get_yticklabels():
            label.set_parse_math(False)
    else:
        ax.set_ylabel("message")
    ax.tick_params(axis="y", length=0.0)
    ax.spines[["top", "right", "left"]].set_visible(False)
    ax.grid(axis="x", color="#dddddd", linewidth=0.6)
    ax.set_axisbelow(True)
    figure.legend(loc="outside lower left", ncols=len(WAITS) + 2, frameon=False, handlelength=1.2)
    return figure


def _bars(ax: Axes, rows: Sequence[TraceRow]) -> None:
    left_s = [row.sent_s for row in rows]
    for name, (words, colour) in WAITS.items():
        widths_s = [max(0.0, getattr(row, name)) for row in rows]
        right_s = [left + width for left, width in zip(left_s, widths_s, strict=True)]
        if len(rows) <= LABELS_MAX:
            ax.barh(range(len(rows)), widths_s, left=left_s, height=0.7, color=colour, label=words)
        else:
            # One area for all: a bar each would take minutes for a hundred thousand.
            ax.fill_betweenx(range(len(rows)), left_s, right_s, step="mid", color=colour, linewidth=0.0, label=words)
        left_s = right_s


def _ends(ax: Axes, rows: Sequence[TraceRow]) -> None:
    """A dot where it arrives, a cross and the reason where it is lost, a triangle where it was still on its way."""
    few = len(rows) <= LABELS_MAX
    styles = {"delivered": ("o", "#0077bb"), "dropped": ("X", "#cc3311"), "in_flight": (">", "#777777")}
    for outcome, (marker, colour) in styles.items():
        ends = [(_end_s(row), i) for i, row in enumerate(rows) if row.outcome == outcome]
        if ends:
            x, y = zip(*ends, strict=True)
            words = "arrived" if outcome == "delivered" else outcome.replace("_", " ")
            size, edge = (4.5, 0.5) if few else (1.5 if outcome == "delivered" else 3.5, 0.0)
            ax.plot(x, y, marker, color=colour, ms=size, mec="white", mew=edge, label=words, clip_on=False, zorder=4)
    if few:
        for i, row in enumerate(rows):
            if row.reason:
                at = (_end_s(row), i)
                ax.annotate(row.reason.replace("_", " "), at, (6, 0), textcoords="offset points", va="center")


def _end_s(row: TraceRow) -> float:
    waits_s = row.queue_s + row.blackout_s + row.serialisation_s + row.propagation_s + row.retransmission_s
    return row.sent_s + waits_s if row.arrived_s is None else row.arrived_s


def _short(topic: str) -> str:
    return topic if len(topic) <= 24 else f"{topic[:21]}..."
