"""The pages name what there is."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CODE = ("channel", "machines", "operators", "scenarios", "reports", "teleop_sim")
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
OURS = (*CODE, "tests", "examples", "docs", "core", "log", "robot", "world")
PATH = re.compile(rf"`((?:{'|'.join(OURS)})/[\w./-]+\.(?:py|toml|csv|json|md))`")


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_every_file_that_a_page_names_exists(page):
    named = set(PATH.findall(page.read_text(encoding="utf-8")))
    assert {name for name in named if not ((ROOT / name).exists() or (ROOT / "teleop_sim" / name).exists())} == set()


def test_the_page_of_assumptions_names_every_file_that_assumes_something():
    holding = {
        str(file.relative_to(ROOT))
        for folder in CODE
        for suffix in ("py", "toml", "csv", "json")
        for file in (ROOT / folder).rglob(f"*.{suffix}")
        if not (ROOT / folder / file.relative_to(ROOT / folder).parts[0]).is_symlink()
        and "assumed" in file.read_text(encoding="utf-8").lower()
    }
    named = set(PATH.findall((ROOT / "docs" / "assumptions.md").read_text(encoding="utf-8")))
    assert named - holding == set(), "docs/assumptions.md names files that assume nothing"
    assert holding - named == set(), "say in docs/assumptions.md what these files assume, how much and why"
