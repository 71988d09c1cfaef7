"""Tables as Markdown, in GitHub's form."""

from __future__ import annotations

from teleop_sim.reports.parts import Column, Content, Sheet

SUFFIX = "md"
_MEANT = str.maketrans({c: f"\\{c}" for c in "\\`*_[]<>|~$"} | {"\n": " ", "\r": " "})


def markdown(content: Content) -> bytes | None:
    """The file's bytes, UTF-8; None where the content is no table. Numbers stand right, the sum is the last row."""
    if not isinstance(content, Sheet):
        return None
    rows = [*content.rows, *([content.total] if content.total else [])]
    lines = [
        _line([_heading(column) for column in content.columns]),
        "|" + "|".join("---:" if right else "---" for right in numeric(content)) + "|",
        *(_line([escaped(c.shown(cell)) for c, cell in zip(content.columns, row, strict=True)]) for row in rows),
    ]
    note = ["", escaped(content.note)] if content.note else []
    return "\n".join([*lines, *note, ""]).encode()


def numeric(sheet: Sheet) -> list[bool]:
    """Which columns hold numbers, if anything."""
    cells = ([row[i] for row in sheet.rows if row[i] is not None] for i in range(len(sheet.columns)))
    return [bool(column) and all(not isinstance(cell, str) for cell in column) for column in cells]


def escaped(text: str) -> str:
    """A text that Markdown shows as it is."""
    return text.translate(_MEANT)


def _heading(column: Column) -> str:
    return escaped(f"{column.group} {column.words}".strip())


def _line(cells: list[str]) -> str:
    return "| " + " | ".join(cells) + " |"
