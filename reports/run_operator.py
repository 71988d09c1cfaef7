"""People over time: how busy each role was, what waited for them, how old their picture of the field was."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from teleop_sim.core.records import OperatorActed
from teleop_sim.reports.belief_age import PICTURES, Tooth, mean_s, quantile_s, teeth
from teleop_sim.reports.intervals import length_s
from teleop_sim.reports.lanes import dark
from teleop_sim.reports.parts import Cell, Chart, Column, Sheet
from teleop_sim.reports.run_view import Run
from teleop_sim.reports.style import COLOURS
from teleop_sim.reports.workload import at_station, at_work, roles, shares, waiting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH_IN, FONT_PT = 6.4, 9.0
WINDOW_S, MOST_WINDOWS = 30.0, 200
"""Of workload; a multiple of it where the run is long (a choice of layout)."""
AGES = {"anything": None, "a picture or cloud": PICTURES}
DARK = "#bbbbbb"
AGE_COLOURS = (COLOURS[0], COLOURS[1])


def workload_chart(run: Run) -> Chart | None:
    """Share of each window in which each role was at work, and requests at the station; None where nobody acted."""
    if run.end_s <= 0.0 or not any(isinstance(r, OperatorActed) for r in run.records):
        return None
    busy = {role: length_s(at_work(run.records, role)) / run.end_s for role in roles(run.records)}
    words = ", ".join(f"{role} {share:.0%}" for role, share in busy.items())
    step = f"{_window_s(run.end_s):g} s"
    note = f"Share of each {step} in which a role was at work; below, requests that have come and are not answered yet."
    return Chart(lambda: _workload_figure(run), f"Workload over time; at work over the whole run: {words}.", note)


def age_chart(run: Run) -> Chart | None:
    """The age of what the control station knows; None where nothing arrived there."""
    saws = {name: teeth(run.records, run.end_s, topics) for name, topics in AGES.items()}
    shown = {name: saw for name, saw in saws.items() if saw}
    if not shown:
        return None
    words = ", ".join(f"of {name} {mean_s(saw):.1f} s" for name, saw in shown.items())
    note = (
        "Now less when the newest thing was sent that has arrived (age of information, Kaul, Yates and Gruteser 2012). "
        "What is expected meanwhile, such as that a standing robot still stands, does not count."
    )
    return Chart(lambda: _age_figure(shown, run), f"Age of what is known at the station, on average {words}.", note)


def operator_sheet(run: Run) -> Sheet | None:
    """Roles and ages in figures; None where nobody acted."""
    if run.end_s <= 0.0 or not any(isinstance(r, OperatorActed) for r in run.records):
        return None
    columns = (
        Column("role", "role"),
        Column("acts", "acts"),
        Column("commands", "commands", help="sent"),
        Column("busy_s", "at work [s]", 1),
        Column("workload_pct", "workload [%]", 1, help="share of the run"),
        Column("peak_pct", "in the busiest window [%]", 0),
    )
    rows = tuple(_role_row(run, role) for role in roles(run.records))
    everybody = _share_row(run, None)
    held_s = sum(b - a for a, b in at_station(run.records))
    note = (
        f"Windows of {_window_s(run.end_s):g} s. Requests at the station: {held_s / run.end_s:.2f} on average, "
        f"{max(waiting(run.records)[1])} at most. The last row counts an instant once, however many are at work."
    )
    acts = [r for r in run.records if isinstance(r, OperatorActed)]
    return Sheet(columns, rows, ("anybody", len(acts), sum(r.kind == "send" for r in acts), *everybody), note)


def age_sheet(run: Run) -> Sheet | None:
    """Mean, median and tail of the ages; None where nothing arrived."""
    columns = (
        Column("what", "newest"),
        Column("since_s", "known from [s]", 1, help="when the first came"),
        Column("mean_s", "mean [s]", 2, help="over the time since"),
        Column("median_s", "median [s]", 2),
        Column("p95_s", "95 % [s]", 2, help="not exceeded in 95 % of the time"),
        Column("worst_s", "oldest [s]", 2),
    )
    saws = {name: teeth(run.records, run.end_s, topics) for name, topics in AGES.items()}
    rows = tuple(
        (name, saw[0].start_s, mean_s(saw), quantile_s(saw, 0.5), quantile_s(saw, 0.95), max(t.end_age_s for t in saw))
        for name, saw in saws.items()
        if saw
    )
    return Sheet(columns, rows) if rows else None


def _role_row(run: Run, role: str) -> tuple[Cell, ...]:
    acts = [r for r in run.records if isinstance(r, OperatorActed) and r.role == role]
    return (role, len(acts), sum(r.kind == "send" for r in acts), *_share_row(run, role))


def _share_row(run: Run, role: str | None) -> tuple[Cell, ...]:
    spans = at_work(run.records, role)
    busiest = max(shares(spans, run.end_s, _window_s(run.end_s))[1], default=0.0)
    return length_s(spans), 100.0 * length_s(spans) / run.end_s, 100.0 * busiest


def _window_s(end_s: float) -> float:
    return WINDOW_S * max(1.0, -(-end_s // (WINDOW_S * MOST_WINDOWS)))


def _workload_figure(run: Run) -> Figure:
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    shown = roles(run.records)
    figure = Figure(figsize=(WIDTH_IN, 0.9 * len(shown) + 1.3), layout="constrained")
    panels = figure.subplots(len(shown) + 1, 1, sharex=True, squeeze=False)[:, 0]
    for ax, role in zip(panels, shown, strict=False):
        edges, busy = shares(at_work(run.records, role), run.end_s, _window_s(run.end_s))
        ax.stairs([100.0 * share for share in busy], edges, fill=True, color=COLOURS[0], linewidth=0.0)
        ax.set_ylim(0.0, 100.0)
        ax.set_yticks([0, 50, 100])
        ax.set_ylabel(f"{role}\n[%]", fontsize=FONT_PT)
        _frame(ax)
    last = panels[-1]
    times, counts = waiting(run.records)
    last.stairs(
        counts,
        [*times, max(run.end_s, times[-1])],
        fill=True,
        facecolor=COLOURS[1],
        edgecolor=COLOURS[1],
        linewidth=0.8,
    )
    last.set_ylim(0.0, max(1.15 * max(counts), 1.0))
    last.yaxis.set_major_locator(MaxNLocator(nbins=2, integer=True))
    last.set_ylabel("requests\nopen", fontsize=FONT_PT)
    last.set_xlim(0.0, run.end_s)
    last.set_xlabel("simulated time [s]", fontsize=FONT_PT)
    _frame(last)
    return figure


def _age_figure(saws: dict[str, list[Tooth]], run: Run) -> Figure:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH_IN, 2.6), layout="constrained")
    ax = figure.add_subplot()
    for (name, saw), colour in zip(saws.items(), AGE_COLOURS, strict=False):
        ax.plot(*_points(saw), color=colour, linewidth=1.1, label=name)
    darkness = dark(run.records, "down")
    for i, (start_s, stop_s) in enumerate(darkness):
        ax.axvspan(
            start_s, stop_s, facecolor=DARK, alpha=0.5, linewidth=0.0, zorder=0.5, label="" if i else "downlink dark"
        )
    ax.set_xlim(0.0, run.end_s)
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel("simulated time [s]", fontsize=FONT_PT)
    ax.set_ylabel("age of the newest [s]", fontsize=FONT_PT)
    figure.legend(loc="outside upper left", ncols=3, frameon=False, fontsize=FONT_PT, handlelength=1.4)
    _frame(ax)
    return figure


def _points(saw: Sequence[Tooth]) -> tuple[list[float], list[float]]:
    times = [t_s for tooth in saw for t_s in (tooth.start_s, tooth.end_s)]
    return times, [age_s for tooth in saw for age_s in (tooth.age_s, tooth.end_age_s)]


def _frame(ax: Axes) -> None:
    ax.tick_params(labelsize=FONT_PT)
    ax.spines[["top", "right"]].set_visible(False)
