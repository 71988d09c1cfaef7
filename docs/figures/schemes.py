"""One figure, two files: for the light and the dark scheme of the site."""

from __future__ import annotations

import re
from collections.abc import Mapping

from teleop_sim.reports.parts import Chart
from teleop_sim.reports.style import NEUTRALS, page, saved

LIGHT: Mapping[str, str] = {
    "ink": "#1b1c1e", "muted": "#5b5f66", "rule": "#d5d4cf", "paper": "#ffffff", "shade": "#f4f3ef",
    "violet": "#800080", "forest": "#006400",
}  # fmt: skip
DARK: Mapping[str, str] = {
    "ink": "#e6e5e1", "muted": "#a3a7ae", "rule": "#3a3e44", "paper": "#1e2129", "shade": "#262a33",
    "violet": "#c77dd6", "forest": "#4caf63",
}  # fmt: skip
_NEUTRAL = re.compile("|".join(NEUTRALS), re.IGNORECASE)
_NAME = re.compile(r"var\(--(\w+)\)")


def files(chart: Chart, name: str) -> dict[str, str]:
    """``name.svg`` and ``name.dark.svg``; reports know which colours of a figure are neutral."""
    with page():
        drawn = saved(chart, "svg").decode()
    return {f"{name}.svg": _coloured(drawn, LIGHT), f"{name}.dark.svg": _coloured(drawn, DARK)}


def _coloured(drawn: str, scheme: Mapping[str, str]) -> str:
    coloured = _NEUTRAL.sub(lambda found: _colour(found[0], scheme), drawn)
    # Where matplotlib leaves out black, SVG means it.
    return coloured.replace("<svg ", f'<svg fill="{scheme["ink"]}" ', 1)


def _colour(neutral: str, scheme: Mapping[str, str]) -> str:
    name = _NAME.fullmatch(NEUTRALS[neutral.lower()])
    assert name is not None
    return scheme[name[1]]
