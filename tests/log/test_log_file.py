"""What the log promises: every record comes back, the same run gives the same bytes, a cut loses only what follows."""

import hashlib
import math
import os
import signal
import subprocess
import sys
from dataclasses import fields

import numpy as np
import pandas as pd
import pytest
from google.protobuf import descriptor_pb2
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer

from teleop_sim.core.errors import BadInput, LogDamaged
from teleop_sim.core.records import (
    LATE_TOPICS,
    RECORDS,
    Blackout,
    MessageEnded,
    PlantNames,
    PlantSample,
    Record,
    RunEnded,
    RunStarted,
    Scored,
    Waited,
)
from teleop_sim.log.load import load
from teleop_sim.log.schema import SCHEMAS, field_types
from teleop_sim.log.writer import LogWriter

VALUES = {
    float: st.floats(),
    int: st.integers(-(2**63), 2**63 - 1),
    bool: st.booleans(),
    str: st.text(),
    tuple[float, ...]: st.lists(st.floats(), max_size=50).map(tuple),
}
STARTED = RunStarted(0.0, "src-dish", "schema = 1\n", 1, 0, 1800.0, "teleop-sim 0.1.0")
ENDED = RunEnded(100.0, "completed", "", 99.5, 3, 7)


def bits(value):
    """Compare floats by their bits, but any NaN equals any other."""
    if isinstance(value, tuple):
        return tuple(bits(v) for v in value)
    if isinstance(value, float):
        return "nan" if math.isnan(value) else value.hex()
    return value


def same(a, b):
    return type(a) is type(b) and all(bits(getattr(a, f.name)) == bits(getattr(b, f.name)) for f in fields(a))


def any_record(cls):
    values = {name: VALUES[hint] for name, hint in field_types(cls).items()}
    return st.builds(cls, **{**values, "t_s": st.floats(0.0, 1e6)})


def a_run(n=3000):
    """Records of about 300 kB: some five chunks; a late topic from the middle on."""
    rng = np.random.default_rng(3)
    yield STARTED
    yield PlantNames(0.0, "leftKneePitch rightKneePitch")
    for i in range(n):
        t_s = i * 100.0 / n
        yield PlantSample(t_s, tuple(rng.normal(size=7)), tuple(rng.normal(size=2)))
        if i % 10 == 0:
            yield Waited(t_s, max(t_s - 1.0, 0.0), "STATE_INIT", "pacing", f"poll {i}")
        if i % 20 == 0 and i >= n // 2:
            yield MessageEnded(t_s, "up", i, "chat", 18, 0.0, t_s, *[0.0] * 5, 1, "delivered", "", "")
    yield ENDED


def test_a_topic_that_came_late_leaves_no_trace_in_a_log_without_it(tmp_path):
    """Logs of runs without such records keep the bytes that they had before the topic was invented."""
    others = [r for r in a_run(300) if not isinstance(r, MessageEnded)]
    assert all(topic.encode() not in written(tmp_path / "a.mcap", others).read_bytes() for topic in LATE_TOPICS)
    with (tmp_path / "a.mcap").open("rb") as stream:
        topics = [c.topic for c in make_reader(stream).get_summary().channels.values()]
    assert topics == [topic for topic in sorted(RECORDS) if topic not in LATE_TOPICS]


def written(path, records):
    with LogWriter(path) as log:
        for record in records:
            log(record)
    return path


def breaking(records, error):
    yield from records
    raise error


@pytest.mark.parametrize("topic", sorted(RECORDS))
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_every_record_comes_back(topic, data):
    record = data.draw(any_record(RECORDS[topic]))
    schema = SCHEMAS[topic]
    assert same(schema.decode(schema.encode(record)), record)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.sampled_from(sorted(RECORDS)).flatmap(lambda topic: any_record(RECORDS[topic])), min_size=1))
def test_a_file_gives_back_what_was_written(tmp_path_factory, records):
    path = written(tmp_path_factory.mktemp("log") / "any.mcap", records)
    back = list(load(path).records())
    assert len(back) == len(records)
    assert all(same(a, b) for a, b in zip(back, records, strict=True))


def test_same_records_same_bytes(tmp_path):
    one, two = (written(tmp_path / f"{name}.mcap", a_run()).read_bytes() for name in ("a", "b"))
    assert one == two


