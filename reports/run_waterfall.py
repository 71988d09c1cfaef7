"""Where the time went: a waterfall of its causes, and the same as a table. The causes are those of ``waterfall.py``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teleop_sim.reports.parts import Chart, Column, Sheet
from teleop_sim.reports.run_view import Run
from teleop_sim.reports.shares import SHARES
from teleop_sim.reports.style import COLOURS
from teleop_sim.reports.waterfall import CAUSES, time_by_cause

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GROUP_COLOURS = dict(zip(SHARES, (COLOURS[0], "#999999", COLOURS[5], COLOURS[1], COLOURS[4]), strict=True))
"""Group of causes to its colour: the robot blue, the link pink, people orange."""
_GREY = "#888888"
WIDTH_IN, ROW_IN, AROUND_IN = 6.4, 0.22, 0.75
FONT_PT = 9.0
LEAST_SHARE = 1e-3
"""Of the run: lesser causes share a bar (a choice of layout)."""

_NOTE = (
    "Every instant counts once: for the robot's motion, else a fixed wait, else, while the robot waits for an answer, "
    "the link if a command or request was on its way, else people. The parts add up to the nanosecond."
)


def waterfall_chart(run: Run) -> Chart | None:
    """A bar a cause, each beginning where the one above it ends; None for a run that took no time."""
    shown = _shown(run)
    if not shown:
        return None
    words = ", ".join(f"{CAUSES[key].words} {time_ns / 1e9:.0f} s" for key, time_ns in _longest(shown))
    return Chart(lambda: _figure(shown), f"Waterfall of a run of {run.end_s:.0f} s: {words}.", _NOTE)


def waterfall_sheet(run: Run) -> Sheet | None:
    """A row a cause that took any time, and its group's share; None for a run that took no time."""
    shown = _shown(run)
    total_ns = sum(shown.values())
    if not total_ns:
        return None
    columns = (
        Column("group", "", help="what kind of cause"),
        Column("cause", "cause"),
        Column("time_s", "time [s]", 1, help="whole nanoseconds"),
        Column("share_pct", "share [%]", 1, help="of the run"),
    )
    rows = tuple(
        (SHARES[CAUSES[key].group], CAUSES[key].words, time_ns / 1e9, 100.0 * time_ns / total_ns)
        for key, time_ns in shown.items()
    )
    return Sheet(columns, rows, ("all", "", total_ns / 1e9, 100.0), _NOTE)


def _shown(run: Run) -> dict[str, int]:
    return {key: time_ns for key, time_ns in time_by_cause(run.records).items() if time_ns}


def _bars(shown: dict[str, int]) -> list[tuple[str, str, int]]:
    """Words, colour and time [ns] of each bar; together they are the run."""
    total_ns = sum(shown.values())
    wide = {key: time_ns for key, time_ns in shown.items() if time_ns >= LEAST_SHARE * total_ns}
    bars = [(CAUSES[key].words, GROUP_COLOURS[CAUSES[key].group], time_ns) for key, time_ns in wide.items()]
    left = len(shown) - len(wide)
    rest = [(f"{left} lesser cause{'s' if left > 1 else ''}", _GREY, total_ns - sum(wide.values()))] if left else []
    return [*bars, *rest]


def _longest(shown: dict[str, int]) -> list[tuple[str, int]]:
    return sorted(shown.items(), key=lambda item: -item[1])[:4]


def _figure(shown: dict[str, int]) -> Figure:
    from matplotlib.figure import Figure

    bars, total_ns = _bars(shown), sum(shown.values())
    figure = Figure(figsize=(WIDTH_IN, ROW_IN * (len(bars) + 1) + AROUND_IN), layout="constrained")
    ax = figure.add_subplot()
    at_ns = 0
    for row, (_, colour, time_ns) in enumerate(bars):
        ax.barh(row, time_ns / 1e9, left=at_ns / 1e9, height=0.74, color=colour, linewidth=0.0)
        _label(ax, row, at_ns, time_ns, total_ns)
        at_ns += time_ns
        # Leads the eye to the next bar.
        ax.plot([at_ns / 1e9] * 2, [row + 0.37, row + 0.63], color=_GREY, linewidth=0.8)
    ax.barh(len(bars), total_ns / 1e9, height=0.74, color=_GREY, linewidth=0.0)
    _label(ax, len(bars), 0, total_ns, total_ns)
    ax.set_yticks(range(len(bars) + 1), [*(words for words, _, _ in bars), "in all"], fontsize=FONT_PT)
    ax.set_ylim(len(bars) + 0.6, -0.6)
    ax.set_xlim(0.0, total_ns / 1e9)
    ax.tick_params(axis="y", length=0)
    ax.tick_params(axis="x", labelsize=FONT_PT)
    ax.set_xlabel("simulated time [s]", fontsize=FONT_PT)
    ax.spines[["top", "right"]].set_visible(False)
    _legend(figure, shown)
    return figure


def _label(ax: Axes, row: int, at_ns: int, time_ns: int, total_ns: int) -> None:
    """The time beside its bar: on the side where there is room."""
    right = at_ns + time_ns < 0.6 * total_ns
    place = (at_ns + time_ns if right else at_ns) / 1e9
    shift, side = (4, "left") if right else (-4, "right")
    within = not right and at_ns < 0.4 * total_ns
    if within:
        place, shift = (at_ns + time_ns) / 1e9, -4
    ax.annotate(
        f"{time_ns / 1e9:.1f}",
        (place, row),
        (shift, 0),
        textcoords="offset points",
        ha=side,
        va="center",
        fontsize=FONT_PT,
        color="white" if within else None,
    )


def _legend(figure: Figure, shown: dict[str, int]) -> None:
    from matplotlib.patches import Patch

    groups = dict.fromkeys(CAUSES[key].group for key in shown)
    handles = [Patch(color=GROUP_COLOURS[group], label=SHARES[group]) for group in groups]
    figure.legend(
        handles=handles, loc="outside upper left", ncols=2, frameon=False, fontsize=FONT_PT, handlelength=1.0,
        columnspacing=1.4,
    )  # fmt: skip
