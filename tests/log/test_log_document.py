"""The documentation of the topics cannot rot."""

from pathlib import Path

import pytest

from teleop_sim.core.errors import UnknownName
from teleop_sim.core.records import RECORDS, RunStarted
from teleop_sim.log.document import frames_markdown, topics_markdown
from teleop_sim.log.load import load
from teleop_sim.log.meanings import EVERY_FRAME, MEANINGS
from teleop_sim.log.writer import LogWriter

PAGE = Path(__file__).parents[2] / "docs" / "log.md"


def test_the_page_is_what_the_records_say():
    frames, topics = PAGE.read_text(encoding="utf-8").split("<!-- frames -->")[1].split("<!-- topics -->")
    assert topics.strip() == topics_markdown().strip(), "run python -m teleop_sim.log.document and paste it"
    frames = frames.split("## Topics")[0]
    assert frames.strip() == frames_markdown().strip(), "run python -m teleop_sim.log.document and paste it"


def test_every_column_says_what_it_means(tmp_path):
    with LogWriter(tmp_path / "run.mcap", durable=False) as write:
        write(RunStarted(0.0, "src-dish", "", 1, 0, 100.0, ""))
    log = load(tmp_path / "run.mcap")
    known = {name: set(log.columns(name)["column"]) for name in EVERY_FRAME}
    for name, columns in known.items():
        told = log.columns(name).set_index("column")
        assert set(told["meaning"]) & {"", "factor of the sweep"} == set()
        times = [column for column in columns if column.endswith("_s")]
        assert set(told.loc[times, "unit"]) <= {"s"}
    plain = {key for key in MEANINGS if "." not in key} - {"log", "cell"}
    assert plain <= set().union(*known.values())
    assert all(key.split(".")[1] in known[key.split(".")[0]] for key in MEANINGS if "." in key)


def test_a_frame_that_is_none(tmp_path):
    with LogWriter(tmp_path / "run.mcap", durable=False) as write:
        write(RunStarted(0.0, "src-dish", "", 1, 0, 100.0, ""))
    with pytest.raises(UnknownName, match="Did you mean 'packets'"):
        load(tmp_path / "run.mcap").columns("packet")


def test_units_follow_the_names():
    text = topics_markdown()
    assert all(f"## `{topic}`" in text for topic in RECORDS)
    assert "| serialisation_s | double | s |" in text
    assert "| size_bits | int64 | bit |" in text
    assert "| joints | repeated double |  |" in text
