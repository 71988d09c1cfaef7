"""Logs written anew from what is whole, cut to a span, checked: with the package ``mcap`` as independent reader."""

from __future__ import annotations

import io
import json
import resource
import struct
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from typer.testing import CliRunner

from teleop_sim.cli_log import log_app
from teleop_sim.core.errors import BadInput, LogDamaged
from teleop_sim.core.records import Blackout, Disturbed, PlantNames, PlantSample, RunEnded, RunStarted, Scored, Waited
from teleop_sim.core.views import LogLine
from teleop_sim.log.check import check
from teleop_sim.log.load import load
from teleop_sim.log.repair import cut, recover
from teleop_sim.log.scan import scan
from teleop_sim.log.writer import LogWriter

STARTED = RunStarted(0.0, "src-dish", "schema = 1\n", 1, 0, 1800.0, "teleop-sim 0.1.0")
ENDED = RunEnded(400.0, "completed", "", 399.5, 3, 7)


def a_run(n=3000, until_s=400.0):
    """Some 300 kB: a chunk every 30 s and more."""
    rng = np.random.default_rng(5)
    yield STARTED
    yield PlantNames(0.0, "knee ankle")
    yield Disturbed(0.0, "mass_factor", (1.1,), "")
    for i in range(n):
        t_s = i * until_s / n
        yield PlantSample(t_s, tuple(rng.normal(size=7)), tuple(rng.normal(size=2)))
        if i % 10 == 0:
            yield Waited(t_s, max(t_s - 1.0, 0.0), "STATE_INIT", "pacing", f"poll {i}")
        if i % 500 == 250:
            yield Blackout(t_s, "down", i % 1000 == 250)
    yield replace(ENDED, t_s=until_s)


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    with LogWriter(path, durable=False) as write:
        for i, record in enumerate(a_run()):
            write(record)
            if i % 300 == 0:
                write.show(LogLine(record.t_s, "info", "test", f"line {i}"))
    return path


def messages(data):
    """All messages of a whole file, by the package ``mcap``."""
    reader = make_reader(io.BytesIO(data), validate_crcs=True)
    return [(c.topic, m.sequence, m.log_time, m.data) for _, c, m in reader.iter_messages(log_time_order=False)]


def chunks_of(data):
    """End of each chunk in the file, and its messages, by the index that the package ``mcap`` reads."""
    reader = make_reader(io.BytesIO(data))
    summary = reader.get_summary()
    everything = messages(data)
    made, at = [], 0
    for index in sorted(summary.chunk_indexes, key=lambda index: index.chunk_start_offset):
        count = _count(data, index)
        made.append((index.chunk_start_offset + index.chunk_length, everything[at : at + count]))
        at += count
    assert at == len(everything)
    return made


def _count(data, index):
    """Messages of a chunk, from the message indexes that its chunk index points to (opcode 7, mcap.dev/spec)."""
    count = 0
    for place in index.message_index_offsets.values():
        opcode, _, _, size = struct.unpack_from("<BQHI", data, place)
        assert opcode == 7
        count += size // 16
    return count


def synthetic(chunks=60):
    """Another writer's file: no records of ours, many small chunks, several to a topic."""
    stream, rng = io.BytesIO(), np.random.default_rng(6)
    writer = Writer(stream, chunk_size=1 << 30, compression=CompressionType.ZSTD)
    writer.start()
    made = [
        writer.register_channel(f"/t{i}", "json", writer.register_schema(f"s{i}", "jsonschema", b"{}")) for i in (0, 1)
    ]
    for i in range(chunks * 20):
        writer.add_message(made[i % 2], i * 1000, rng.bytes(int(rng.integers(0, 60))), i * 1000, i)
        if i % 20 == 19:
            writer.flush()
    writer.finish()
    return stream.getvalue()


@pytest.mark.parametrize("which", ["run", "synthetic"])
def test_cut_at_200_random_places_all_whole_chunks_come_back(log, tmp_path, which):
    data = log.read_bytes() if which == "run" else synthetic()
    chunks = chunks_of(data)
    assert len(chunks) > 12
    part, out = tmp_path / "cut.mcap.part", tmp_path / "out.mcap"
    sizes = np.random.default_rng(2026).integers(0, len(data), 200)
    kept = set()
    for size in sizes:
        part.write_bytes(data[:size])
        expected = [message for end, inside in chunks if end <= size for message in inside]
        if not expected:
            with pytest.raises(LogDamaged):
                recover(part, out, force=True)
            continue
        done = recover(part, out, force=True)
        assert messages(out.read_bytes()) == expected
        assert done.messages == len(expected)
        assert done.last_s == max(time_ns for _, _, time_ns, _ in expected) / 1e9
        assert (done.lost_chunks, done.orphans) == (0, 0)
        kept.add(done.chunks)
    assert len(kept) > 10


def test_a_whole_log_is_recovered_byte_for_byte(log, tmp_path):
    done = recover(log, tmp_path / "out.mcap")
    assert (tmp_path / "out.mcap").read_bytes() == log.read_bytes()
    assert done.ended
    assert [p.name for p in tmp_path.iterdir()] == ["out.mcap"]


