"""One run as a picture: rows of activity over simulated time.

Modelled on Fig. 17 of Romay, Kohlbrecher, Stumpf, von Stryk et al., Collaborative Autonomy Between High-level Behaviors
and Human Operators for Remote Manipulation Tasks using Different Humanoid Robots: who was active when.
Added here: one row a state of the machine, and the packets in both directions of the link.

Colours are Okabe and Ito's, told apart by people with any common colour blindness (https://jfly.uni-koeln.de/color/).
The picture is a pure function of the log.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from teleop_sim.core.records import Record, Scored
from teleop_sim.reports import lanes
from teleop_sim.reports.captions import settings, title
from teleop_sim.reports.intervals import Interval
from teleop_sim.reports.shares import duration_s

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BLUE, SKY, GREEN, ORANGE, RED, PINK, YELLOW = (
    "#0072B2",
    "#56B4E9",
    "#009E73",
    "#E69F00",
    "#D55E00",
    "#CC79A7",
    "#F0E442",
)
MODES = {"normal": BLUE, "auto": ORANGE, "manual": RED, "not_recoverable": "#000000"}
MODE_WORDS = {"auto": "autonomous recovery", "not_recoverable": "not recoverable"}
SKILLS = {"walk": BLUE, "see": SKY, "hand": ORANGE, "follow": GREEN, "posture": "#999999", "other": YELLOW}
SKILL_WORDS = {
    "walk": "walk, step",
    "see": "look, scan, detect",
    "hand": "reach, grip, release, nudge",
    "follow": "follow (turn a handle)",
}
WAITS = {"pacing": "#AAAAAA", "for an answer": PINK}
ACTS = {"read": SKY, "decide": BLUE, "send": GREEN}
OTHER_ACTS = (ORANGE, PINK, RED, YELLOW)
AXIS_WORDS = "an axis came into or out of tolerance"
MARKERS = {"dropped": "x", AXIS_WORDS: "|"}
SENDING, FLYING, QUEUEING, DARK = "#0B3C5D", "#8FC3E8", "#F3E39B", "#C8C8C8"

WIDTH_IN, LEFT_IN, RIGHT_IN, TOP_IN, GAP_IN = 14.0, 2.5, 0.3, 0.72, 0.07
AXIS_IN, LEGEND_ROW_IN, STATE_IN, LANE_IN = 0.55, 0.23, 0.19, 0.3
LETTER_IN = 0.06
"""Of a state's name: 7 points of DejaVu Sans, whose letters are some 0.055 inch wide, and room for wide ones."""


@dataclass(frozen=True)
class Lane:
    """One row of the picture: its name, its height [inch], what draws it, and its legend."""

    name: str
    height_in: float
    draw: Callable[[Axes], None]
    legend: Mapping[str, str]


def timeline_figure(records: Sequence[Record]) -> Figure:
    """A run, cut off or interrupted perhaps: the title says so. Drawn in the style that is in force (``style.py``)."""
    from matplotlib.figure import Figure

    rows = _lanes(records)
    legends = [lane for lane in rows if lane.legend]
    heights_in = sum(lane.height_in + GAP_IN for lane in rows)
    height_in = TOP_IN + heights_in + AXIS_IN + LEGEND_ROW_IN * len(legends)
    figure = Figure(figsize=(WIDTH_IN, height_in))
    left_in = max(LEFT_IN, max(map(len, lanes.shown_names(lanes.state_bars(records)[0])), default=0) * LETTER_IN)
    end_s = max(duration_s(records), 1e-3)
    top_in = height_in - TOP_IN
    for lane in rows:
        box = (left_in, top_in - lane.height_in, WIDTH_IN - left_in - RIGHT_IN, lane.height_in)
        ax = figure.add_axes(
            (box[0] / WIDTH_IN, box[1] / height_in, box[2] / WIDTH_IN, box[3] / height_in), label=lane.name
        )
        _frame(ax, lane.name, end_s, last=lane is rows[-1])
        _checkpoint_lines(ax, records)
        lane.draw(ax)
        top_in = box[1] - GAP_IN
    for i, lane in enumerate(legends):
        _legend(figure, lane, left_in, (len(legends) - i - 0.5) * LEGEND_ROW_IN / height_in)
    head = title(records)
    at = left_in / WIDTH_IN
    figure.text(at, 1.0 - 0.12 / height_in, head, va="top", fontsize=10.0, parse_math=False)
    below_in = 0.12 + 0.18 * (head.count("\n") + 1)
    words = settings(records)
    figure.text(at, 1.0 - below_in / height_in, words, va="top", fontsize=8.0, color="#555555", parse_math=False)
    return figure


