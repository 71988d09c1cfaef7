"""Every figure of the site that is not kept in ``docs/pictures``: ``python docs/figures/make.py DIR`` writes them."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import decision
import people
import run
import waiting
from schemes import files


def figures() -> dict[str, str]:
    """File name to SVG, for the light and the dark scheme."""
    charts = {"waiting": waiting.chart(), "people": people.chart(), "decision": decision.chart(), **run.charts()}
    return {file: text for name, chart in charts.items() for file, text in files(chart, name).items()}


def main(out: Path) -> None:
    """Write them into a folder."""
    out.mkdir(parents=True, exist_ok=True)
    for name, text in figures().items():
        (out / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python docs/figures/make.py DIR, such as figures")
    main(Path(sys.argv[1]))