def test_a_damaged_chunk_costs_itself_only(log, tmp_path):
    data = log.read_bytes()
    chunks = chunks_of(data)
    for number in range(1, len(chunks)):
        broken = bytearray(data)
        broken[chunks[number][0] - 20] ^= 1
        (tmp_path / "broken.mcap").write_bytes(broken)
        done = recover(tmp_path / "broken.mcap", tmp_path / "out.mcap", force=True)
        expected = [m for i, (_, inside) in enumerate(chunks) if i != number for m in inside]
        assert messages((tmp_path / "out.mcap").read_bytes()) == expected
        assert done.lost_chunks == 1


def test_where_lengths_make_no_sense_the_next_chunk_is_found(log, tmp_path):
    data = log.read_bytes()
    chunks = chunks_of(data)
    for number in range(1, len(chunks) - 1):
        broken = bytearray(data)
        # From the middle of the indexes behind this chunk into the middle of the next one.
        broken[chunks[number][0] + 1 : chunks[number + 1][0] - 50] = b"\xff" * (
            chunks[number + 1][0] - 51 - chunks[number][0]
        )
        (tmp_path / "broken.mcap").write_bytes(broken)
        done = recover(tmp_path / "broken.mcap", tmp_path / "out.mcap", force=True)
        expected = [m for i, (_, inside) in enumerate(chunks) if i != number + 1 for m in inside]
        assert messages((tmp_path / "out.mcap").read_bytes()) == expected
        assert done.lost_bytes > 0


def test_the_summary_tells_what_a_lost_first_chunk_had_declared(log, tmp_path):
    data = bytearray(log.read_bytes())
    chunks = chunks_of(bytes(data))
    data[chunks[0][0] - 20] ^= 1
    (tmp_path / "broken.mcap").write_bytes(data)
    assert recover(tmp_path / "broken.mcap", tmp_path / "out.mcap").orphans == 0
    assert messages((tmp_path / "out.mcap").read_bytes()) == [m for _, inside in chunks[1:] for m in inside]
    (tmp_path / "cut.mcap").write_bytes(data[: chunks[5][0]])
    # Without it only those of topics that were declared later can be told.
    done = recover(tmp_path / "cut.mcap", tmp_path / "other.mcap")
    known = {"/log", "field/disturbance"}
    expected = [m for _, inside in chunks[1:6] for m in inside]
    assert messages((tmp_path / "other.mcap").read_bytes()) == [m for m in expected if m[0] in known]
    assert done.orphans == sum(m[0] not in known for m in expected)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_damaged_byte_never_surprises_a_tool(log, tmp_path, data):
    broken = bytearray(log.read_bytes())
    # The header's names may be anything.
    broken[data.draw(st.integers(45, len(broken) - 1))] ^= data.draw(st.integers(1, 255))
    (tmp_path / "broken.mcap").write_bytes(broken)
    good = {message[1:] for message in messages(log.read_bytes())}
    try:
        # Compressed data have bits on which nothing depends.
        assert check(tmp_path / "broken.mcap").problems or {m[1:] for m in messages(bytes(broken))} == good
        recover(tmp_path / "broken.mcap", tmp_path / "out.mcap", force=True)
        assert {message[1:] for message in messages((tmp_path / "out.mcap").read_bytes())} <= good
    except LogDamaged:
        pass


def test_a_cut_has_its_span_and_what_explains_it(log, tmp_path):
    done = cut(log, tmp_path / "out.mcap", 100.0, 200.0)
    everything, found = messages(log.read_bytes()), messages((tmp_path / "out.mcap").read_bytes())
    inside = [m for m in everything if 100 * 10**9 <= m[2] <= 200 * 10**9]
    assert [m for m in found if m[2] >= 100 * 10**9] == inside
    before = [m[0] for m in found if m[2] < 100 * 10**9]
    assert before == ["run/started", "/log", "field/plant_names", "field/disturbance", "link/blackout"]
    assert done.messages == len(inside) + len(before)
    part = load(tmp_path / "out.mcap")
    assert part.whole
    assert part.interrupted
    assert part.scenario_toml == "schema = 1\n"
    assert part.plant["t_s"].iloc[0] == 100.0
    assert "knee" in part.joints
    assert part.blackouts["start_s"].iloc[0] < 100.0


def test_a_cut_of_nothing(log, tmp_path):
    with pytest.raises(BadInput, match="no message from 500 s on"):
        cut(log, tmp_path / "out.mcap", 500.0, float("inf"))
    with pytest.raises(BadInput, match="is not after"):
        cut(log, tmp_path / "out.mcap", 5.0, 5.0)
    assert list(tmp_path.iterdir()) == []


