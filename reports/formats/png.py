"""Figures as PNG, for paper."""

from __future__ import annotations

from teleop_sim.reports.formats.svg import figure
from teleop_sim.reports.parts import Content

SUFFIX = "png"


def png(content: Content) -> bytes | None:
    """The file's bytes; None where there is nothing drawn."""
    return figure(content, "png")
