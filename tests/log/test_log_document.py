"""The documentation of the topics cannot rot."""

from pathlib import Path

from teleop_sim.core.records import RECORDS
from teleop_sim.log.document import topics_markdown

PAGE = Path(__file__).parents[2] / "docs" / "log.md"


def test_the_page_is_what_the_records_say():
    generated = PAGE.read_text(encoding="utf-8").split("<!-- topics -->")[1]
    assert generated.strip() == topics_markdown().strip(), "run python -m teleop_sim.log.document and paste it"


def test_units_follow_the_names():
    text = topics_markdown()
    assert all(f"## `{topic}`" in text for topic in RECORDS)
    assert "| serialisation_s | double | s |" in text
    assert "| size_bits | int64 | bit |" in text
    assert "| joints | repeated double |  |" in text
