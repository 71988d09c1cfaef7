"""What each direction of the link carried over time, as a figure and in totals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from teleop_sim.core.records import PacketEnded
from teleop_sim.reports.intervals import length_s, union
from teleop_sim.reports.lanes import dark
from teleop_sim.reports.link_use import (
    Window,
    busy,
    edges_of,
    goodput_bps,
    of_direction,
    queue,
    thinned,
    window_s,
    windows,
)
from teleop_sim.reports.parts import Cell, Chart, Column, Sheet
from teleop_sim.reports.run_view import Run
from teleop_sim.reports.style import COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WAYS = {"up": "uplink", "down": "downlink"}
KINDS = {
    "payload": ("messages that arrived", COLOURS[0]),
    "headers": ("their headers", COLOURS[4]),
    "vain": ("lost, or sent again", COLOURS[3]),
}
"""Field of ``Window`` to words and colour, from below."""
DARK, QUEUE = "#bbbbbb", COLOURS[1]
WIDTH_IN, FONT_PT = 6.4, 9.0


def link_chart(run: Run) -> Chart | None:
    """Share of the time in which bits went out, by what became of them, and the queue; None where nothing was sent."""
    records, end_s = run.records, run.end_s
    if end_s <= 0.0 or not any(isinstance(r, PacketEnded) for r in records):
        return None
    step = f"{window_s(end_s):g} s"
    shares = {way: length_s(busy(records, way)) / end_s for way in WAYS}
    words = " and ".join(f"{share:.1%} of the time on the {WAYS[way]}" for way, share in shares.items())
    note = (
        f"Share of each {step} in which bits went out, by what became of them; below, how many packets wait for their "
        "first bit. Grey: blackouts. Of a direction without a limit to its rate: payload that arrived."
    )
    return Chart(lambda: _figure(run), f"Use of the link in windows of {step}: bits went out in {words}.", note)


def link_sheet(run: Run) -> Sheet | None:
    """Totals of each direction; None where nothing was sent."""
    rows = tuple(_row(run, way) for way in WAYS if of_direction(run.records, way))
    columns = (
        Column("direction", "link"),
        Column("sent_bits", "bits offered", help="with headers"),
        Column("delivered_bits", "bits arrived", help="with headers"),
        Column("payload_bits", "payload arrived [bit]"),
        Column("goodput_bps", "goodput [bit/s]", 1, help="payload that arrived, over the whole run"),
        Column("least_rate_bps", "least rate [bit/s]", 0, help="of packets that arrived, while their bits went out"),
        Column("greatest_rate_bps", "greatest rate [bit/s]", 0, help="likewise"),
        Column("busy_s", "sending [s]", 1, help="bits went out"),
        Column("utilisation_pct", "utilisation [%]", 2, help="share of the run in which bits went out"),
        Column("peak_pct", "in the busiest window [%]", 1),
        Column("dark_s", "dark [s]", 1),
        Column("queued_s", "somebody queued [s]", 1, help="time in which at least one packet waited for its first bit"),
        Column("longest_queue", "longest queue [packets]"),
        Column("longest_queue_bits", "longest queue [bit]"),
    )
    return Sheet(columns, rows) if rows else None


def _row(run: Run, way: str) -> tuple[Cell, ...]:
    records, end_s = run.records, run.end_s
    packets = of_direction(records, way)
    arrived = [p for p in packets if p.outcome == "delivered"]
    payload_bits = 8 * sum(p.payload_bytes for p in arrived)
    rates = [p.size_bits / p.serialisation_s for p in arrived if p.serialisation_s > 0.0]
    busy_s = length_s(busy(records, way))
    waiting = queue(records, way)
    queued_s = sum(b - a for a, b, n in zip(waiting[0], waiting[0][1:], waiting[1], strict=False) if n)
    return (
        WAYS[way],
        sum(p.size_bits for p in packets),
        sum(p.size_bits for p in arrived),
        payload_bits,
        payload_bits / end_s if end_s > 0.0 else None,
        min(rates, default=None),
        max(rates, default=None),
        busy_s,
        100.0 * busy_s / end_s if end_s > 0.0 else None,
        100.0 * max((w.busy for w in windows(records, way, end_s)), default=0.0),
        length_s(union(dark(records, way))),
        queued_s,
        max(waiting[1]),
        max(queue(records, way, in_bits=True)[1]),
    )


def _figure(run: Run) -> Figure:
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    figure = Figure(figsize=(WIDTH_IN, 4.6), layout="constrained")
    panels = figure.subplots(4, 1, sharex=True, height_ratios=(3, 1.4, 3, 1.4))
    use = {way: windows(run.records, way, run.end_s) for way in WAYS}
    for way, (used, waiting) in zip(WAYS, (panels[:2], panels[2:]), strict=True):
        if any(w.busy > 1e-9 for w in use[way]):
            _use(used, use[way], WAYS[way])
        else:
            _goodput(used, run, way)
        _queue(waiting, run, way)
        for start_s, stop_s in dark(run.records, way):
            for ax in (used, waiting):
                ax.axvspan(start_s, stop_s, facecolor=DARK, alpha=0.5, linewidth=0.0, zorder=0.5)
    panels[0].set_xlim(0.0, run.end_s)
    panels[3].set_xlabel("simulated time [s]", fontsize=FONT_PT)
    seen = [k for k in KINDS if any(getattr(w, k) > 0.0 for some in use.values() for w in some)] or ["payload"]
    handles = [Patch(color=KINDS[kind][1], label=KINDS[kind][0]) for kind in seen]
    handles.append(Patch(color=QUEUE, label="packets in the queue"))
    if any(dark(run.records, way) for way in WAYS):
        handles.append(Patch(color=DARK, alpha=0.5, label="blackout"))
    figure.legend(
        handles=handles, loc="outside upper left", ncols=3, frameon=False, fontsize=FONT_PT, handlelength=1.0,
        columnspacing=1.2,
    )  # fmt: skip
    return figure


def _use(ax: Axes, used: Sequence[Window], name: str) -> None:
    """Stacked steps of what went out; the scale is that of the busiest window, so that thin use shows too."""
    edges = [w.start_s for w in used] + [w.end_s for w in used[-1:]]
    below = [0.0] * len(used)
    for kind, (_, colour) in KINDS.items():
        above = [low + 100.0 * getattr(w, kind) for low, w in zip(below, used, strict=True)]
        ax.stairs(above, edges, baseline=below, fill=True, color=colour, linewidth=0.0)
        below = above
    ax.set_ylim(0.0, 100.0 if max(below, default=0.0) > 50.0 else max(1.25 * max(below, default=0.0), 1.0))
    ax.set_ylabel(f"{name}\nin use [%]", fontsize=FONT_PT)
    _frame(ax)


def _goodput(ax: Axes, run: Run, way: str) -> None:
    """Of a direction that takes no time to send: what came through."""
    bps = goodput_bps(run.records, way, run.end_s)
    ax.stairs(bps, edges_of(run.end_s), fill=True, color=KINDS["payload"][1], linewidth=0.0)
    ax.set_ylim(0.0, max(1.15 * max(bps), 1.0))
    ax.set_ylabel(f"{WAYS[way]}\n[bit/s]", fontsize=FONT_PT)
    _frame(ax)


def _queue(ax: Axes, run: Run, way: str) -> None:
    from matplotlib.ticker import MaxNLocator

    times, counts = thinned(queue(run.records, way), run.end_s)
    ax.stairs(counts, [*times, max(run.end_s, times[-1])], fill=True, facecolor=QUEUE, edgecolor=QUEUE, linewidth=0.8)
    ax.set_ylim(0.0, max(1.15 * max(counts), 1.0))
    ax.yaxis.set_major_locator(MaxNLocator(nbins=2, integer=True))
    ax.set_ylabel("queue", fontsize=FONT_PT)
    _frame(ax)


def _frame(ax: Axes) -> None:
    ax.tick_params(labelsize=FONT_PT)
    ax.spines[["top", "right"]].set_visible(False)