def _lanes(records: Sequence[Record]) -> list[Lane]:
    names, states = lanes.state_bars(records)
    robot, acts = lanes.robot_bars(records), lanes.act_bars(records)
    kinds = sorted({bar.kind for bar in acts})
    others = [kind for kind in kinds if kind not in ACTS]
    # The same colour in every picture, so that pictures can be laid side by side.
    act_colours = {kind: colour for kind, colour in ACTS.items() if kind in kinds}
    act_colours |= {kind: OTHER_ACTS[i % len(OTHER_ACTS)] for i, kind in enumerate(others)}
    used = {bar.kind for bar in states}
    modes = {MODE_WORDS.get(m, m): colour for m, colour in MODES.items() if m in used}
    skills = {SKILL_WORDS.get(s, s): colour for s, colour in SKILLS.items() if any(b.kind == s for b in robot)}
    link = {
        "queueing or dark": QUEUEING,
        "being sent": SENDING,
        "travelling": FLYING,
        "dropped": RED,
        "blackout": DARK,
    }
    return [
        Lane("checkpoints", 0.24, lambda ax: _draw_scores(ax, records), _score_words(records)),
        Lane(
            "machine",
            max(STATE_IN * len(names), LANE_IN),
            lambda ax: _draw_states(ax, names, states),
            modes or {"no state": "#FFFFFF"},
        ),
        Lane("robot", LANE_IN, lambda ax: _draw_bars(ax, robot, SKILLS), skills),
        Lane("waits", 2 * STATE_IN, lambda ax: _draw_bars(ax, lanes.wait_bars(records), WAITS, rows=2), WAITS),
        Lane("operator", LANE_IN, lambda ax: _draw_bars(ax, acts, act_colours), act_colours),
        _link_lane("uplink", records, {}),
        _link_lane("downlink", records, link),
    ]


def _score_words(records: Sequence[Record]) -> dict[str, str]:
    found = [r for r in records if isinstance(r, Scored)]
    news = [new for _, _, new in lanes.scores(records)]
    passed = {r.checkpoint: r.text for r, new in zip(found, news, strict=True) if new}
    words = {f"{n} {text.partition(': ')[2] or text}": GREEN for n, text in sorted(passed.items())}
    return {**words, **({AXIS_WORDS: "#888888"} if not all(news) else {})}


def _link_lane(name: str, records: Sequence[Record], legend: Mapping[str, str]) -> Lane:
    direction = name.removesuffix("link")
    packets, dark = lanes.packets(records, direction), lanes.dark(records, direction)
    rows = max((p.row for p in packets), default=0) + 1
    height_in = min(max(0.07 * rows, 0.36), 1.5) + (0.16 if dark else 0.0)
    end_s = duration_s(records)
    return Lane(name, height_in, lambda ax: _draw_packets(ax, packets, rows, dark, end_s, height_in), legend)


def _frame(ax: Axes, name: str, end_s: float, last: bool) -> None:
    from matplotlib.ticker import MaxNLocator

    ax.set_xlim(0.0, end_s)
    ax.set_yticks([])
    ax.xaxis.set_major_locator(MaxNLocator(nbins=16, steps=[1, 2, 3, 5, 6, 10]))
    ax.grid(axis="x", color="#E4E4E4", linewidth=0.6)
    ax.set_axisbelow(True)
    ax.tick_params(axis="x", length=3 if last else 0, labelbottom=last)
    for spine in ax.spines.values():
        spine.set_color("#BBBBBB")
    if last:
        ax.set_xlabel("simulated time [s]")
    if name != "machine":
        ax.set_ylabel(name, rotation=0, ha="right", va="center", labelpad=8)


def _draw_bars(ax: Axes, bars: Sequence[lanes.Bar], colours: Mapping[str, str], rows: int = 1) -> None:
    """Bars in rows from the top; a hair of edge keeps the shortest visible."""
    ax.set_ylim(rows, 0.0)
    for kind in sorted({bar.kind for bar in bars}):
        colour = colours.get(kind, "#999999")
        for row in range(rows):
            spans = [(b.start_s, b.end_s - b.start_s) for b in bars if b.kind == kind and b.row == row]
            ax.broken_barh(spans, (row + 0.14, 0.72), facecolor=colour, edgecolor=colour, linewidth=0.4)


def _draw_states(ax: Axes, names: Sequence[str], bars: Sequence[lanes.Bar]) -> None:
    rows = max(len(names), 1)
    for row in range(0, rows, 2):
        ax.axhspan(row, row + 1, color="#F6F6F6", zorder=0.1)
    _draw_bars(ax, bars, MODES, rows)
    ax.set_yticks([row + 0.5 for row in range(len(names))])
    ax.set_yticklabels(lanes.shown_names(names), fontsize=7.0, parse_math=False)
    ax.tick_params(axis="y", length=0)
    # Between the attempts of one visit, where there is room for a gap.
    least_s = 0.004 * (ax.get_xlim()[1])
    wide = {(b.row, b.start_s) for b in bars if b.end_s - b.start_s > least_s}
    seams = [(b.end_s, b.row) for b in bars if b.end_s - b.start_s > least_s and (b.row, b.end_s) in wide]
    ax.vlines([s[0] for s in seams], [s[1] for s in seams], [s[1] + 1 for s in seams], colors="white", linewidth=1.0)


