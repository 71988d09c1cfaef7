"""The contract of a run's parts: of any log a content that can be drawn, twice to the same bytes, or none."""

import math
from pathlib import Path

import pytest

import teleop_sim
from teleop_sim.core.records import EpisodeEnded, PlantNames, PlantSample, RunEnded, RunStarted, TransitionTaken
from teleop_sim.log.load import load
from teleop_sim.log.writer import LogWriter
from teleop_sim.reports.parts import Chart, Content, Drawing, Pictures, Sheet, Timeline
from teleop_sim.reports.registry import RUN_PARTS
from teleop_sim.reports.run_view import Run
from teleop_sim.reports.style import drawn
from teleop_sim.run import run_scenario

NAN = math.nan
DARK = [[20.0, 45.0]]
MADE = {
    "asking in the dark": (
        "src-dish",
        {"autonomy": "off", "time_limit_s": 90.0, "link.up.blackouts": DARK, "link.down.blackouts": DARK},
    ),
    "repeating": (
        "src-dish",
        {"autonomy": "low", "time_limit_s": 60.0, "link.delivery": "selective_repeat",
         "link.down.loss": {"model": "bernoulli", "p": 0.3}},
    ),
    "falling": ("src-dish", {"world.floor_friction": [0.06, 0.06], "time_limit_s": 60.0, "link.down.rate_bps": 50.0}),
    "looking closely": ("src-dish-drums", {"time_limit_s": 40.0}),
    "a door": ("drc-door-day2", {"time_limit_s": 150.0}),
    "a valve by hand": ("drc-valve-thormang3-lab-operator", {"time_limit_s": 120.0}),
}  # fmt: skip
SHOWN = {
    "asking in the dark": {"timeline", "waterfall", "states", "machine", "walk", "workload", "age", "link", "packets"},
    "repeating": {"messages"},
    "looking closely": {"verification"},
    "a door": {"layers", "times", "roles", "ages", "link-totals"},
    "a valve by hand": {"walk", "times"},
}
"""What must not be missing."""


@pytest.fixture(scope="session")
def logs(tmp_path_factory) -> dict[str, Path]:
    out = tmp_path_factory.mktemp("parts")
    return {
        name: run_scenario(teleop_sim.load_scenario(scenario, tables), 1, out / name).log
        for name, (scenario, tables) in MADE.items()
    }


def contents(run: Run) -> dict[str, Content]:
    made = {part.name: part.make(run) for part in RUN_PARTS}
    return {name: content for name, content in made.items() if content is not None}


def as_bytes(content: Content) -> bytes:
    """What a format makes of it, as far as it is not text."""
    if isinstance(content, Timeline):
        return repr(content.data).encode() + as_bytes(content.still)
    if isinstance(content, Chart):
        return drawn(content, "svg")
    if isinstance(content, Drawing):
        return content.render("svg")
    if isinstance(content, Pictures):
        return b"".join(picture.data for picture in content.items)
    return repr((content.columns, content.rows, content.total)).encode()


def check(content: Content) -> None:
    if isinstance(content, Sheet):
        names = [column.name for column in content.columns]
        assert len(set(names)) == len(names)
        assert all(cell is None or isinstance(cell, str | int | float) for row in content.rows for cell in row)
    if isinstance(content, Chart | Drawing):
        assert len(content.alt) > 10
        assert "nan" not in content.alt


def test_names_are_unique_and_fit_for_files():
    names = [part.name for part in RUN_PARTS]
    assert len(set(names)) == len(names)
    assert all(name.isascii() and name == name.lower() and " " not in name for name in names)


@pytest.mark.parametrize("name", MADE)
def test_every_part_of_a_run_is_a_content_that_can_be_drawn(logs, name):
    made = contents(Run(load(logs[name])))
    assert SHOWN.get(name, set()) <= set(made)
    for content in made.values():
        check(content)
        assert as_bytes(content)


@pytest.mark.parametrize("name", ["asking in the dark", "a door"])
def test_the_same_log_gives_the_same_bytes(logs, name):
    one, two = (contents(Run(load(logs[name]))) for _ in range(2))
    assert {n: as_bytes(c) for n, c in one.items()} == {n: as_bytes(c) for n, c in two.items()}


@pytest.mark.parametrize("share", [0.1, 0.5, 0.97])
@pytest.mark.parametrize("name", ["asking in the dark", "a door"])
def test_no_part_fails_on_a_log_that_was_cut(logs, name, share, tmp_path):
    data = logs[name].read_bytes()
    cut = tmp_path / "cut.mcap.part"
    cut.write_bytes(data[: int(share * len(data))])
    for content in contents(Run(load(cut))).values():
        check(content)
        as_bytes(content)


STARTED = RunStarted(0.0, "src-dish", "schema = 1\n", 1, 0, 1800.0, "teleop-sim 0.1.0")
SPARSE = {
    "nothing but its start": [STARTED],
    "ended at once": [STARTED, RunEnded(0.0, "failed", "", NAN, 0, 0)],
    "no scenario that can be read": [
        RunStarted(0.0, "mine", "schema = [", 1, 0, 1.0, ""),
        PlantNames(0.0, "a b"),
        PlantSample(0.0, (0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0)),
        RunEnded(5.0, "failed", "", NAN, 0, 0),
    ],
    "a task of another version": [
        RunStarted(0.0, "x", 'schema = 1\nrobot = "gundam"\ntask = "surf"\n', 1, 0, 1.0, ""),
        PlantSample(0.0, (0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0), ()),
        EpisodeEnded(2.0, 0.0, "A", "surf", "", "done", "", 1.0),
        TransitionTaken(2.0, "A", "/E", "B", 0.0, "autonomous", "normal", 0, 1, 3, 0.0, ""),
        PlantSample(3.0, (0.1, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0), ()),
    ],
}


@pytest.mark.parametrize("name", SPARSE)
def test_no_part_fails_on_a_log_that_says_little(name, tmp_path):
    writer = LogWriter(tmp_path / "sparse.mcap")
    for record in SPARSE[name]:
        writer.write(record)
    writer.close()
    for content in contents(Run(load(tmp_path / "sparse.mcap"))).values():
        check(content)
        as_bytes(content)
