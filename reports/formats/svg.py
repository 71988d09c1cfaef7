"""Figures as SVG, for paper."""

from __future__ import annotations

from teleop_sim.reports.parts import Chart, Content, Drawing, Timeline
from teleop_sim.reports.style import drawn

SUFFIX = "svg"


def svg(content: Content) -> bytes | None:
    """The file's bytes, equal for equal contents; None where there is nothing drawn."""
    return figure(content, "svg")


def figure(content: Content, suffix: str) -> bytes | None:
    """A figure as ``svg`` or ``png``; None: the content is none."""
    if isinstance(content, Timeline):
        return drawn(content.still, suffix)
    if isinstance(content, Chart):
        return drawn(content, suffix)
    return content.render(suffix) if isinstance(content, Drawing) else None
