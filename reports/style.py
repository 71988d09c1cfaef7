"""How figures look: on paper, and in a page, where light and dark decide their neutral colours.

A figure for a page is drawn with neutral colours that nobody would choose, which ``web.py`` replaces by the page's CSS
variables. Data keep their colours: Okabe and Ito's, told apart by people with any common colour blindness
(https://jfly.uni-koeln.de/color/). Drawing is deterministic: no date, no random ids.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from typing import Any

from teleop_sim.reports.parts import Chart

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7")
"""Okabe and Ito's without black and yellow, which a dark and a light page swallow; in the order of the cycle."""

INK, MUTED, RULE, PAPER = "#010203", "#010204", "#010205", "#010206"
"""Neutral colours of a page's figures: text and lines, lesser text, grid and frames, ground. See ``NEUTRALS``."""

NEUTRALS: Mapping[str, str] = {
    INK: "var(--ink)",
    MUTED: "var(--muted)",
    RULE: "var(--rule)",
    PAPER: "var(--paper)",
    # What figures for paper use, in charts that ask for nothing else.
    "#000000": "var(--ink)",
    "#ffffff": "var(--paper)",
    "#555555": "var(--muted)",
    "#888888": "var(--muted)",
    "#bbbbbb": "var(--rule)",
    "#e4e4e4": "var(--rule)",
    "#f6f6f6": "var(--shade)",
    "#efefef": "var(--shade)",
    # Of the ViGIR paper's Fig. 17, too dark for a dark page.
    "#800080": "var(--violet)",
    "#006400": "var(--forest)",
    "#00441b": "var(--forest)",
}
"""Colour in a figure's SVG, in lower case, to what a page puts there."""

_SHARED: Mapping[str, Any] = {"svg.hashsalt": "teleop-sim", "font.family": "DejaVu Sans", "font.size": 8.0}
_PAGE: Mapping[str, Any] = {
    "svg.fonttype": "none",
    **dict.fromkeys(("figure.facecolor", "savefig.facecolor", "axes.facecolor", "legend.facecolor"), "none"),
    **dict.fromkeys(("text.color", "axes.labelcolor", "axes.titlecolor", "lines.color", "patch.edgecolor"), INK),
    **dict.fromkeys(("xtick.labelcolor", "ytick.labelcolor"), MUTED),
    **dict.fromkeys(("axes.edgecolor", "grid.color", "xtick.color", "ytick.color", "legend.edgecolor"), RULE),
}
DPI = 130
"""Of PNG."""


@contextmanager
def paper() -> Iterator[None]:
    """Figures drawn inside are for paper: black on white."""
    with _style({}):
        yield


@contextmanager
def page() -> Iterator[None]:
    """Figures drawn inside are for a page: neutral colours as in ``NEUTRALS``, no ground, text left as text."""
    with _style(_PAGE):
        yield


@contextmanager
def _style(more: Mapping[str, Any]) -> Iterator[None]:
    import matplotlib as mpl
    from cycler import cycler

    with mpl.rc_context():
        # Whatever the user has set up must not change the bytes.
        mpl.rcdefaults()
        values: dict[Any, Any] = {**_SHARED, "axes.prop_cycle": cycler(color=COLOURS), **more}
        mpl.rcParams.update(values)
        yield


def drawn(chart: Chart, suffix: str) -> bytes:
    """A figure for paper as ``svg`` or ``png``."""
    with paper():
        return saved(chart, suffix)


def saved(chart: Chart, suffix: str) -> bytes:
    """A figure as a file, in the style that is in force."""
    out = BytesIO()
    chart.draw().savefig(out, format=suffix, dpi=DPI, metadata={"Date": None} if suffix == "svg" else None)
    return out.getvalue()
