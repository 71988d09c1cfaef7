"""Frames hold what the records hold, whatever wrote the file; ``records()`` goes through protobuf itself."""

from __future__ import annotations

import math
import struct
from dataclasses import fields, replace

import numpy as np
import pandas as pd
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from mcap.writer import Writer

from teleop_sim.core.errors import LogDamaged, UnknownName
from teleop_sim.core.records import (
    RECORDS,
    Blackout,
    Claimed,
    Layer,
    ModeChanged,
    PacketEnded,
    PlantNames,
    PlantSample,
    RunEnded,
    RunStarted,
    Scored,
)
from teleop_sim.log import columns
from teleop_sim.log.frames import FRAMES
from teleop_sim.log.load import load
from teleop_sim.log.schema import SCHEMAS, field_types
from teleop_sim.log.tidy import PARTS, free_fields, tidy
from teleop_sim.log.writer import LogWriter

VALUES = {
    float: st.floats(),
    int: st.integers(-(2**63), 2**63 - 1),
    bool: st.booleans(),
    str: st.one_of(st.sampled_from(["", "a", "STATE_INIT", "STATE_INIT_2", "é\0π"]), st.text()),
    tuple[float, ...]: st.lists(st.floats(), max_size=9).map(tuple),
}
RELAXED = settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def any_record(topic):
    values = {name: VALUES[hint] for name, hint in field_types(RECORDS[topic]).items()}
    return st.builds(RECORDS[topic], **{**values, "t_s": st.floats(0.0, 1e6)})


def bits(value):
    """Floats by their bits, but any NaN equals any other."""
    if isinstance(value, tuple):
        return tuple(bits(v) for v in value)
    return "nan" if isinstance(value, float) and math.isnan(value) else repr(value)


def written(path, records):
    with LogWriter(path, durable=False) as log:
        for record in records:
            log(record)
    return load(path)


def compare(log, topic):
    """A frame against the records of the same log, cell by cell."""
    frame, records = log.frame(topic), list(log.records(topic))
    assert len(frame) == len(records)
    for field in fields(RECORDS[topic]):
        values = [getattr(record, field.name) for record in records]
        if field.name in PARTS:
            names = PARTS[field.name]
            found = frame[list(names)].itertuples(index=False, name=None)
            values = [(*value[: len(names)], *[math.nan] * (len(names) - len(value))) for value in values]
        else:
            found = frame[field.name].tolist()
        assert [bits(value) for value in found] == [bits(value) for value in values]


@pytest.mark.parametrize("topic", sorted(RECORDS))
@RELAXED
@given(data=st.data())
def test_a_frame_holds_its_records(tmp_path, topic, data):
    others = st.sampled_from(sorted(RECORDS)).flatmap(any_record)
    log = written(tmp_path / "any.mcap", data.draw(st.lists(st.one_of(any_record(topic), others), min_size=1)))
    compare(log, topic)
    assert log.frame(topic)["t"].tolist() == [pd.Timedelta(round(r.t_s * 1e9), unit="ns") for r in log.records(topic)]


@pytest.mark.parametrize("topic", sorted(RECORDS))
@RELAXED
@given(data=st.data())
def test_the_fast_way_and_the_way_through_records_give_the_same_frame(tmp_path, topic, data):
    records = data.draw(st.lists(any_record(topic), min_size=1))
    fast = written(tmp_path / "any.mcap", records).frame(topic)
    times_ns = np.array([round(r.t_s * 1e9) for r in records])
    slow = tidy(topic, columns.columns_from(topic, records), times_ns)
    assert [str(kind) for kind in fast.dtypes] == [str(kind) for kind in slow.dtypes]
    for name in slow:
        assert [bits(value) for value in fast[name].tolist()] == [bits(value) for value in slow[name].tolist()]


def foreign(path, topic, schema, messages, name):
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        made = writer.register_schema(f"teleop_sim.{name}", "protobuf", schema)
        channel = writer.register_channel(topic, "protobuf", made)
        for number, message in enumerate(messages):
            writer.add_message(channel, number, message, number)
        writer.finish()
    return load(path)


@st.composite
def other_versions(draw):
    """A class of ours as another version might declare it: other numbers, more and fewer fields, another kind."""
    topic = draw(st.sampled_from(sorted(RECORDS)))
    cls = RECORDS[topic]
    kinds = {float: (1, False), int: (3, False), bool: (8, False), str: (9, False), tuple[float, ...]: (1, True)}
    ours = [(name, *kinds[hint]) for name, hint in field_types(cls).items() if draw(st.booleans())]
    extra = draw(st.lists(st.sampled_from([1, 2, 3, 4, 5, 6, 7, 8, 9, 12, 13, 15, 16, 17, 18]), max_size=4))
    theirs = ours + [(f"new_{i}", kind, draw(st.booleans())) for i, kind in enumerate(extra)]
    if ours and draw(st.booleans()):
        theirs[0] = (theirs[0][0], draw(st.sampled_from([2, 5, 9, 12])), False)
    numbers = draw(st.lists(st.integers(1, 400), min_size=len(theirs), max_size=len(theirs), unique=True))
    proto = descriptor_pb2.FileDescriptorProto(name="x.proto", package="teleop_sim", syntax="proto3")
    message = proto.message_type.add(name=cls.__name__)
    for (name, kind, repeated), number in zip(theirs, numbers, strict=True):
        message.field.add(name=name, number=number, type=kind, label=3 if repeated else 1)
    return topic, proto


