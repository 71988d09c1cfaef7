"""Judgements joined with the truth, counted by hand."""

import math

import pytest

from teleop_sim.core.records import Claimed, Judged
from teleop_sim.log.load import load
from teleop_sim.log.writer import LogWriter
from teleop_sim.reports.run_tables import verification_sheet
from teleop_sim.reports.run_view import Run
from teleop_sim.reports.verification import verification


def claimed(picture: int, *errors_m: float, what: str = "yaw_handle", event: str = "/FIXED_HANDLE") -> list[Claimed]:
    return [Claimed(1.0, "S", event, picture, what, (0.0,) * 3, (e, 0.0, 0.0), e) for e in errors_m]


def judged(picture: int, verdict: str, event: str = "/FIXED_HANDLE") -> Judged:
    return Judged(2.0, picture, event, picture, "yaw_handle", *[math.nan] * 5, verdict=verdict)


RECORDS = [
    *claimed(1, 0.001, 0.03), judged(1, "rejected"),  # one of two is wrong: a hit
    *claimed(2, 0.021), judged(2, "accepted"),  # a miss
    *claimed(3, 0.019), judged(3, "rejected"),  # a false alarm
    *claimed(4, 0.0), judged(4, "accepted"), *claimed(5, 0.0), judged(5, "accepted"),  # correct rejections
    *claimed(6, 0.0), judged(6, "unseen"),
    *claimed(7, 0.4, what="yaw_wheel", event="/DETECTED_PANEL"), judged(7, "accepted", "/DETECTED_PANEL"),
    *claimed(8, 2.0, what="yaw_wheel", event="/DETECTED_PANEL"), judged(8, "rejected", "/DETECTED_PANEL"),
    *claimed(9, 0.5),  # never judged
]  # fmt: skip


def test_hits_misses_and_alarms_are_those_counted_by_hand():
    far, near, both = verification(RECORDS)
    assert [r.event for r in (far, near, both)] == ["/DETECTED_PANEL", "/FIXED_HANDLE", "all"]
    assert (near.hits, near.misses, near.false_alarms, near.correct_rejections, near.unseen) == (1, 1, 1, 2, 1)
    assert (far.hits, far.misses, far.false_alarms, far.correct_rejections) == (1, 0, 0, 1)
    assert both.hit_rate == pytest.approx(2 / 3)
    assert both.false_alarm_rate == pytest.approx(1 / 4)
    # Every judgement of a known claim is counted once.
    assert both.hits + both.misses + both.false_alarms + both.correct_rejections + both.unseen == 8


def test_where_nothing_is_judged_there_is_no_table():
    assert verification(claimed(1, 0.5)) == []


def test_its_table_has_the_counts_and_the_rates(tmp_path):
    writer = LogWriter(tmp_path / "judged.mcap")
    for record in RECORDS:
        writer.write(record)
    writer.close()
    sheet = verification_sheet(Run(load(tmp_path / "judged.mcap")))
    assert sheet is not None
    assert sheet.rows[-1] == ("all", 2, 1, 1, 3, 1, pytest.approx(2 / 3), 0.25)
