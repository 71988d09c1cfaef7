"""The table against hand-computed examples; times and shares against their sums."""

import csv
from io import StringIO
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from teleop_sim.core.records import (
    EpisodeEnded,
    ModeChanged,
    OperatorActed,
    PacketEnded,
    Released,
    Requested,
    RunEnded,
    RunStarted,
    TransitionTaken,
    Waited,
)
from teleop_sim.reports import table
from teleop_sim.reports.formats.csv import csv as csv_bytes
from teleop_sim.reports.intervals import both, length_s, minus, union
from teleop_sim.reports.run_tables import state_sheet
from teleop_sim.reports.shares import SHARES
from teleop_sim.reports.terminal import rich_shares, rich_table

STARTED = RunStarted(0.0, "src-dish", "", 1, 0, 1800.0, "")
FIX, GRASP, SEEK, YAW = (
    "STATE_CORRECT_PITCH",
    "STATE_GRASP_PITCH_HANDLE",
    "STATE_REDETECT_HANDLE",
    "STATE_GRASP_YAW_HANDLE",
)


def moves(*rows):
    """Transitions from (t_s, state, next_state, mode, retries); each was entered when the one before ended."""
    before_s = 0.0
    for t_s, state, next_state, mode, retries in rows:
        yield TransitionTaken(t_s, state, "e", next_state, before_s, "autonomous", mode, retries, 1, 3, 0.0, "")
        before_s = t_s


LOST_GRIP = [
    STARTED,
    *moves(
        (2.0, "STATE_INIT", "STATE_INIT", "normal", 1),
        (4.0, "STATE_INIT", GRASP, "auto", 1),
        (14.0, GRASP, FIX, "normal", 0),
        (30.0, FIX, SEEK, "normal", 1),
        (36.0, SEEK, GRASP, "normal", 0),
        (46.0, GRASP, FIX, "normal", 0),
        (70.0, FIX, YAW, "auto", 1),
    ),
    RunEnded(75.0, "failed", "the robot fell", float("nan"), 0, 0),
]
SMOOTH = [
    STARTED,
    *moves(
        (4.0, "STATE_INIT", GRASP, "normal", 0), (12.0, GRASP, FIX, "normal", 0), (40.0, FIX, "STATE_END", "normal", 0)
    ),
    RunEnded(40.0, "completed", "", 40.0, 0, 0),
]


def row(state, visits, normal, auto, manual, retries, time_s):
    return dict(
        zip(table.StateRow.__annotations__, (state, visits, normal, auto, manual, retries, time_s), strict=True)
    )


def test_state_rows_of_a_lost_grip():
    assert table.state_rows(LOST_GRIP) == [
        row("STATE_INIT", 1, 0, 1, 0, 1, 4.0),
        row(GRASP, 2, 2, 0, 0, 0, 20.0),
        row(FIX, 2, 1, 1, 0, 1, 40.0),
        row(SEEK, 1, 1, 0, 0, 0, 6.0),
        row(YAW, 1, 1, 0, 0, 0, 5.0),
    ]


def test_a_success_clears_the_count_and_a_new_failure_counts_anew():
    run = moves((1.0, "A", "A", "normal", 1), (2.0, "A", "B", "auto", 1), (3.0, "B", "A", "normal", 0))
    again = moves((4.0, "A", "A", "normal", 1), (5.0, "A", "A", "auto", 2), (6.0, "A", "B", "auto", 2))
    rows = table.state_rows([*run, *again])
    assert [(r["state"], r["visits"], r["retries"]) for r in rows] == [("A", 2, 3), ("B", 2, 0)]


def test_a_manual_state_in_which_the_run_ends_counts():
    run = [*moves((5.0, "A", "STATE_ERROR", "auto", 3)), ModeChanged(5.0, "STATE_ERROR", "manual"), STARTED]
    run.append(RunEnded(25.0, "censored", "", float("nan"), 0, 0))
    assert table.state_rows(run)[1] == row("STATE_ERROR", 1, 0, 0, 1, 0, 20.0)


def test_no_transition_at_all():
    assert table.state_rows([STARTED]) == []
    run = [STARTED, Waited(3.0, 1.0, "STATE_INIT", "pacing", "")]
    assert table.state_rows(run) == [row("STATE_INIT", 1, 1, 0, 0, 0, 2.0)]


