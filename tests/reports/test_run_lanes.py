"""What a run's timeline tells: every record in its lane, at its time, and nothing twice."""

import math
from itertools import accumulate

import pytest

from teleop_sim.core.records import (
    Blackout,
    EpisodeEnded,
    Judged,
    Layer,
    OperatorActed,
    PacketEnded,
    Released,
    Requested,
    RunEnded,
    RunStarted,
    Scored,
    TransitionTaken,
)
from teleop_sim.log.load import load
from teleop_sim.log.writer import LogWriter
from teleop_sim.reports import run_head, run_lanes
from teleop_sim.reports.lane_data import Bar, Kind, Lane, Mark, Row, timeline_data
from teleop_sim.reports.run_link_lanes import DRAWN, STACK, link
from teleop_sim.reports.run_timeline import timeline
from teleop_sim.reports.run_view import Run

NAN = float("nan")
TOML = """
question = "How long?"
task = "drc-door"
robot = "atlas"
autonomy = "low"
[operator]
team = 3
policy = "collaborate"
expertise = 0.7
[link.up]
rate_bps = 64.0
delay_s = 0.5
[link.down]
rate_bps = 380_000.0
"""


@pytest.fixture
def run(tmp_path):
    def made(*records):
        with LogWriter(tmp_path / "run.mcap") as log:
            for record in sorted(records, key=lambda r: r.t_s):
                log(record)
        return Run(load(tmp_path / "run.mcap"))

    return made


def step(t_s, state, event, after, entered_s, how="autonomous", mode="normal", level=1, waited_s=0.0, note=""):
    return TransitionTaken(t_s, state, event, after, entered_s, how, mode, 0, 0, level, waited_s, note)


def packet(number, sent_s, service_s, out_s, arrived_s, outcome="delivered", way="up"):
    waits = (max(service_s - sent_s, 0.0), 0.0, out_s - service_s, arrived_s - out_s)
    waits = tuple(0.0 if math.isnan(w) else w for w in waits)
    end_s = sent_s + 5.0 if math.isnan(arrived_s) else arrived_s
    row = (sent_s, service_s, arrived_s, *waits, outcome, "lost" if outcome == "dropped" else "", "words")
    return PacketEnded(end_s, way, number, "log", 8, 64, *row)


def texts(lane):
    return [bar.text for bar in lane.bars]


def test_states_are_a_tree_with_their_containers_above_them(run):
    lane = run_lanes.machine(
        run(
            step(10.0, "A", "go", "B/C/D", 0.0, how="confirmed", waited_s=4.0, note="a note"),
            step(30.0, "B/C/D", "on", "B/E", 10.0, mode="auto"),
            step(50.0, "B/E", "back", "B/C/D", 30.0),
            step(60.0, "B/C/D", "out", "F", 50.0, how="forced", mode="manual"),
            RunEnded(70.0, "completed", "", 70.0, 0, 0),
        )
    )
    assert [(row.name, row.depth) for row in lane.rows] == [("A", 0), ("B", 0), ("C", 1), ("D", 2), ("E", 1), ("F", 0)]
    found = {(lane.rows[bar.row].name, bar.start_s, bar.end_s, bar.kind.words) for bar in lane.bars}
    assert found == {
        ("A", 0.0, 10.0, "normal"),
        ("B", 10.0, 60.0, "in a container"),
        ("C", 10.0, 30.0, "in a container"),
        ("C", 50.0, 60.0, "in a container"),
        ("D", 10.0, 30.0, "autonomous recovery"),
        ("E", 30.0, 50.0, "normal"),
        ("D", 50.0, 60.0, "manual"),
        ("F", 60.0, 70.0, "normal"),
    }
    assert "A\ngo → B/C/D\nconfirmed by the operator after 4 s\nlevel low, threshold off\na note" in texts(lane)
    assert "F\nhere the log ends" in texts(lane)


def test_a_request_lasts_until_its_answer_arrives_or_something_else_moves_the_machine(run):
    lane = run_lanes.requests(
        run(
            Requested(1.0, 1, "confirm", "A", "go", ""),
            Released(9.0, 1, "confirm 1", "answered", ""),
            Requested(10.0, 2, "data", "B", "", "a template"),
            step(15.0, "B", "timeout", "C", 9.0),
            Requested(16.0, 3, "confirm", "C", "on", ""),
            Released(18.0, 0, "level 2", "level", ""),
            Scored(20.0, 1, "x"),
        )
    )
    assert [row.name for row in lane.rows] == ["confirm", "data", "commands arrived"]
    assert [(b.start_s, b.end_s, b.row) for b in lane.bars] == [(1.0, 9.0, 0), (10.0, 15.0, 1), (16.0, 20.0, 0)]
    assert [text.splitlines()[-1] for text in texts(lane)] == [
        "answered: confirm 1",
        "the machine moved on",
        "not answered",
    ]
    assert [(m.at_s, m.row, m.kind.words) for m in lane.marks] == [(9.0, 2, "answered"), (18.0, 2, "level set")]


