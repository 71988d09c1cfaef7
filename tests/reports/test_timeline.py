"""The picture and the report files: deterministic, complete, for whole, cut and interrupted logs."""

import csv
import re
import struct
from itertools import pairwise

import matplotlib.pyplot as plt
import pytest

from teleop_sim.core.errors import LogDamaged
from teleop_sim.core.records import PacketEnded, RunEnded, RunStarted, Scored
from teleop_sim.log.writer import LogWriter
from teleop_sim.reports import lanes
from teleop_sim.reports.formats.files import FORMATS
from teleop_sim.reports.page import write_run

STARTED = RunStarted(0.0, "src-dish", "", 1, 0, 1800.0, "")
NAN = float("nan")


def written(path, records):
    with LogWriter(path) as log:
        for record in records:
            log(record)
    return path


def words(svg):
    """Texts of a picture: matplotlib writes each as a comment beside its outlines."""
    return re.findall(r"<!-- (.*?) -->", svg.read_text())


def files_of(log, out=None, formats=FORMATS):
    return {f.name.partition(".")[2]: f for f in write_run(log, out, formats)}


def test_a_report_is_a_page_pictures_and_tables(tmp_path, make_run):
    log = written(tmp_path / "run.mcap", make_run(ask=True, blackouts=True))
    files = files_of(log)
    assert next(iter(files)) == "html"
    assert {"timeline.png", "timeline.svg", "states.csv", "states.md", "states.tex", "packets.csv"} <= set(files)
    width, height = struct.unpack(">II", files["timeline.png"].read_bytes()[16:24])
    assert width > height > 500
    shown = words(files["timeline.svg"])
    for word in (
        "uplink",
        "downlink",
        "CORRECT_PITCH",
        "simulated time [s]",
        "blackout",
        "read",
        "autonomous recovery",
    ):
        assert word in shown
    assert any("completed" in text for text in shown)
    assert sum(text.startswith("blackout ") or text == "30 s" for text in shown) >= 2
    assert "Fix Pitch" in files["states.md"].read_text()
    assert len(list(csv.DictReader(files["states.csv"].read_text().splitlines()))) >= 14
    assert plt.get_fignums() == []


def test_only_the_page_unless_more_is_asked_for(tmp_path, make_run):
    log = written(tmp_path / "run.mcap", make_run())
    assert [f.name for f in write_run(log)] == ["run.html"]
    assert {f.suffix for f in write_run(log, tmp_path / "more", ("csv", "latex"))} == {".csv", ".tex"}


def test_the_same_log_gives_the_same_bytes(tmp_path, make_run):
    log = written(tmp_path / "run.mcap", make_run(blackouts=True))
    one, two = (write_run(log, tmp_path / folder, FORMATS) for folder in ("a", "b/c"))
    for first, second in zip(one, two, strict=True):
        assert first.read_bytes() == second.read_bytes()


def test_an_interrupted_log_says_so(tmp_path, make_run):
    log = written(tmp_path / "run.mcap", make_run(ended=False))
    files = files_of(log)
    assert any("INTERRUPTED" in text for text in words(files["timeline.svg"]))
    assert "interrupted: the log ends at" in files["html"].read_text()


def test_a_cut_part_is_reported_up_to_the_cut(tmp_path, make_run):
    whole = written(tmp_path / "run.mcap", make_run()).read_bytes()
    part = tmp_path / "cut.mcap.part"
    part.write_bytes(whole[: len(whole) * 2 // 3])
    files = files_of(part)
    assert files["timeline.svg"].name == "cut.timeline.svg"
    assert any("INTERRUPTED" in text for text in words(files["timeline.svg"]))


@pytest.mark.parametrize(
    "records", [[STARTED], [Scored(1.0, 1, "")], [STARTED, RunEnded(9.0, "failed", "$x", NAN, 0, 0)]]
)
def test_hardly_a_run_is_drawn_too(tmp_path, records):
    files = files_of(written(tmp_path / "run.mcap", records))
    assert {"html", "timeline.svg"} <= set(files)
    assert all(f.stat().st_size for f in files.values())


def test_a_bad_log_is_refused(tmp_path):
    with pytest.raises(LogDamaged):
        write_run(tmp_path / "missing.mcap", tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_packets_in_one_row_never_overlap(make_run):
    records = make_run(ask=True, stretch=0.3)
    sent = [r for r in records if isinstance(r, PacketEnded) and r.direction == "down"]
    packets = lanes.packets(records, "down")
    assert len(packets) == len(sent)
    for row in {p.row for p in packets}:
        spans = [(p.sent_s, p.end_s) for p in packets if p.row == row]
        assert all(a[1] <= b[0] for a, b in pairwise(spans))
    # as few rows as packets are ever under way together
    most = max(sum(q.sent_s <= p.sent_s < q.end_s for q in packets) for p in packets)
    assert max(p.row for p in packets) + 1 == most


def test_a_checkpoint_is_marked_once():
    marks = lanes.scores([Scored(t, c, "") for t, c in ((1.0, 0), (2.0, 1), (3.0, 1), (4.0, 2))])
    assert [passed for _, _, passed in marks] == [False, True, False, True]
