"""Others read our logs whole: the ``mcap`` package, Rerun's program, and the reader that Foxglove and Lichtblick use.

Each counts the same messages by topic; Rerun shows transforms, shapes, pictures, clouds and lines as its own types.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from functools import cache
from pathlib import Path

import pytest
from mcap.reader import make_reader
from rerun.chunk import RrdReader

from teleop_sim import load_scenario
from teleop_sim.run import run_scenario

NODE = Path(__file__).with_name("node")
RERUN = Path(sys.executable).with_name("rerun")
SCENARIOS = {"src-dish": 30.0, "drc-door-lab-behaviour": 300.0, "drc-valve-lab-operator": 300.0}
"""Name to time limit [s]: long enough for a picture, or for clouds and an operator's words."""

KEPT = re.compile(
    r"Transform3D:child_frame|EncodedImage:blob|Pinhole:image_from_camera|Points3D:positions|TextLog:text"
    r"|(Boxes|Ellipsoids)3D:half_sizes|Cylinders3D:lengths"
)
"""Rerun's own types, one column of each."""


@pytest.fixture(scope="module")
def log_of(tmp_path_factory):
    """A scenario's log, made once."""
    folder = tmp_path_factory.mktemp("logs")

    @cache
    def make(name: str) -> Path:
        return run_scenario(load_scenario(name, {"time_limit_s": SCENARIOS[name]}), 1, folder).log

    return make


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """Rerun's settings, with its statistics of use switched off, before it is used at all."""
    folder = tmp_path_factory.mktemp("home")
    env = {**os.environ, "HOME": str(folder), "XDG_CONFIG_HOME": str(folder), "XDG_DATA_HOME": str(folder)}
    told(rerun("analytics", "disable", env=env))
    return env


def rerun(*arguments, env):
    assert RERUN.exists(), f"{RERUN} is missing: pip install 'teleop-sim[test]'"
    return subprocess.run([RERUN, *map(str, arguments)], capture_output=True, text=True, env=env, check=False)


def told(done):
    assert done.returncode == 0, done.stderr or done.stdout
    return done.stdout


def counts(path: Path) -> Counter[str]:
    """By the package of the format's authors, checksums and all."""
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        found = Counter(channel.topic for _, channel, _ in reader.iter_messages())
        summary = reader.get_summary()
    by_id = summary.statistics.channel_message_counts
    assert found == {summary.channels[k].topic: count for k, count in by_id.items()}
    return found


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_reader_of_foxglove_and_lichtblick_reads_it_whole(log_of, name):
    assert shutil.which("node"), "node is missing: install nodejs and npm"
    assert (NODE / "node_modules").is_dir(), f"run npm ci in {NODE}, or make setup"
    path, there = log_of(name), counts(log_of(name))
    told_by_node = subprocess.run(
        ["node", "--no-warnings", str(NODE / "read.mjs"), str(path)], capture_output=True, text=True, check=False
    )
    found = json.loads(told(told_by_node))
    assert found["count"] == there
    assert found["streamed"] == there.total()
    assert found["done"]
    # What protobufjs makes of messages that were not made by protobuf's own classes.
    assert len(set(found["moved"])) == len(found["moved"]) > 20
    assert found["moved"][0] == "pelvis"
    assert found["entities"] > 10
    assert "time limit" in found["lastLine"] or "completed" in found["lastLine"]
    with path.open("rb") as stream:
        last_ns = max(m.log_time for _, _, m in make_reader(stream).iter_messages(topics="/tf"))
    assert found["lastMotionS"] == pytest.approx(last_ns * 1e-9, abs=1e-9)
    if name == "src-dish":
        assert found["picture"]["frame"] == "camera"
        assert found["picture"]["format"] == "jpeg"
    else:
        assert found["cloud"]["frame"] == "world"
        assert found["cloud"]["points"] > 20


@pytest.mark.parametrize("name", SCENARIOS)
def test_rerun_finds_nothing_wrong(log_of, home, name):
    report = told(rerun("mcap", "check", "--full", log_of(name), env=home))
    rows = [line.split() for line in report.splitlines() if line.startswith("ok")]
    assert {row[3].lstrip("/") for row in rows} == {topic.lstrip("/") for topic in counts(log_of(name))}
    problems = [line for line in report.splitlines() if re.match(r"(warn|error|fail)", line, re.IGNORECASE)]
    assert problems == []


@pytest.mark.parametrize("name", SCENARIOS)
def test_rerun_counts_the_same(log_of, home, name):
    report = told(rerun("mcap", "info", log_of(name), env=home))
    listed = report[report.index("Channels\n") :].splitlines()
    rows = (re.match(r"\s*\d+\s+(\S+)\s+(\d+)\s", line) for line in listed)
    assert +Counter({row[1]: int(row[2]) for row in rows if row}) == counts(log_of(name))


@pytest.fixture(scope="module")
def shown(log_of, home, tmp_path_factory):
    """What Rerun makes of a log: rows of its own types by entity, and values of some of them."""
    folder = tmp_path_factory.mktemp("rrd")

    @cache
    def convert(name: str) -> dict[str, list]:
        out = folder / f"{name}.rrd"
        told(rerun("mcap", "convert", log_of(name), "-o", out, env=home))
        found: dict[str, list] = {}
        for chunk in RrdReader(out).stream():
            table = chunk.to_record_batch().to_pydict()
            for column, values in table.items():
                if KEPT.fullmatch(column):
                    found.setdefault(column, []).extend(values)
            if any(column.startswith("CoordinateFrame") for column in table) and "visual" in chunk.entity_path:
                found.setdefault("shapes' frames", []).extend(v[0] for v in table["CoordinateFrame:frame"])
        return found

    return convert


@pytest.mark.parametrize("name", SCENARIOS)
def test_rerun_shows_transforms_pictures_clouds_and_lines_by_itself(log_of, shown, name):
    there, found = counts(log_of(name)), shown(name)
    frames = Counter(child for (child,) in found["Transform3D:child_frame"])
    # One row for each message and moving frame; the others once.
    assert set(frames.values()) <= {1, there["/tf"]}
    assert frames["pelvis"] == there["/tf"]
    assert frames["camera"] == 1
    assert sum(1 for count in frames.values() if count == there["/tf"]) > 20 or there["/tf"] == 1
    assert len(found.get("EncodedImage:blob", [])) == there["/camera"]
    assert len(found.get("Pinhole:image_from_camera", [])) == there["/camera_info"]
    assert len(found.get("Points3D:positions", [])) == there["/cloud"]
    assert len(found["TextLog:text"]) == there["/log"]
    # Every shape hangs on a frame that a transform moves, or on the world.
    assert set(found["shapes' frames"]) <= {"world", *frames}
    assert len(found["Boxes3D:half_sizes"]) + len(found["Cylinders3D:lengths"]) > 20