def test_the_level_is_a_staircase(run):
    lane = run_lanes.level(
        run(
            RunStarted(0.0, "x", TOML, 1, 0, 99.0, ""),
            step(10.0, "A", "go", "B", 0.0, level=1),
            Released(12.0, 0, "level 3", "level", ""),
            step(20.0, "B", "go", "C", 10.0, level=3),
        )
    )
    [stair] = lane.steps
    assert stair.at_s == (0.0, 12.0)
    assert stair.text == ("level low", "level full")
    assert stair.share == pytest.approx((0.1 + 0.8 / 3, 0.9))
    assert [word for _, word in lane.rows[0].ticks] == ["off", "low", "high", "full"]


def test_each_role_has_a_row_and_each_motion_its_kind(run):
    seen = run(
        OperatorActed(3.0, 1.0, "supervisor", "read", 1, "the request"),
        OperatorActed(5.0, 3.0, "primary", "talk", 0, ""),
        OperatorActed(6.0, 5.0, "supervisor", "send", 1, "confirm 1"),
        Judged(6.0, 1, "go", 7, "yaw_wheel", 3.0, 1.0, 3.0, 3.2, 2.0, "rejected"),
        EpisodeEnded(8.0, 6.0, "A", "walk", "2 m", "done", "", 0.1),
        EpisodeEnded(9.0, 8.0, "A", "juggle", "", "failed", "fell", 0.1),
    )
    crew, robot = run_lanes.operators(seen), run_lanes.robot(seen)
    assert [row.name for row in crew.rows] == ["supervisor", "primary", "judgements"]
    assert [bar.row for bar in crew.bars] == [0, 1, 0]
    assert crew.bars[0].text == "supervisor: read\nthe request\nrequest 1"
    assert [(m.row, m.kind.words) for m in crew.marks] == [(2, "claim rejected")]
    assert [row.name for row in robot.rows] == ["walk, step", "other"]
    assert [bar.text for bar in robot.bars] == ["walk\n2 m\ndone\nA", "juggle\nfailed: fell\nA"]


def test_layers_of_control_are_the_paper_s_rows(run):
    assert run_lanes.layers(run(Scored(1.0, 1, "x"))).bars == ()
    lane = run_lanes.layers(run(Layer(5.0, 2.0, "alignment", "lay the template"), Scored(6.0, 1, "x")))
    assert [row.name for row in lane.rows][:4] == ["request", "alignment", "answer", "stepping"]
    [bar] = lane.bars
    assert (bar.start_s, bar.end_s, bar.text) == (2.0, 5.0, "alignment\nlay the template")


def test_a_packet_waits_is_sent_and_travels(run):
    lane = link(
        run(
            packet(0, 0.0, 0.0, 2.0, 3.0),
            packet(1, 1.0, 2.0, 4.0, 5.0),
            packet(2, 1.5, NAN, NAN, NAN, "dropped"),
            Blackout(8.0, "up", True),
            Blackout(9.0, "up", False),
            Blackout(9.5, "down", True),
        ),
        "up",
    )
    ways = sorted((b.start_s, b.end_s, b.row - 2, b.kind.words) for b in lane.bars if b.row > 1)
    assert ways == [
        (0.0, 2.0, 0, "being sent"),
        (1.0, 2.0, 1, "queueing or dark"),
        (1.5, 6.5, 2, "queueing or dark"),
        (2.0, 3.0, 0, "travelling"),
        (2.0, 4.0, 1, "being sent"),
        (4.0, 5.0, 1, "travelling"),
    ]
    assert [(b.start_s, b.end_s) for b in lane.bars if b.row == 0] == [(8.0, 9.0), (0.0, 4.0)]
    assert [(a, b) for a, b, _ in lane.bands] == [(8.0, 9.0)]
    [cross] = lane.marks
    assert (cross.at_s, cross.kind.shape) == (6.5, "cross")
    assert "dropped: lost" in cross.text
    [queue] = lane.steps
    assert queue.at_s == (0.0, 1.0, 1.5, 2.0, 6.5)
    assert [text.split()[0] for text in queue.text] == ["0", "1", "2", "1", "0"]