def some_value(kind):
    floats, texts, blobs = st.floats(width=32), st.text(max_size=5), st.binary(max_size=5)
    return {1: st.floats(), 2: floats, 8: st.booleans(), 9: texts, 12: blobs}.get(kind, st.integers(0, 2**31 - 1))


@settings(RELAXED, max_examples=60)
@given(version=other_versions(), data=st.data())
def test_other_versions_read_by_name_as_records_do(tmp_path, version, data):
    topic, proto = version
    pool = descriptor_pool.DescriptorPool()
    pool.Add(proto)
    declared = proto.message_type[0]
    made = message_factory.GetMessageClass(pool.FindMessageTypeByName(f"teleop_sim.{declared.name}"))
    messages = []
    for _ in range(data.draw(st.integers(1, 4))):
        values = {
            f.name: data.draw(st.lists(some_value(f.type), max_size=3) if f.label == 3 else some_value(f.type))
            for f in declared.field
        }
        messages.append(made(**values).SerializeToString())
    schema = descriptor_pb2.FileDescriptorSet(file=[proto]).SerializeToString()
    compare(foreign(tmp_path / "other.mcap", topic, schema, messages, declared.name), topic)


def tag(number, wire):
    return bytes([number << 3 | wire])


PIECES = st.one_of(
    st.binary(max_size=6),
    st.tuples(st.integers(0, 15), st.integers(0, 7)).map(lambda t: tag(*t)),
    st.tuples(st.integers(1, 15), st.floats()).map(lambda t: tag(t[0], 1) + struct.pack("<d", t[1])),
    st.tuples(st.integers(1, 15), st.binary(max_size=9)).map(lambda t: tag(t[0], 2) + bytes([len(t[1])]) + t[1]),
    st.tuples(st.integers(1, 15), st.integers(0, 127)).map(lambda t: tag(t[0], 0) + bytes([t[1]])),
    st.tuples(st.integers(1, 15), st.lists(st.integers(128, 255), min_size=8, max_size=10), st.integers(0, 3)).map(
        lambda t: tag(t[0], 0) + bytes(t[1]) + bytes([t[2]])
    ),
)


@settings(RELAXED, max_examples=150)
@given(topic=st.sampled_from(sorted(RECORDS)), pieces=st.lists(PIECES, max_size=6))
@example(topic="field/claim", pieces=[b"\x80\x80\x80\x80", b"\x10\x00"])  # a tag of 33 bits
@example(topic="field/claim", pieces=[b"\xf8\xff\xff\xff\x0f\x00"])  # the greatest of 32
def test_any_bytes_mean_what_protobuf_says_or_are_damage(tmp_path, topic, pieces):
    """Also bytes that no writer makes: fields twice, of the wrong kind, cut off, groups, overlong numbers."""
    schema = SCHEMAS[topic]
    good = schema.encode(RECORDS[topic](**{n: SAMPLE[h] for n, h in field_types(RECORDS[topic]).items()}))
    log = foreign(tmp_path / "any.mcap", topic, schema.data, [good, b"".join(pieces), good], RECORDS[topic].__name__)
    try:
        list(log.records(topic))
    except LogDamaged:
        with pytest.raises(LogDamaged, match="does not fit its schema"):
            log.frame(topic)
    else:
        compare(log, topic)


SAMPLE = {float: -0.0, int: -1, bool: True, str: "x", tuple[float, ...]: (1.0, math.nan)}


def test_what_our_own_writer_writes_never_takes_the_slow_way(tmp_path, monkeypatch):
    def refuse(*_):
        raise AssertionError

    monkeypatch.setattr("teleop_sim.log.store.columns_from", refuse)
    for topic, cls in sorted(RECORDS.items()):
        record = cls(**{n: SAMPLE[h] for n, h in field_types(cls).items()} | {"t_s": 1.0})
        assert len(written(tmp_path / "one.mcap", [record] * 3).frame(topic)) == 3


def test_an_empty_log_has_every_frame_with_its_types(tmp_path):
    started = RunStarted(0.0, "src-dish", "", 1, 0, 100.0, "")
    log = written(tmp_path / "a.mcap", [started])
    for name in (*FRAMES, "blackouts", "plant", "joints"):
        frame = getattr(log, name)
        assert len(frame) == 0
        assert "t" in (*frame.columns, frame.index.name)
        assert all(str(frame[c].dtype) == "timedelta64[ns]" for c in ("t", "took") if c in frame)
    assert [str(kind) for kind in log.layers.dtypes] == [
        "float64",
        "timedelta64[ns]",
        "float64",
        "timedelta64[ns]",
        "category",
        "str",
    ]


