"""Lanes for a page's timeline as plain data: rows, bars, marks and steps, put together one by one.

What comes out is of JSON's types, in columns, and is read by ``reports/html/timeline.js``:

- ``end_s``: where the axis ends; ``guides``: times [s] marked through all lanes; ``texts``: what bars and marks say,
  told by number; ``kinds``: ``[words, colour, shape]`` of each kind of bar or mark, told by number. A colour is one of
  CSS, or the name of one of the page's variables.
- ``lanes``: in order. ``name``, ``title``, ``folded``; ``rows``: each ``{name, depth, height}`` [pixel] and ``ticks``:
  ``[share of the height, word]``; ``bars``: columns ``start``, ``took``, ``row``, ``kind``, ``text``, in the order of
  start; ``marks``: columns ``at``, ``row``, ``kind``, ``text``; ``steps``: each ``{row, kind, at, share, text}``, a
  line that keeps its ``share`` of the row's height from ``at`` on; ``bands``: ``[start, end, kind]`` behind all rows;
  ``legend``: kinds to explain.

To be short, columns of times are whole microseconds: ``took`` from the bar's start, ``start`` and ``at`` from the entry
before.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

ROW_PX = 15
"""Height of a row with a name (a choice of layout)."""


@dataclass
class Texts:
    """Numbers for texts: each is kept once."""

    found: dict[str, int] = field(default_factory=dict)

    def number(self, text: str) -> int:
        """The number of a text."""
        return self.found.setdefault(text, len(self.found))


@dataclass(frozen=True)
class Kind:
    """What a colour means: words for people, a colour of CSS or the page's variable, and the shape of a mark."""

    words: str
    colour: str
    shape: str = ""


@dataclass(frozen=True)
class Row:
    """A row of a lane: name, how deep it is in the tree, height [pixel], and words at shares of its height."""

    name: str
    depth: int = 0
    height: float = ROW_PX
    ticks: tuple[tuple[float, str], ...] = ()


@dataclass(frozen=True)
class Bar:
    """A stretch of time: from, to [s], its row, its kind and what it says."""

    start_s: float
    end_s: float
    row: int
    kind: Kind
    text: str


@dataclass(frozen=True)
class Mark:
    """Something at a time [s]: its row, its kind, and what it says."""

    at_s: float
    row: int
    kind: Kind
    text: str


@dataclass(frozen=True)
class Step:
    """A quantity that keeps each value until the next: times [s], shares of the row's height, and what each says."""

    row: int
    kind: Kind
    at_s: tuple[float, ...]
    share: tuple[float, ...]
    text: tuple[str, ...]


@dataclass(frozen=True)
class Lane:
    """A lane: what it holds, and whether it is folded at first."""

    name: str
    title: str
    rows: tuple[Row, ...]
    bars: tuple[Bar, ...] = ()
    marks: tuple[Mark, ...] = ()
    steps: tuple[Step, ...] = ()
    bands: tuple[tuple[float, float, Kind], ...] = ()
    folded: bool = False


def timeline_data(end_s: float, guides: Sequence[float], lanes: Iterable[Lane]) -> dict[str, Any]:
    """Lanes as the page reads them; those without a bar, a mark or a step are left out."""
    texts, kinds = Texts(), dict[Kind, int]()
    kept = [lane for lane in lanes if lane.bars or lane.marks or lane.steps]
    data = [_lane(lane, texts, kinds) for lane in kept]
    return {
        "end_s": round(end_s, 6),
        "guides": [round(t_s, 6) for t_s in guides],
        "lanes": data,
        "kinds": [[kind.words, kind.colour, kind.shape] for kind in kinds],
        "texts": list(texts.found),
    }


def _lane(lane: Lane, texts: Texts, kinds: dict[Kind, int]) -> dict[str, Any]:
    def number(kind: Kind) -> int:
        return kinds.setdefault(kind, len(kinds))

    bars = sorted(lane.bars, key=lambda bar: bar.start_s)
    marks = sorted(lane.marks, key=lambda mark: mark.at_s)
    kinds_used = (*(bar.kind for bar in bars), *(mark.kind for mark in marks), *(band[2] for band in lane.bands))
    return {
        "name": lane.name,
        "title": lane.title,
        "folded": lane.folded,
        "rows": [_row(row) for row in lane.rows],
        "bars": {
            "start": _steps_us([bar.start_s for bar in bars]),
            "took": [_us(bar.end_s) - _us(bar.start_s) for bar in bars],
            "row": [bar.row for bar in bars],
            "kind": [number(bar.kind) for bar in bars],
            "text": [texts.number(bar.text) for bar in bars],
        },
        "marks": {
            "at": _steps_us([mark.at_s for mark in marks]),
            "row": [mark.row for mark in marks],
            "kind": [number(mark.kind) for mark in marks],
            "text": [texts.number(mark.text) for mark in marks],
        },
        "steps": [
            {
                "row": step.row,
                "kind": number(step.kind),
                "at": _steps_us(step.at_s),
                "share": [round(share, 4) for share in step.share],
                "text": [texts.number(text) for text in step.text],
            }
            for step in lane.steps
        ],
        "bands": [[round(start_s, 6), round(end_s, 6), number(kind)] for start_s, end_s, kind in lane.bands],
        "legend": [number(kind) for kind in dict.fromkeys(kinds_used) if kind.words],
    }


def _row(row: Row) -> dict[str, Any]:
    made: dict[str, Any] = {"name": row.name, "depth": row.depth, "height": row.height}
    return made | ({"ticks": [list(tick) for tick in row.ticks]} if row.ticks else {})


def _us(t_s: float) -> int:
    return round(t_s * 1e6)


def _steps_us(times_s: Sequence[float]) -> list[int]:
    """Each time from the one before; the first from 0."""
    times_us = [_us(t_s) for t_s in times_s]
    return [later - sooner for sooner, later in pairwise([0, *times_us])]