def test_the_table_of_two_runs_beside_the_paper():
    rows = table.state_table([LOST_GRIP, SMOOTH])
    assert [r.name for r in rows] == ["STATE_INIT", "Grasp Pitch Knob", "Fix Pitch", "Grasp Yaw Knob", "STATE_END"]
    init, grasp, fix, yaw, end = rows
    assert (init.normal_pct, init.auto_pct, init.retries, init.time_s) == (50.0, 50.0, 1, 4.0)
    assert (grasp.normal_pct, grasp.retries, grasp.time_s) == (100.0, 0, 14.0)
    # 16 + 24 s of fixing and 6 s of looking again in one run, 28 s in the other
    assert (fix.runs, fix.normal_pct, fix.auto_pct, fix.retries, fix.time_s) == (2, 50.0, 50.0, 1, 37.0)
    assert fix.paper == table.PaperRow(10, 40.0, 60.0, 0.0, 9, 36.7)
    assert (end.paper, end.time_s) == (None, 0.0)
    assert (yaw.runs, yaw.time_s) == (1, 5.0)


def test_the_paper_figures_add_up_to_its_sum():
    """Column sum of Table II, task 1: 285.4 s and 30 retries."""
    figures = [paper for _, paper in table.paper_rows().values() if paper]
    assert len(figures) == 12
    assert sum(p.time_s for p in figures) == pytest.approx(285.4, abs=1e-9)
    assert sum(p.retries for p in figures) == 30
    assert all(p.normal_pct + p.auto_pct + p.manual_pct == 100.0 for p in figures)


def test_every_way_to_write_the_table_shows_the_same_rows():
    rows = table.state_table([LOST_GRIP])
    sheet = state_sheet(rows)
    parsed = list(csv.DictReader(StringIO(csv_bytes(sheet).decode())))
    assert [line["state"] for line in parsed] == [r.name for r in rows]
    assert [float(line["time_s"]) for line in parsed] == [r.time_s for r in rows]
    assert [line["paper_time_s"] for line in parsed][:2] == ["", "13.3"]
    console = Console(width=120, record=True, file=StringIO())
    console.print(rich_table(rows), rich_shares(table.where_time_went(LOST_GRIP)))
    shown = console.export_text()
    for r in rows:
        assert r.name in shown
    assert "Redetection" in shown
    assert "Redetection" in sheet.note
    assert sheet.total[0] == "Sum"


def test_a_mean_of_several_runs_says_how_many_came_there():
    several = state_sheet(table.state_table([LOST_GRIP, LOST_GRIP]))
    assert [c.name for c in several.columns][1] == "runs"
    assert {row[1] for row in several.rows} == {2}


def test_nothing_gives_an_empty_table():
    assert table.state_table([]) == []
    assert table.state_table([[STARTED]]) == []
    assert state_sheet([]).rows == ()
    Console(file=StringIO()).print(rich_table([]), rich_shares(table.where_time_went([])))


def test_the_narrow_table_fits_forty_columns_with_its_figures_whole():
    console = Console(width=40, record=True, file=StringIO())
    made = rich_table(table.state_table([LOST_GRIP]), narrow=True)
    made.box, made.padding, made.pad_edge = None, (0, 1, 0, 0), False
    console.print(made)
    text = console.export_text()
    assert "…" not in text
    assert "paper" in text
    assert "Sum" in text


def test_where_time_went_by_hand():
    run = [
        STARTED,
        EpisodeEnded(10.0, 0.0, "A", "walk", "", "done", "", 1.0),
        Waited(16.0, 8.0, "A", "pacing", "two seconds of it while the robot moved"),
        Requested(16.0, 1, "confirm", "A", "e", ""),
        OperatorActed(30.0, 26.5, "supervisor", "read", 1, ""),
        OperatorActed(33.0, 30.0, "supervisor", "decide", 1, ""),
        Released(44.0, 1, "confirm 1", "answered", ""),
        OperatorActed(47.0, 45.0, "supervisor", "read", 0, "nobody waits for this"),
        Requested(48.0, 2, "confirm", "A", "e", ""),
        RunEnded(50.0, "censored", "", float("nan"), 1, 3),
    ]
    assert table.where_time_went(run) == {
        "robot_s": 10.0,
        "pacing_s": 6.0,
        "link_s": 28.0 - 6.5 + 2.0,
        "operator_s": 6.5,
        "other_s": 4.0,
        "total_s": 50.0,
    }


