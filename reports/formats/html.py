"""A whole report as one page that needs nothing else: no request leaves it, and what a log says is data in it.

Everything from a log is escaped by Jinja2, and JSON cannot end its element. A content security policy allows this
page's own script, by its hash, and nothing else.
"""

from __future__ import annotations

import base64
import hashlib
import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import groupby
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from teleop_sim.reports.formats.files import Made
from teleop_sim.reports.formats.markdown import numeric
from teleop_sim.reports.formats.web import chart_svg, drawing_svg
from teleop_sim.reports.parts import Cell, Chart, Column, Drawing, Picture, Pictures, Sheet, Timeline

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

_SCRIPTS = ("page.js", "tables.js", "timeline_scale.js", "timeline_draw.js", "timeline_input.js", "timeline.js")
_STYLES = ("page.css", "tables.css", "timeline.css")

_JOINT = re.compile(r"(?<=[/_])(?=\w)")
_LONG = 16
"""Characters up to which a cell stays in one line (a choice of layout)."""
_TEXT = 36
"""Characters from which a cell is a sentence, which wants room on a narrow screen (a choice of layout)."""


@dataclass(frozen=True)
class Command:
    """What to type: in words what it is for, and the lines."""

    words: str
    lines: str


@dataclass(frozen=True)
class Page:
    """A report, ready to be shown.

    Attributes:
        title: what is reported on.
        verdict: how it came out, in some words; empty: none.
        tone: ``good``, ``bad`` or ``open``, of the verdict.
        lede: a sentence or two above all; the question of a scenario.
        facts: name and value, in order.
        made: its parts, in order.
        commands: how to have it all again.
        source: name and text of what can be unfolded at the end, such as the scenario; empty: none.

    """

    title: str
    verdict: str
    tone: str
    lede: str
    facts: tuple[tuple[str, str], ...]
    made: tuple[Made, ...]
    commands: tuple[Command, ...] = ()
    source: tuple[str, str] = ("", "")


def page_html(page: Page) -> str:
    """The page as the text of one HTML file, equal for equal contents."""
    script = _script()
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return _environment().get_template("page.html").render(
        page=page,
        parts=[_shown(made) for made in page.made],
        script=script,
        policy=f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'; img-src data:; "
        "base-uri 'none'; form-action 'none'",
        style="\n".join(_text(name) for name in _STYLES),
    )  # fmt: skip


def json_text(value: object) -> str:
    """JSON for a script element: no text in it can end the element, what is no number is null."""
    text = json.dumps(_finite(value), allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    for c in "<>&\u2028\u2029":
        text = text.replace(c, f"\\u{ord(c):04x}")
    return text


def _finite(value: object) -> object:
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Mapping):
        return {str(name): _finite(inner) for name, inner in value.items()}
    return [_finite(inner) for inner in value] if isinstance(value, list | tuple) else value


@cache
def _script() -> str:
    return "(() => {\n'use strict';\n" + "\n".join(_text(name) for name in _SCRIPTS) + "\n})();\n"


@cache
def _text(name: str) -> str:
    return files("teleop_sim.reports.html").joinpath(name).read_text(encoding="utf-8")


@cache
def _environment() -> Environment:
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    return Environment(
        loader=FunctionLoader(_text), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )


def _shown(made: Made) -> Mapping[str, Any]:
    """A part as the template takes it."""
    content = made.content
    return {"name": made.name, "title": made.title, "note": content.note, **_kind(content, made.name)}


def _kind(content: object, name: str) -> Mapping[str, Any]:
    if isinstance(content, Sheet):
        return {"kind": "sheet", "sheet": _sheet(content)}
    if isinstance(content, Chart):
        return {"kind": "chart", "alt": content.alt, "svg": chart_svg(content, name)}
    if isinstance(content, Drawing):
        return {"kind": "drawing", "alt": content.alt, "svg": drawing_svg(content, name)}
    if isinstance(content, Pictures):
        return {"kind": "pictures", "items": [_picture(item) for item in content.items]}
    assert isinstance(content, Timeline)
    return {"kind": "timeline", "alt": content.still.alt, "json": json_text(content.data)}


def _picture(picture: Picture) -> Mapping[str, str]:
    data = base64.b64encode(picture.data).decode()
    return {"source": f"data:{picture.media};base64,{data}", "caption": picture.caption}


@dataclass(frozen=True)
class _Td:
    """A cell: as shown, the number to sort by (empty: the text), where it leads, and its class."""

    text: Markup
    value: str
    link: str
    look: str


def _sheet(sheet: Sheet) -> Mapping[str, Any]:
    right = numeric(sheet)
    groups = [(name, len(list(columns))) for name, columns in groupby(sheet.columns, key=lambda c: c.group)]

    def row(cells: tuple[Cell, ...], number: int) -> list[_Td]:
        triples = zip(sheet.columns, cells, right, strict=True)
        return [_td(c, cell, r, sheet.links.get((number, i), "")) for i, (c, cell, r) in enumerate(triples)]

    return {
        "groups": groups if any(name for name, _ in groups) else [],
        "columns": list(zip(sheet.columns, right, strict=True)),
        "rows": [row(cells, number) for number, cells in enumerate(sheet.rows)],
        "total": row(sheet.total, -1) if sheet.total else [],
        "helps": [column for column in sheet.columns if column.help],
    }


def _td(column: Column, cell: Cell, right: bool, link: str) -> _Td:
    text = column.shown(cell)
    number = isinstance(cell, float | int) and math.isfinite(cell)
    value = f"{cell:.7g}" if number else ""
    # An address of our own making leads to a file beside the page, never elsewhere.
    inside = link if link and not urlsplit(link).scheme and not link.startswith("/") else ""
    look = "n" if right else "t" if len(text) > _TEXT else ""
    return _Td(_broken(text), value if value != text else "", inside, look)


def _broken(text: str) -> Markup:
    """A text that may go on in a new line after a slash or an underscore, as in the path of a state."""
    from markupsafe import Markup, escape

    return Markup("<wbr>").join(_JOINT.split(text)) if len(text) > _LONG else escape(text)


def tone(outcome: str) -> str:
    """Of a run's outcome: ``good``, ``bad`` or ``open``."""
    return {"completed": "good", "": "open", "censored": "open"}.get(outcome, "bad")


def commands(lines: Sequence[tuple[str, str]]) -> tuple[Command, ...]:
    """Words and lines as commands."""
    return tuple(Command(words, text) for words, text in lines)