def test_another_process_writes_the_same_bytes(tmp_path):
    mine = hashlib.sha256(written(tmp_path / "mine.mcap", (STARTED, Scored(1.0, 1, "π"), ENDED)).read_bytes())
    program = (
        "import sys; from teleop_sim.log.writer import LogWriter\n"
        "from teleop_sim.core.records import *\n"
        "with LogWriter(sys.argv[1]) as log:\n"
        f"    for r in ({STARTED!r}, Scored(1.0, 1, 'π'), {ENDED!r}): log(r)\n"
    )
    theirs = tmp_path / "theirs.mcap"
    env = {**os.environ, "PYTHONHASHSEED": "12345"}
    subprocess.run([sys.executable, "-c", program, str(theirs)], check=True, env=env)
    assert hashlib.sha256(theirs.read_bytes()).digest() == mine.digest()


def test_the_stock_reader_reads_it(tmp_path):
    """An independent implementation of the format, with the declared times and an index that holds."""
    records = list(a_run(500))
    with written(tmp_path / "a.mcap", records).open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        messages = list(reader.iter_messages(log_time_order=False))
        summary = reader.get_summary()
        assert reader.get_header().library == "teleop-sim"
    assert [m.sequence for _, _, m in messages] == list(range(1, len(records) + 1))
    assert [m.log_time for _, _, m in messages] == [round(r.t_s * 1e9) for r in records]
    # Late topics come behind, where they are first used.
    early = sorted(set(RECORDS) - LATE_TOPICS)
    assert [c.topic for c in summary.channels.values()] == [*early, "link/message"]
    assert all(s.encoding == "protobuf" for s in summary.schemas.values())


def test_cut_anywhere_it_reads_up_to_the_cut(tmp_path):
    whole = written(tmp_path / "whole.mcap", a_run()).read_bytes()
    records = list(a_run())
    cut_path, lengths = tmp_path / "cut.mcap.part", []
    rng = np.random.default_rng(11)
    for size in sorted([0, 1, 7, 8, 9, len(whole) - 1, *rng.integers(0, len(whole), 25)]):
        cut_path.write_bytes(whole[:size])
        try:
            log = load(cut_path)
        except LogDamaged:
            back = []
        else:
            back = list(log.records())
            assert not log.whole
            assert log.interrupted == (len(back) < len(records))
            assert len(log.runs) == 1
        assert all(same(a, b) for a, b in zip(back, records, strict=False))
        lengths.append(len(back))
    assert lengths == sorted(lengths)
    assert lengths[-1] == len(records)
    assert len(set(lengths)) > 4  # the cuts fell into several chunks


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_damaged_byte_never_surprises(tmp_path, data):
    path = tmp_path / "damaged.mcap"
    if not path.exists():
        written(path, a_run(400))
    good = bytearray(path.read_bytes())
    good[data.draw(st.integers(0, len(good) - 1))] ^= data.draw(st.integers(1, 255))
    other = tmp_path / "other.mcap"
    other.write_bytes(good)
    try:
        log = load(other)
        assert sum(1 for _ in log.records()) <= len(list(a_run(400)))
        assert len(log.runs) == 1
    except LogDamaged:
        pass