def test_what_is_written_anew_never_writes_over_anything(log, tmp_path):
    before = log.read_bytes()
    link, there = tmp_path / "link.mcap", tmp_path / "there.mcap"
    link.symlink_to(log)
    there.write_bytes(b"precious")
    for out, force, why in (
        (log, True, "is the log itself"),
        (link, True, "is the log itself"),
        (there, False, "is there already"),
        (tmp_path, True, "is a directory"),
        (tmp_path / "no" / "out.mcap", True, "there is no directory"),
    ):
        with pytest.raises(BadInput, match=why):
            recover(log, out, force)
    assert log.read_bytes() == before
    assert there.read_bytes() == b"precious"
    recover(log, there, force=True)
    assert there.read_bytes() == before


def test_a_full_disk_leaves_nothing_behind(log, tmp_path):
    program = (
        "import resource, sys; from pathlib import Path; from teleop_sim.log.repair import recover\n"
        "recover(Path(sys.argv[1]), Path(sys.argv[2]) / 'warm.mcap')\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (9_000, 9_000))\n"
        "try: recover(Path(sys.argv[1]), Path(sys.argv[2]) / 'out.mcap')\n"
        "except OSError as error: print(error.filename)\n"
    )
    done = subprocess.run([sys.executable, "-c", program, log, tmp_path], capture_output=True, text=True, check=True)
    assert done.stdout.startswith(str(tmp_path / "out.mcap."))
    assert [p.name for p in tmp_path.iterdir()] == ["warm.mcap"]
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] != 9_000


def test_a_good_log_is_good(log):
    found = check(log)
    assert found.problems == ()
    data = log.read_bytes()
    assert (found.messages, found.chunks) == (len(messages(data)), len(chunks_of(data)))


def test_a_check_names_each_problem_and_its_byte(log, tmp_path):
    data = log.read_bytes()
    summary = make_reader(io.BytesIO(data)).get_summary()
    chunk = sorted(summary.chunk_indexes, key=lambda index: index.chunk_start_offset)[2]
    places = {
        chunk.chunk_start_offset + chunk.chunk_length - 5: (chunk.chunk_start_offset, "does not unpack"),
        next(iter(chunk.message_index_offsets.values())) + 16: (
            next(iter(chunk.message_index_offsets.values())),
            "the index of channel",
        ),
        len(data) - 8 - 2: (len(data) - 8 - 29, "the summary is not what its checksum says"),
    }
    for place, (where, what) in places.items():
        broken = bytearray(data)
        broken[place] ^= 1
        (tmp_path / "broken.mcap").write_bytes(broken)
        told = [str(problem) for problem in check(tmp_path / "broken.mcap").problems]
        assert any(f"byte {where}:" in problem and what in problem for problem in told), told
    (tmp_path / "cut.mcap").write_bytes(data[: chunk.chunk_start_offset + 100])
    told = [problem.what for problem in check(tmp_path / "cut.mcap").problems]
    assert told == ["cut off", "there is no run/ended: the run was interrupted"]


@pytest.mark.parametrize(
    ("records", "what"),
    [
        ([STARTED, Scored(2.0, 1, "x"), Scored(1.0, 1, "x"), ENDED], "comes after one at 2.000000000 s"),
        ([STARTED, STARTED, ENDED], "run/started is there 2 times"),
        ([Scored(0.0, 1, "x"), STARTED, ENDED], "run/started is not the first record"),
        ([STARTED, ENDED, Scored(400.0, 1, "x")], "run/ended is not the last record"),
        ([Scored(0.0, 1, "x"), ENDED], "there is no run/started"),
        ([STARTED, Scored(0.0, 1, "x")], "there is no run/ended"),
    ],
)
def test_a_log_has_one_run_in_order(tmp_path, records, what):
    with LogWriter(tmp_path / "run.mcap", durable=False) as write:
        for record in records:
            write(record)
    assert [what in problem.what for problem in check(tmp_path / "run.mcap").problems] == [True]


def test_the_command_line(log, tmp_path):
    run = CliRunner().invoke
    told = json.loads(run(log_app, ["info", str(log), "--json"]).stdout)
    assert told["run"]["scenario"] == "src-dish"
    assert sum(topic["messages"] for topic in told["topics"]) == sum(1 for _ in scan(log.read_bytes()).messages)
    assert "completed in 6 min 40 s" in run(log_app, ["info", str(log)]).stdout
    part, out = tmp_path / "a.mcap.part", tmp_path / "a.mcap"
    part.write_bytes(log.read_bytes()[:150_000])
    bad = run(log_app, ["check", str(log), str(part)])
    assert (bad.exit_code, bad.stdout.count("good"), "cut off" in bad.stderr) == (2, 1, True)
    saved = run(log_app, ["recover", str(part), "-o", str(out)])
    assert saved.exit_code == 0
    assert "up to" in saved.stdout
    assert load(out).whole
    assert run(log_app, ["check", str(log)]).exit_code == 0
    assert run(log_app, ["recover", str(part), "-o", str(out)]).exit_code == 2
    short = run(log_app, ["cut", str(log), "--from", "60s", "--to", "2min", "-o", str(out), "--force"])
    assert short.exit_code == 0
    assert load(out).plant["t_s"].max() == 120.0
    assert "not understood" in run(log_app, ["cut", str(log), "--from", "60", "-o", str(out), "--force"]).stderr