def packet(t_s, **changes):
    sample = {float: 0.0, int: 0, bool: False, str: ""}
    made = PacketEnded(**{n: sample[h] for n, h in field_types(PacketEnded).items()})
    return replace(made, t_s=t_s, **changes)


def test_text_of_few_kinds_is_categorical_and_free_text_is_text(tmp_path):
    packets = [packet(float(i), direction=d, text=f"no. {i}") for i, d in enumerate(("up", "down", "up"))]
    frame = written(tmp_path / "a.mcap", packets).packets
    assert frame["direction"].cat.categories.tolist() == ["down", "up"]
    assert str(frame["text"].dtype) == "str"
    assert frame.groupby("direction")["t"].max().to_dict() == {
        "down": pd.Timedelta(seconds=1),
        "up": pd.Timedelta(seconds=2),
    }


def test_a_column_of_more_kinds_than_expected_is_whole(tmp_path):
    states = [f"STATE_{i % 1500}" for i in range(4000)]
    log = written(tmp_path / "a.mcap", [ModeChanged(float(i), state, "normal") for i, state in enumerate(states)])
    assert log.modes["state"].tolist() == states
    assert log.modes["state"].cat.categories.tolist() == sorted(set(states))


def test_times_are_the_log_s_to_the_nanosecond(tmp_path):
    log = written(tmp_path / "a.mcap", [Layer(1.234567891, 0.2, "template", ""), Layer(2.0, math.nan, "x", "")])
    assert log.layers["t"].astype("int64").tolist() == [1_234_567_891, 2_000_000_000]
    assert log.layers["took"].iloc[0] == pd.Timedelta(1_034_567_891, unit="ns")
    assert log.layers["took"].isna().tolist() == [False, True]


def test_joints_are_a_column_each_by_time(tmp_path):
    samples = [PlantSample(float(i), (0.0,) * 7, (i / 10, -i / 10)) for i in range(5)]
    log = written(tmp_path / "a.mcap", [PlantNames(0.0, "knee ankle"), *samples])
    assert log.joints.columns.tolist() == ["knee", "ankle"]
    assert log.joints.index.name == "t"
    assert log.joints.loc[pd.Timedelta(seconds=3)].tolist() == [0.3, -0.3]
    assert log.joints.resample("2s").mean()["knee"].tolist() == pytest.approx([0.05, 0.25, 0.4])
    assert log.plant["knee"].tolist() == log.joints["knee"].tolist()


def test_samples_with_too_few_or_too_many_joints(tmp_path):
    samples = [PlantSample(float(n), (1.0,) * n, tuple(range(n))) for n in (1, 4, 9)]
    plant = written(tmp_path / "a.mcap", [PlantNames(0.0, "knee ankle"), *samples]).plant
    assert plant.columns.tolist()[8:12] == ["knee", "ankle", "joint_2", "joint_3"]
    assert plant["ankle"].isna().tolist() == [True, False, False]
    assert plant["joint_8"].isna().tolist() == [True, True, False]
    assert plant["pelvis_qz"].isna().tolist() == [True, True, False]


def test_claims_by_coordinate(tmp_path):
    claims = written(tmp_path / "a.mcap", [Claimed(1.0, "s", "e", 7, "yaw_wheel", (1, 2, 3), (1, 2, 4), 1.0)]).claims
    off_m = (
        claims[["claimed_x_m", "claimed_y_m", "claimed_z_m"]].to_numpy()
        - claims[["true_x_m", "true_y_m", "true_z_m"]].to_numpy()
    )
    assert off_m.tolist() == [[0.0, 0.0, -1.0]]


def test_blackouts_have_their_times(tmp_path):
    changes = [(1.0, "up", True), (2.0, "up", True), (2.5, "down", True), (4.0, "up", False), (5.0, "up", False)]
    frame = written(tmp_path / "a.mcap", [Blackout(*change) for change in changes]).blackouts
    assert frame["direction"].tolist() == ["up", "down"]
    assert frame["t"].tolist() == [pd.Timedelta(seconds=1), pd.Timedelta(seconds=2.5)]
    assert frame["took"].iloc[0] == pd.Timedelta(seconds=3)
    assert frame["took"].isna().tolist() == [False, True]


def test_a_topic_that_is_none(tmp_path):
    log = written(tmp_path / "a.mcap", [Scored(1.0, 1, "x"), RunEnded(1.0, "completed", "", 1.0, 0, 0)])
    with pytest.raises(UnknownName, match="Did you mean 'link/packet'"):
        log.frame("link/packets")


def test_free_fields_are_fields():
    named = {name for topic, cls in RECORDS.items() for name in free_fields(topic) & set(field_types(cls))}
    assert named == {"text", "note", "cause", "scenario_toml", "versions", "command"}
