"""Many logs in one call hold what each holds by itself."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from google.protobuf import descriptor_pb2
from mcap.writer import Writer

import teleop_sim
from teleop_sim.core.errors import LogDamaged, UnknownName
from teleop_sim.core.records import (
    RECORDS,
    Blackout,
    Layer,
    ModeChanged,
    PlantNames,
    PlantSample,
    RunEnded,
    RunStarted,
    Scored,
)
from teleop_sim.log.frames import FRAMES
from teleop_sim.log.gathering import MANIFEST
from teleop_sim.log.load import load
from teleop_sim.log.many import load_many
from teleop_sim.log.schema import SCHEMAS, field_types
from teleop_sim.log.writer import LogWriter
from teleop_sim.sweep.folder import MANIFEST as SWEEP_MANIFEST
from teleop_sim.sweep.folder import SweepFolder

STARTED = RunStarted(0.0, "src-dish", "", 1, 0, 100.0, "1")
ENDED = RunEnded(9.0, "completed", "", 9.0, 1, 2)


def some_records(seed, joints="knee ankle"):
    """One record of each class, and some more."""
    rng = np.random.default_rng(seed)
    yield replace(STARTED, seed=seed)
    yield PlantNames(0.0, joints)
    for i in range(int(rng.integers(2, 9))):
        yield PlantSample(float(i), tuple(rng.normal(size=7)), tuple(rng.normal(size=len(joints.split()))))
        yield ModeChanged(float(i), f"STATE_{seed}", "normal" if i % 2 else "auto")
    values = {float: 1.5 + seed, int: seed, bool: True, str: f"text {seed}", tuple[float, ...]: (1.0, 2.0, 3.0)}
    for topic, cls in sorted(RECORDS.items()):
        if not topic.startswith(("run/", "field/plant")):
            yield cls(**{name: values[hint] for name, hint in field_types(cls).items()})
    yield replace(ENDED, t_s=8.0 + seed)


def written(path, records):
    with LogWriter(path, durable=False) as write:
        for record in records:
            write(record)
    return path


@pytest.fixture
def folder(tmp_path):
    for seed in (3, 1, 2):
        written(tmp_path / "deep" / f"run{seed}.mcap", some_records(seed))
    return tmp_path


@pytest.mark.parametrize("name", [*sorted(FRAMES), "runs", "blackouts"])
def test_a_frame_of_many_is_the_frames_of_each(folder, name):
    logs = teleop_sim.load(folder)
    frame = getattr(logs, name)
    assert frame.columns[0] == "log"
    assert frame["log"].cat.categories.tolist() == [f"deep/run{seed}.mcap" for seed in (1, 2, 3)]
    for seed in (1, 2, 3):
        path = folder / "deep" / f"run{seed}.mcap"
        own = frame[frame["log"] == f"deep/run{seed}.mcap"].drop(columns="log").reset_index(drop=True)
        alone = getattr(load(path), name)
        assert own.columns.tolist() == alone.columns.tolist()
        assert own.astype(object).fillna("none").to_dict("records") == alone.astype(object).fillna("none").to_dict(
            "records"
        )
        assert [str(kind) for kind in own.dtypes] == [str(kind) for kind in alone.dtypes]


def test_samples_of_different_robots(tmp_path):
    written(tmp_path / "a.mcap", some_records(1))
    written(tmp_path / "b.mcap", some_records(2, "knee elbow"))
    logs = load_many(tmp_path)
    assert logs.joints.columns.tolist() == ["log", "knee", "ankle", "elbow"]
    assert logs.joints.index.name == "t"
    assert logs.joints.loc[logs.joints["log"] == "b.mcap", "ankle"].isna().all()
    one = logs.plant[logs.plant["log"] == "b.mcap"]
    assert one["elbow"].tolist() == load(tmp_path / "b.mcap").plant["elbow"].tolist()
    assert len(logs.frame("field/plant")) == len(logs.plant)


def test_what_is_no_log_is_named_and_ends_nothing(folder):
    (folder / "empty.mcap").touch()
    (folder / "text.mcap").write_text("no log")
    (folder / "notes.txt").write_text("not looked at")
    whole = (folder / "deep" / "run1.mcap").read_bytes()
    (folder / "cut.mcap.part").write_bytes(whole[:2600])
    (folder / "deep" / "run1.mcap.part").write_bytes(whole)
    logs = load_many([folder, folder / "missing.mcap"])
    assert [(problem.where.rsplit("/", 1)[1], problem.what.split(";")[0]) for problem in logs.problems] == [
        ("run1.mcap.part", "left out: there is a finished log of that name"),
        ("empty.mcap", "empty"),
        ("text.mcap", "not an MCAP file"),
        ("missing.mcap", "no such file"),
    ]
    assert [member.whole for member in logs.members] == [False, True, True, True]
    assert logs.runs.set_index("log")["interrupted"].tolist() == [True, False, False, False]


def test_an_unfinished_run_is_told(tmp_path):
    written(tmp_path / "a.mcap", [STARTED, PlantSample(7.25, (), ())])
    written(tmp_path / "b.mcap", [STARTED, ENDED])
    runs = load_many(tmp_path).runs
    assert runs["interrupted"].tolist() == [True, False]
    assert runs["end_s"].tolist() == [7.25, 9.0]
    assert runs["outcome"].isna().tolist() == [True, False]


def test_blackouts_of_one_log_do_not_run_into_the_next(tmp_path):
    written(tmp_path / "a.mcap", [STARTED, Blackout(1.0, "up", True)])
    written(
        tmp_path / "b.mcap",
        [STARTED, Blackout(2.0, "up", False), Blackout(3.0, "up", True), Blackout(5.0, "up", False)],
    )
    frame = load_many(tmp_path).blackouts
    assert frame["log"].tolist() == ["a.mcap", "b.mcap"]
    assert frame["took"].tolist() == [pd.NaT, pd.Timedelta(seconds=2)]


def test_a_directory_without_logs(tmp_path):
    with pytest.raises(LogDamaged, match="no log in this directory"):
        load(tmp_path)
    (tmp_path / "text.mcap").write_text("no log")
    with pytest.raises(LogDamaged, match=r"no log in this directory \(text.mcap: not an MCAP"):
        load(tmp_path)
    with pytest.raises(LogDamaged, match="no log in this list"):
        load([])


def a_sweep(path, factors, cells):
    folder = SweepFolder(path)
    for cell in range(len(cells)):
        for replicate in range(2):
            run = [replace(STARTED, replicate=replicate), Layer(5.0, 1.0, "template", ""), ENDED]
            written(folder.log(cell, replicate), run)
    told = {"factors": [{"name": name} for name in factors], "cells": cells, "replicates": 2}
    folder.manifest.write_text(json.dumps(told))
    return path


def test_a_sweep_s_logs_have_its_factors(tmp_path):
    assert MANIFEST == SWEEP_MANIFEST
    cells = [["behaviour", 380.0], ["template", 64.0]]
    logs = teleop_sim.load(a_sweep(tmp_path, ["layer", "uplink_bps"], cells))
    assert logs.runs.columns.tolist()[:6] == ["log", "cell", "replicate", "layer", "uplink_bps", "scenario"]
    assert logs.runs[["cell", "replicate", "layer", "uplink_bps"]].to_numpy().tolist() == [
        [0, 0, "behaviour", 380.0],
        [0, 1, "behaviour", 380.0],
        [1, 0, "template", 64.0],
        [1, 1, "template", 64.0],
    ]
    assert logs.layers.columns.tolist()[:5] == ["log", "cell", "replicate", "cell_layer", "uplink_bps"]
    assert str(logs.layers["cell_layer"].dtype) == "category"
    assert logs.layers["took"].eq(pd.Timedelta(seconds=4)).all()
    assert logs.columns("layers").set_index("column").loc["uplink_bps", "unit"] == "bit/s"


def test_a_sweep_whose_manifest_does_not_read(tmp_path):
    a_sweep(tmp_path, ["layer"], [["template"]])
    (tmp_path / MANIFEST).write_text("{")
    logs = load_many(tmp_path)
    assert len(logs) == 2
    assert "loaded without their factors" in logs.problems[0].hint


def test_logs_of_other_versions_together(tmp_path):
    """An older file lacks a field, and numbers them otherwise: each is read by its own schema."""
    proto = descriptor_pb2.FileDescriptorProto(name="x.proto", package="teleop_sim", syntax="proto3")
    message = proto.message_type.add(name="Scored")
    for number, (name, kind) in enumerate((("text", 9), ("t_s", 1)), start=1):
        message.field.add(name=name, number=number, type=kind, label=1)
    schema = descriptor_pb2.FileDescriptorSet(file=[proto]).SerializeToString()
    for name, data in (("b", b"\x0a\x02up\x11\0\0\0\0\0\0\x08\x40"), ("c", b"\x0a\x03off")):
        with (tmp_path / f"{name}.mcap").open("wb") as stream:
            writer = Writer(stream)
            writer.start()
            made = writer.register_schema("teleop_sim.Scored", "protobuf", schema)
            writer.add_message(writer.register_channel("task/score", "protobuf", made), 0, data, 0)
            writer.finish()
    for name in ("a", "d"):
        written(tmp_path / f"{name}.mcap", [STARTED, Scored(1.0, 7, "on")])
    scores = load_many(tmp_path).scores
    assert scores[["t_s", "checkpoint", "text"]].to_numpy().tolist() == [
        [1.0, 7, "on"],
        [3.0, 0, "up"],
        [0.0, 0, "off"],
        [1.0, 7, "on"],
    ]


def test_a_log_with_a_record_that_does_not_fit_is_left_out_and_named(tmp_path):
    with (tmp_path / "bad.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        made = writer.register_schema("teleop_sim.Scored", "protobuf", SCHEMAS["task/score"].data)
        writer.add_message(writer.register_channel("task/score", "protobuf", made), 0, b"\xff\xff", 0)
        writer.finish()
    written(tmp_path / "good.mcap", [STARTED, Scored(1.0, 7, "on")])
    logs = load_many(tmp_path)
    assert logs.scores["log"].tolist() == ["good.mcap"]
    assert [problem.where.endswith("bad.mcap") for problem in logs.problems] == [True]
    assert "task/score" in logs.problems[0].what


def test_one_of_many_by_itself(folder):
    logs = load_many(folder)
    assert len(logs) == 3
    assert [log.path.name for log in logs] == ["run1.mcap", "run2.mcap", "run3.mcap"]
    with pytest.raises(UnknownName):
        logs.frame("no/topic")