def _on_the_way(direction, topic, sent_s, arrived_s):
    waits = (0.0, 0.0, 0.0, arrived_s - sent_s)
    return PacketEnded(arrived_s, direction, 0, topic, 6, 48, sent_s, sent_s, arrived_s, *waits, "delivered", "", "")


def test_reading_while_the_request_or_the_answer_travels_holds_up_nothing():
    run = [
        STARTED,
        Requested(0.0, 1, "confirm", "A", "e", ""),
        OperatorActed(9.0, 5.0, "supervisor", "read", 0, "the request has not come yet"),
        _on_the_way("down", "request", 0.0, 10.0),
        OperatorActed(13.0, 10.0, "supervisor", "decide", 1, ""),
        OperatorActed(14.0, 13.0, "supervisor", "send", 1, ""),
        OperatorActed(20.0, 14.0, "supervisor", "read", 0, "the answer is on its way"),
        _on_the_way("up", "confirm", 14.0, 24.0),
        Released(24.0, 1, "confirm", "answered", ""),
        _on_the_way("down", "mirror", 24.0, 34.0),
        RunEnded(24.0, "completed", "", 24.0, 1, 1),
    ]
    shares = table.where_time_went(run)
    # One round trip is waited for in full, and the operator for the rest.
    assert (shares["link_s"], shares["operator_s"]) == (20.0, 4.0)


TIMES = st.floats(0.0, 100.0)
SPANS = st.lists(st.tuples(TIMES, TIMES).map(sorted).map(tuple), max_size=8)


@given(SPANS, SPANS, SPANS, st.lists(st.tuples(TIMES, TIMES).map(sorted), max_size=5), st.floats(0.0, 120.0))
def test_shares_add_up(moving, pacing, acts, requests, end_s):
    run = [EpisodeEnded(b, a, "A", "walk", "", "done", "", 1.0) for a, b in moving]
    run += [Waited(b, a, "A", "pacing", "") for a, b in pacing]
    run += [OperatorActed(b, a, "supervisor", "read", 0, "") for a, b in acts]
    for i, (a, b) in enumerate(requests, start=1):
        run += [Requested(a, i, "confirm", "A", "e", ""), Released(b, i, "", "answered", "")]
    run = [*sorted(run, key=lambda r: r.t_s), RunEnded(end_s, "censored", "", float("nan"), 0, 0)]
    shares = table.where_time_went(run)
    assert all(shares[key] >= 0.0 for key in SHARES)
    # a hundred additions of numbers up to 120: 1e-9 is far above rounding
    assert sum(shares[key] for key in SHARES) == pytest.approx(shares["total_s"], abs=1e-9)
    assert shares["total_s"] == end_s


@given(SPANS, SPANS)
def test_intervals_obey_set_algebra(some, others):
    a, b = union(some), union(others)
    assert all(x[1] < y[0] for x, y in pairwise(a))
    assert length_s(minus(a, b)) + length_s(both(a, b)) == pytest.approx(length_s(a), abs=1e-9)
    assert length_s(both(a, b)) == pytest.approx(length_s(both(b, a)), abs=1e-9)
    assert length_s(union([*a, *b])) == pytest.approx(length_s(minus(a, b)) + length_s(b), abs=1e-9)


@given(st.lists(st.tuples(st.sampled_from("ABC"), st.floats(0.1, 10.0), st.integers(0, 2)), min_size=1, max_size=30))
def test_times_in_states_add_up_to_the_run(steps):
    now_s, rows = 0.0, []
    for (state, took_s, retries), (following, _, _) in zip(steps, [*steps[1:], ("END", 0.0, 0)], strict=True):
        now_s += took_s
        rows.append((now_s, state, following, "normal", retries))
    run = [*moves(*rows), RunEnded(now_s, "completed", "", now_s, 0, 0)]
    rows = table.state_rows(run)
    assert sum(r["time_s"] for r in rows) == pytest.approx(now_s, abs=1e-9)
    assert sum(r.time_s for r in table.state_table([run])) == pytest.approx(now_s, abs=1e-9)
    assert all(r["normal"] + r["auto"] + r["manual"] == r["visits"] for r in rows)
    assert all(r["retries"] >= 0 for r in rows)
