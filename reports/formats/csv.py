"""Tables as CSV: full precision, nothing for what is not known, no sum."""

from __future__ import annotations

import csv as stdlib_csv
import math
from io import StringIO

from teleop_sim.reports.parts import Cell, Content, Sheet

SUFFIX = "csv"


def csv(content: Content) -> bytes | None:
    """The file's bytes, UTF-8, equal for equal contents; None where the content is no table."""
    if not isinstance(content, Sheet):
        return None
    out = StringIO()
    writer = stdlib_csv.writer(out, lineterminator="\n")
    writer.writerow([column.name for column in content.columns])
    writer.writerows([_plain(cell) for cell in row] for row in content.rows)
    return out.getvalue().encode()


def _plain(cell: Cell) -> str:
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return ""
    # The shortest text that gives the same number back.
    return repr(float(cell)) if isinstance(cell, float) else str(cell)