def test_of_very_many_packets_only_state_and_queue_are_told(run):
    # Binary fractions: times that should be equal are.
    many = [packet(n, n / 8, n / 8 + 0.5, n / 8 + 0.5625, n / 8 + 12.0) for n in range(DRAWN + 1)]
    lane = link(run(*many), "up")
    assert [row.name for row in lane.rows] == ["state", "queue"]
    assert {bar.row for bar in lane.bars} == {0}
    assert len(lane.steps[0].at_s) <= 5001
    assert "at most 4" in lane.steps[0].text[0]
    fewer = link(run(*many[:200]), "up")
    # 12 s at 8 a second are 96 under way together.
    assert len(fewer.rows) == min(96, STACK) + 2


def test_no_link_no_lane(run):
    assert not link(run(Scored(1.0, 1, "x")), "down").bars


def test_data_are_short_columns_that_give_every_time_back():
    kind, other = Kind("a", "red"), Kind("", "blue", "star")
    lane = Lane(
        "x",
        "X",
        (Row("r", ticks=((0.5, "half"),)),),
        bars=(Bar(2.5, 3.0, 0, kind, "same"), Bar(0.1, 0.3, 0, kind, "same")),
        marks=(Mark(7.0, 0, other, "same"), Mark(6.9999999, 0, other, "m")),
    )
    data = timeline_data(9.0, [1.5], [lane, Lane("empty", "E", ())])
    [found] = data["lanes"]
    assert list(accumulate(found["bars"]["start"])) == [100_000, 2_500_000]
    assert found["bars"]["took"] == [200_000, 500_000]
    assert list(accumulate(found["marks"]["at"])) == [7_000_000, 7_000_000]
    assert data["texts"] == ["same", "m"]
    assert data["kinds"] == [["a", "red", ""], ["", "blue", "star"]]
    assert found["legend"] == [0]
    assert found["rows"] == [{"name": "r", "depth": 0, "height": 15, "ticks": [[0.5, "half"]]}]


def test_a_made_up_run_has_all_its_records_in_the_timeline(run, make_run):
    records = make_run(ask=True, blackouts=True)
    seen = run(*records)
    data = timeline(seen).data
    lanes = {lane["name"]: lane for lane in data["lanes"]}
    assert list(lanes) == [
        "events", "machine", "requests", "operators", "robot", "level", "uplink", "downlink",
    ]  # fmt: skip
    acts = sum(isinstance(r, OperatorActed) for r in records)
    assert len(lanes["operators"]["bars"]["start"]) == acts
    assert len(lanes["requests"]["bars"]["start"]) == sum(isinstance(r, Requested) for r in records)
    assert len(lanes["uplink"]["marks"]["at"]) == sum(
        isinstance(r, PacketEnded) and r.direction == "up" and r.outcome == "dropped" for r in records
    )
    assert data["end_s"] == pytest.approx(seen.end_s, abs=1e-6)
    assert len(data["guides"]) == 4


def test_the_head_says_who_did_what_over_which_link_and_how_it_ended(run):
    seen = run(
        RunStarted(0.0, "my-door", TOML, 7, 0, 1800.0, "teleop-sim 0.1.0 mujoco 4.0.0"),
        RunEnded(61.5, "completed", "", 61.5, 3, 4),
    )
    facts = dict(run_head.facts(seen))
    assert run_head.title(seen) == "my-door, seed 7"
    assert run_head.verdict(seen) == "completed in 61.5 s"
    assert run_head.question(seen) == "How long?"
    assert facts["Link"] == "up 64 bit/s, 500 ms one way; down 380 kbit/s"
    assert facts["Crew"] == "3 people, collaborate, times × 0.7"
    assert facts["Control"] == "behaviour, autonomy low"
    assert facts["Completion time"] == "61.500 s"
    assert facts["Seed"] == "7, replicate 0"
    assert facts["Versions"] == "teleop-sim 0.1.0, mujoco 4.0.0"
    assert "teleop-sim run scenario.toml" in [lines for _, lines in run_head.again(seen)]


@pytest.mark.parametrize("toml", ["", "not = [toml", "operator = 3\nlink = 'x'\nautonomy = [1]", "[link]\nup = 3"])
def test_a_strange_scenario_is_no_fault(run, toml):
    seen = run(RunStarted(0.0, "x", toml, 1, 2, NAN, ""), Scored(1.0, 1, "x"))
    assert run_head.verdict(seen) == "interrupted: the log ends at 1 s"
    assert dict(run_head.facts(seen))["Seed"] == "1, replicate 2"
    assert timeline(seen).data["end_s"] == 1.0