def _draw_scores(ax: Axes, records: Sequence[Record]) -> None:
    ax.set_ylim(0.0, 1.0)
    marks = lanes.scores(records)
    seen = [t_s for t_s, _, passed in marks if not passed]
    ax.plot(seen, [0.5] * len(seen), "|", color="#888888", markersize=6)
    end_s = ax.get_xlim()[1]
    least_s = 0.022 * end_s
    passed = [(t_s, checkpoint) for t_s, checkpoint, new in marks if new]
    for i, (t_s, checkpoint) in enumerate(passed):
        ax.plot([t_s], [0.5], "*", color=GREEN, markersize=9, clip_on=False)
        # Numbers step aside for one another: right of the star, left of it when the right is taken or cut off.
        right = t_s <= end_s - least_s and (i + 1 == len(passed) or passed[i + 1][0] - t_s >= least_s)
        if right or i == 0 or t_s - passed[i - 1][0] >= least_s:
            ax.annotate(
                str(checkpoint),
                (t_s, 0.5),
                xytext=(6 if right else -6, 0),
                textcoords="offset points",
                ha="left" if right else "right",
                va="center",
                fontsize=7.5,
                weight="bold",
            )


def _checkpoint_lines(ax: Axes, records: Sequence[Record]) -> None:
    for t_s, _, passed in lanes.scores(records):
        if passed:
            ax.axvline(t_s, color=GREEN, linewidth=0.9, linestyle=(0, (2, 2)), zorder=0.6)


def _draw_packets(
    ax: Axes, packets: Sequence[lanes.Packet], rows: int, dark: Sequence[Interval], end_s: float, height_in: float
) -> None:
    head = rows * 0.16 / (height_in - 0.16) if dark else 0.0
    ax.set_ylim(rows, -head)
    for colour, spans in (
        (QUEUEING, [(p.sent_s, (p.end_s if math.isnan(p.service_s) else p.service_s), p.row) for p in packets]),
        (FLYING, [(p.out_s, p.end_s, p.row) for p in packets if not math.isnan(p.out_s)]),
        (SENDING, [(p.service_s, p.out_s, p.row) for p in packets if not math.isnan(p.out_s)]),
    ):
        for row in sorted({span[2] for span in spans}):
            stretches = [(a, b - a) for a, b, at in spans if at == row and b > a]
            width = 0.5 if colour == SENDING else 0.0
            ax.broken_barh(stretches, (row + 0.12, 0.76), facecolor=colour, edgecolor=colour, linewidth=width)
    lost = [p for p in packets if p.dropped]
    ax.plot([p.end_s for p in lost], [p.row + 0.5 for p in lost], "x", color=RED, markersize=5, mew=1.3, clip_on=False)
    for start_s, stop_s in dark:
        ax.axvspan(start_s, stop_s, facecolor=DARK, linewidth=0.0, zorder=0.7)
        # 7 points of DejaVu Sans are some 0.055 inch a letter: a label goes where it fits.
        room = (stop_s - start_s) / max(end_s, 1e-3) * (WIDTH_IN - LEFT_IN - RIGHT_IN) / 0.055
        took = f"{stop_s - start_s:.0f} s"
        text = next((words for words in (f"blackout {took}", took) if len(words) < room), "")
        ax.text((start_s + stop_s) / 2, -head / 2, text, ha="center", va="center", fontsize=7.0, zorder=4.0)


def _legend(figure: Figure, lane: Lane, left_in: float, y: float) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    name = "link" if lane.name == "downlink" else lane.name
    figure.text((left_in - 0.1) / WIDTH_IN, y, name, ha="right", va="center", color="#555555")
    handles: list[Artist] = [
        Line2D([], [], color=colour, marker=MARKERS.get(words, "*"), linestyle="", mew=1.3, label=words)
        if words in MARKERS or lane.name == "checkpoints"
        else Patch(color=colour, label=words)
        for words, colour in lane.legend.items()
    ]
    figure.legend(
        handles=handles,
        ncols=len(handles),
        loc="center left",
        bbox_to_anchor=(left_in / WIDTH_IN, y),
        frameon=False,
        borderpad=0.0,
        borderaxespad=0.0,
        handlelength=1.2,
        handleheight=0.8,
        columnspacing=1.6,
    )
