r"""Tables as LaTeX, in the manner of ``booktabs``: to be taken in with ``\input``; needs that package only."""

from __future__ import annotations

from itertools import groupby
from textwrap import wrap

from teleop_sim.reports.formats.markdown import numeric
from teleop_sim.reports.parts import Content, Sheet

SUFFIX = "tex"
WIDE = 14
"""Letters of a heading in one line (a choice of layout)."""
_SPECIAL = {
    "\\": r"\textbackslash{}",
    **{c: f"\\{c}" for c in "&%$#_{}"},
    # Behind a line break these would be its argument.
    "[": "{[}",
    "*": "{*}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    '"': r"\char34{}",  # \textquotedbl is not in every encoding
    # What old engines lack in their input encoding, and what tables of ours hold.
    "±": r"$\pm$",
    "×": r"$\times$",
    "·": r"$\cdot$",
    "≥": r"$\geq$",
    "≤": r"$\leq$",
    "−": r"$-$",
    "σ": r"$\sigma$",
    "µ": r"$\mu$",
    "→": r"$\rightarrow$",
    "°": r"$^\circ$",
    "–": "--",
    "…": r"\dots{}",
    "\n": " ",
    "\r": " ",
}
_MEANT = str.maketrans(_SPECIAL)


def latex(content: Content) -> bytes | None:
    """The file's bytes, UTF-8, equal for equal contents; None where the content is no table."""
    if not isinstance(content, Sheet):
        return None
    right = numeric(content)
    lines = [
        "% needs \\usepackage{booktabs}",
        "\\begin{tabular}{@{}" + "".join("r" if number else "l" for number in right) + "@{}}",
        "\\toprule",
        *_groups(content),
        _line([_heading(column.words, number) for column, number in zip(content.columns, right, strict=True)]),
        "\\midrule",
        *(_row(content, row) for row in content.rows),
        *(["\\midrule", _row(content, content.total)] if content.total else []),
        "\\bottomrule",
        "\\end{tabular}",
        *([f"\\par\\smallskip\\footnotesize {escaped(content.note)}"] if content.note else []),
    ]
    # In a group of its own: the note's size stays inside.
    return "\n".join(["\\begingroup", *lines, "\\par\\endgroup", ""]).encode()


def escaped(text: str) -> str:
    """A text that LaTeX shows as it is."""
    return text.translate(_MEANT)


def _heading(words: str, right: bool) -> str:
    """A heading, in lines of its own where it is long."""
    lines = wrap(words, WIDE, break_long_words=False)
    if len(lines) < 2:
        return escaped(words)
    side = "r" if right else "l"
    return f"\\begin{{tabular}}[b]{{@{{}}{side}@{{}}}}" + r" \\ ".join(map(escaped, lines)) + "\\end{tabular}"


def _row(sheet: Sheet, row: tuple[str | int | float | None, ...]) -> str:
    return _line([escaped(column.shown(cell)) for column, cell in zip(sheet.columns, row, strict=True)])


def _line(cells: list[str]) -> str:
    return " & ".join(cells) + r" \\"


def _groups(sheet: Sheet) -> list[str]:
    """A line of headings above the columns, and rules below each; nothing where no column has a group."""
    spans = [(name, len(list(columns))) for name, columns in groupby(sheet.columns, key=lambda c: c.group)]
    if all(not name for name, _ in spans):
        return []
    cells, rules, at = [], [], 1
    for name, width in spans:
        cells.append(f"\\multicolumn{{{width}}}{{c}}{{{escaped(name)}}}" if name or width > 1 else "")
        rules += [f"\\cmidrule(lr){{{at}-{at + width - 1}}}"] if name else []
        at += width
    return [_line(cells), " ".join(rules)]
