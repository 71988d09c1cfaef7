"""Figures as parts of a page: SVG that takes the page's colours and fonts and does not clash with its neighbours."""

from __future__ import annotations

import re
from collections.abc import Sequence
from xml.etree import ElementTree

from teleop_sim.reports.parts import Chart, Drawing
from teleop_sim.reports.style import NEUTRALS, page, saved

_SVG = "http://www.w3.org/2000/svg"
_XLINK = "http://www.w3.org/1999/xlink"
_UNWANTED = frozenset(f"{{{_SVG}}}{name}" for name in ("metadata", "script", "foreignObject", "title"))
_NEUTRAL = re.compile("|".join(NEUTRALS), re.IGNORECASE)
_REFERENCE = re.compile(r"url\(#([^)]+)\)")
_HEX = re.compile("#[0-9a-fA-F]{6}")
_TEXTS = frozenset(f"{{{_SVG}}}{name}" for name in ("text", "tspan"))
_TEXT_FILL = re.compile("fill: (#[0-9a-fA-F]{6})")
_GREY = 48
"""Spread of red, green and blue up to which a colour is a grey: a text of that is chosen for its ground."""
_FAMILY = re.compile(r"'[^']*'(, *(?:'[^']*'|[\w-]+))*")
_COLOURED = ("style", "fill", "stroke")
_LONG_NUMBER = re.compile(r"-?\d+\.\d{3,}")
_PLACED = ("d", "x", "y", "width", "height", "points", "transform")
_LEGIBLE = 6.0
"""Contrast that a drawing's texts are given on white, so that on light tints 4.5 is left (WCAG 2.2, 1.4.3)."""
_LINKS = ("href", f"{{{_XLINK}}}href")


def chart_svg(chart: Chart, prefix: str) -> str:
    """A chart as an SVG element of a page.

    Args:
        chart: what to draw.
        prefix: of its ids, another for each figure of a page.

    """
    with page():
        data = saved(chart, "svg")
    return embedded(data, prefix, neutral=True)


def drawing_svg(drawing: Drawing, prefix: str) -> str:
    """A drawing as an SVG element of a page; it keeps its own colours, on white, and its texts get enough contrast."""
    return embedded(drawing.render("svg"), prefix, neutral=False)


def embedded(data: bytes, prefix: str, neutral: bool) -> str:
    """An SVG file as an element of a page: ids prefixed, nothing that runs or leads away, as wide as there is room.

    ``neutral``: neutral colours become those of the page, and texts take its font.
    """
    root = ElementTree.fromstring(data)  # noqa: S314 - our own drawing, its texts escaped
    for parent in list(root.iter()):
        for child in [c for c in parent if c.tag in _UNWANTED]:
            parent.remove(child)
    for element in root.iter():
        _prefix(element, prefix)
        for name in [n for n in element.attrib if n.startswith("on")]:
            del element.attrib[name]
        for name in _PLACED:
            if name in element.attrib:
                element.set(name, _LONG_NUMBER.sub(_rounded, element.attrib[name]))
        if neutral:
            _recolour(element)
        elif element.tag == f"{{{_SVG}}}text" and _HEX.fullmatch(element.attrib.get("fill", "")):
            element.set("fill", legible(element.attrib["fill"]))
    width = root.attrib.pop("width", "")
    root.attrib.pop("height", None)
    root.set("style", f"--wide: {_in_em(width)}")
    # What matplotlib draws black without saying so.
    root.set("fill", "currentColor")
    ElementTree.register_namespace("", _SVG)
    ElementTree.register_namespace("xlink", _XLINK)
    return ElementTree.tostring(root, encoding="unicode")


def _prefix(element: ElementTree.Element, prefix: str) -> None:
    if "id" in element.attrib:
        element.set("id", f"{prefix}-{element.attrib['id']}")
    for name in _LINKS:
        target = element.attrib.get(name, "#")
        if target.startswith("#"):
            if name in element.attrib:
                element.set(name, f"#{prefix}-{target[1:]}")
        elif not target.startswith("data:image/"):
            del element.attrib[name]
    for name, value in element.attrib.items():
        if "url(#" in value:
            element.set(name, _REFERENCE.sub(rf"url(#{prefix}-\1)", value))


def _recolour(element: ElementTree.Element) -> None:
    for name in _COLOURED:
        value = element.attrib.get(name)
        if value is not None:
            value = _NEUTRAL.sub(lambda found: NEUTRALS[found[0].lower()], value)
            value = _FAMILY.sub("var(--sans)", value) if "font" in value else value
            element.set(name, _TEXT_FILL.sub(_mixed, value) if element.tag in _TEXTS else value)


def _mixed(fill: re.Match[str]) -> str:
    """A text in the colour of its data goes nearer to ink, so that it can be read on light and on dark."""
    parts = _parts(fill[1])
    grey = max(parts) - min(parts) <= _GREY
    return fill[0] if grey else f"fill: color-mix(in srgb, {fill[1]} 55%, var(--ink))"


def _parts(colour: str) -> list[int]:
    """Red, green and blue of ``#rrggbb``, from 0 to 255."""
    return [int(colour[i : i + 2], 16) for i in (1, 3, 5)]


def _rounded(number: re.Match[str]) -> str:
    """A hundredth of a point is finer than any screen."""
    return f"{float(number[0]):.2f}".rstrip("0").rstrip(".")


def legible(colour: str) -> str:
    """A colour, darkened as far as text on white needs.

    Contrast as in WCAG 2.2: (1 + 0.05) / (relative luminance + 0.05).
    """
    parts = _parts(colour)
    while 1.05 / (_luminance(parts) + 0.05) < _LEGIBLE:
        parts = [int(0.95 * part) for part in parts]
    return "#" + "".join(f"{part:02x}" for part in parts)


def _luminance(parts: Sequence[int]) -> float:
    """Relative luminance of an sRGB colour (WCAG 2.2)."""
    linear = [v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in (part / 255.0 for part in parts)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def _in_em(width: str) -> str:
    """A width in points as one of the page's own units: 12 points are 1 rem, so 8 points of text are 0.67 rem."""
    points = float(width.removesuffix("pt")) if width.endswith("pt") else 720.0
    return f"{points / 12.0:.4g}rem"