def test_a_killed_process_leaves_a_readable_part(tmp_path):
    program = (
        "import os, signal, sys; from teleop_sim.log.writer import LogWriter\n"
        "from teleop_sim.core.records import *\n"
        "log = LogWriter(sys.argv[1])\n"
        f"log({STARTED!r})\n"
        "for i in range(100): log(Scored(float(i), i, 'x'))\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    path = tmp_path / "killed.mcap"
    done = subprocess.run([sys.executable, "-c", program, str(path)], check=False)
    assert done.returncode == -signal.SIGKILL
    with pytest.raises(LogDamaged, match=r"killed\.mcap\.part"):
        load(path)
    log = load(tmp_path / "killed.mcap.part")
    assert log.interrupted
    assert log.end_s >= 99.0 - 30.0


def test_an_interruption_finishes_the_file(tmp_path):
    path = tmp_path / "run.mcap"
    with pytest.raises(KeyboardInterrupt):
        written(path, breaking([STARTED, Scored(2.0, 1, "one")], KeyboardInterrupt))
    assert not (tmp_path / "run.mcap.part").exists()
    back = load(path)
    assert back.whole
    assert back.interrupted
    assert back.runs.interrupted[0]
    assert back.runs.outcome.isna()[0]
    assert back.end_s == 2.0


class Stops:
    """A file that is interrupted in the middle of its n-th write."""

    def __init__(self, stream, n):
        self.stream, self.n = stream, n

    def write(self, data):
        self.n -= 1
        if self.n == 0:
            self.stream.write(data[: len(data) // 2])
            raise KeyboardInterrupt
        return self.stream.write(data)

    def __getattr__(self, name):
        return getattr(self.stream, name)


@pytest.mark.parametrize("n", range(1, 14))
def test_an_interruption_in_the_middle_of_a_chunk_loses_nothing(tmp_path, n):
    path = tmp_path / "run.mcap"
    log = LogWriter(path)
    log._mcap.stream = Stops(log._stream, n)
    records = [STARTED, *(Scored(float(i), i, "x" * i) for i in range(100)), ENDED]
    done = 0
    try:
        for record in records:
            done += 1
            log(record)
        log.close()
    except KeyboardInterrupt:
        log.interrupt()
    back = list(load(path).records())
    assert back == records[:done]
    assert [p.name for p in tmp_path.iterdir()] == ["run.mcap"]


def test_an_error_leaves_the_part(tmp_path):
    with pytest.raises(ZeroDivisionError):
        written(tmp_path / "run.mcap", breaking([STARTED], ZeroDivisionError))
    assert [p.name for p in tmp_path.iterdir()] == ["run.mcap.part"]
    assert list(load(tmp_path / "run.mcap.part").records()) == [STARTED]


def test_what_is_no_log_says_why(tmp_path):
    (tmp_path / "empty.mcap").touch()
    (tmp_path / "text.mcap").write_text("not a log\n")
    with (tmp_path / "foreign.mcap").open("wb") as stream:
        Writer(stream).start()
    for name, why in {
        "empty.mcap": "empty",
        "text.mcap": "not an MCAP",
        "foreign.mcap": "cut off",
        "missing.mcap": "no such file",
        "": "directory",
    }.items():
        with pytest.raises(LogDamaged, match=why):
            load(tmp_path / name)


def test_an_mcap_of_others_is_no_log(tmp_path):
    with (tmp_path / "foreign.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("/odom", "json", 0)
        writer.add_message(channel, 0, b"{}", 0)
        writer.finish()
    with pytest.raises(LogDamaged, match="none of its topics"):
        load(tmp_path / "foreign.mcap")


def other_version(path, schema, message):
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        made = writer.register_schema("teleop_sim.Scored", "protobuf", schema)
        channel = writer.register_channel("task/score", "protobuf", made)
        unknown = writer.register_channel("task/smell", "protobuf", made)
        writer.add_message(channel, 0, message, 0)
        writer.add_message(unknown, 1, message, 1)
        writer.finish()


def test_a_later_version_with_more_fields_still_loads(tmp_path):
    """A field in front of the others shifts their numbers; a topic is new; one of our fields is gone."""
    proto = descriptor_pb2.FileDescriptorProto(name="x.proto", package="teleop_sim", syntax="proto3")
    message = proto.message_type.add(name="Scored")
    for number, (name, kind) in enumerate((("colour", 9), ("t_s", 1), ("text", 9)), start=1):
        message.field.add(name=name, number=number, type=kind, label=1)
    schema = descriptor_pb2.FileDescriptorSet(file=[proto]).SerializeToString()
    other_version(tmp_path / "new.mcap", schema, b"\x0a\x03red\x11\0\0\0\0\0\0\x08\x40\x1a\x02up")
    assert list(load(tmp_path / "new.mcap").records()) == [Scored(3.0, 0, "up")]


def test_records_that_do_not_fit_their_schema_are_damage(tmp_path):
    other_version(tmp_path / "a.mcap", b"\xff\xff", b"")
    with pytest.raises(LogDamaged, match="schema"):
        load(tmp_path / "a.mcap")
    other_version(tmp_path / "b.mcap", SCHEMAS["task/score"].data, b"\xff\xff\xff")
    with pytest.raises(LogDamaged, match="does not fit"):
        list(load(tmp_path / "b.mcap").records())


def test_only_registered_records_and_open_logs(tmp_path):
    log = LogWriter(tmp_path / "run.mcap")
    with pytest.raises(TypeError, match="no registered record"):
        log(Record(0.0))
    log(STARTED)
    log.close()
    log.close()
    with pytest.raises(ValueError, match="finished"):
        log(ENDED)


def test_frames_are_tidy(tmp_path):
    records = [
        STARTED,
        PlantNames(0.0, "knee ankle"),
        PlantSample(0.5, (1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0), (0.1, 0.2)),
        Blackout(1.0, "down", True),
        Blackout(4.0, "down", False),
        Blackout(5.0, "up", True),
        ENDED,
    ]
    log = load(written(tmp_path / "run.mcap", records))
    assert log.runs.to_dict("records")[0] == {
        "scenario": "src-dish",
        "seed": 1,
        "replicate": 0,
        "time_limit_s": 1800.0,
        "versions": "teleop-sim 0.1.0",
        "outcome": "completed",
        "cause": "",
        "completion_time_s": 99.5,
        "round_trips": 3,
        "operator_acts": 7,
        "interrupted": False,
        "end_s": 100.0,
        "t": pd.Timedelta(seconds=100),
    }
    assert log.plant.to_dict("records") == [
        {
            "t_s": 0.5,
            **dict(zip(("pelvis_x", "pelvis_y", "pelvis_z"), (1.0, 2.0, 3.0), strict=True)),
            **dict(zip(("pelvis_qw", "pelvis_qx", "pelvis_qy", "pelvis_qz"), (1.0, 0.0, 0.0, 0.0), strict=True)),
            "knee": 0.1,
            "ankle": 0.2,
        }
    ]
    assert log.blackouts.direction.tolist() == ["down", "up"]
    assert log.blackouts.end_s.tolist()[0] == 4.0
    assert math.isnan(log.blackouts.end_s.tolist()[1])
    assert log.scenario_toml == "schema = 1\n"


FRAMES = {
    "packets": "link/packet",
    "transitions": "machine/transition",
    "modes": "machine/mode",
    "requests": "machine/request",
    "released": "machine/released",
    "acts": "operator/act",
    "episodes": "field/episode",
    "waits": "field/wait",
    "scores": "task/score",
}


@pytest.mark.parametrize("name", sorted(FRAMES))
def test_frames_have_their_columns_even_when_empty(tmp_path, name):
    empty = getattr(load(written(tmp_path / "run.mcap", [STARTED])), name)
    cls = RECORDS[FRAMES[name]]
    fields = [["t_s", "t"] if n == "t_s" else ["start_s", "took"] if n == "start_s" else [n] for n in field_types(cls)]
    assert list(empty.columns) == [n for names in fields for n in names]
    sample = cls(**{n: {float: 1.5, int: 2, bool: True, str: "x"}[h] for n, h in field_types(cls).items()})
    full = getattr(load(written(tmp_path / "run.mcap", [STARTED, sample])), name)
    times = {"t": pd.Timedelta(seconds=1.5)} | ({"took": pd.Timedelta(0)} if "took" in full else {})
    assert full.to_dict("records") == [vars(sample) | times]
    assert [str(kind) for kind in full.dtypes] == [str(kind) for kind in empty.dtypes]


def test_two_writers_of_one_log_do_not_mix(tmp_path):
    path = tmp_path / "run.mcap"
    first = LogWriter(path)
    with pytest.raises(BadInput, match=r"run\.mcap\.part: another run is writing it"):
        LogWriter(path)
    first.write(STARTED)
    first.close()
    assert list(load(path).records()) == [STARTED]
    with LogWriter(path) as second:
        second.write(STARTED)
    assert [p.name for p in tmp_path.iterdir()] == ["run.mcap"]


def test_what_a_killed_run_left_is_written_over(tmp_path):
    path = tmp_path / "run.mcap"
    (tmp_path / "run.mcap.part").write_bytes(b"x" * 1_000_000)
    with LogWriter(path) as writer:
        writer.write(STARTED)
    assert list(load(path).records()) == [STARTED]
    assert path.stat().st_size < 1_000_000


def test_a_full_disk_names_the_file(tmp_path):
    code = f"""
import resource
from pathlib import Path
from teleop_sim.core.records import ModeChanged
from teleop_sim.log.writer import LogWriter
writer = LogWriter(Path({str(tmp_path)!r}) / "run.mcap")
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
try:
    for i in range(200_000):
        writer.write(ModeChanged(float(i), str(i * 7919), "normal"))
except OSError as error:
    print(error.filename)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == (f"{tmp_path / 'run.mcap.part'}\n", "")


def test_a_device_is_no_log():
    with pytest.raises(LogDamaged, match="a device, not a log"):
        load("/dev/zero")
