"""What went on at a time, from records."""

from teleop_sim.core.records import (
    Blackout,
    EpisodeEnded,
    ModeChanged,
    OperatorActed,
    PacketEnded,
    RunEnded,
    TransitionTaken,
    Waited,
)
from teleop_sim.replay.telling import Telling

NAN = float("nan")


def packet(direction, topic, service_s, out_s, arrived_s, outcome="delivered", text=""):
    waits = {"queue_s": 0.0, "blackout_s": 0.0, "serialisation_s": out_s - service_s}
    return PacketEnded(
        arrived_s, direction, 0, topic, 4, 32, sent_s=service_s, service_s=service_s, arrived_s=arrived_s,
        propagation_s=arrived_s - out_s, outcome=outcome, reason="", text=text, **waits,
    )  # fmt: skip


RECORDS = [
    TransitionTaken(10.0, "A", "go", "B/C", 0.0, "autonomous", "normal", 0, 0, 3, 0.0, ""),
    ModeChanged(12.0, "B/C", "manual"),
    EpisodeEnded(8.0, 5.0, "A", "walk", "Walk()", "reached", "", 3.0),
    Waited(9.0, 8.0, "A", "pacing", "settle"),
    Waited(20.0, 12.0, "B/C", "operator", ""),
    OperatorActed(15.0, 13.0, "supervisor", "read", 1, "picture"),
    OperatorActed(15.0, 14.0, "primary", "decide", 1, "yes"),
    packet("down", "log", 1.0, 2.0, 4.0, text="A: begins"),
    packet("down", "image", 4.0, 6.0, 8.0),
    packet("up", "answer", 15.0, 15.5, NAN, "dropped"),
    packet("down", "log", NAN, NAN, NAN, "dropped", "never sent"),
    Blackout(16.0, "up", True),
    Blackout(18.0, "up", False),
    RunEnded(21.0, "failed", "fell", NAN, 0, 0),
]
TOLD = Telling(RECORDS)


def test_state_and_mode_are_those_last_entered():
    assert [(TOLD.at(t).state, TOLD.at(t).mode) for t in (0.0, 9.9, 10.0, 12.0)] == [
        ("A", "normal"),
        ("A", "normal"),
        ("B/C", "normal"),
        ("B/C", "manual"),
    ]


def test_the_robot_does_a_skill_or_waits_for_something_or_nothing():
    assert [TOLD.at(t).doing for t in (4.9, 5.0, 7.9, 8.5, 9.5, 13.0)] == [
        "", "walk", "walk", "waits: settle", "", "waits for the operator",
    ]  # fmt: skip


def test_people_are_told_by_role():
    assert TOLD.at(13.5).crew == "supervisor reads: picture"
    assert TOLD.at(14.5).crew == "supervisor reads: picture; primary decides: yes"
    assert TOLD.at(15.0).crew == ""


def test_a_direction_is_busy_while_bits_go_out_and_dark_when_it_is():
    assert [TOLD.at(t).link["down"] for t in (0.5, 1.5, 3.0, 5.0, 7.0)] == ["idle", "busy", "idle", "busy", "idle"]
    assert [TOLD.at(t).link["up"] for t in (15.2, 16.0, 17.9, 18.0)] == ["busy", "dark", "dark", "idle"]


def test_a_log_line_is_there_when_it_has_arrived():
    assert [TOLD.at(t).line for t in (3.9, 4.0, 30.0)] == ["", "A: begins", "A: begins"]


def test_the_end_is_told_with_its_cause():
    assert [TOLD.at(t).ended for t in (20.9, 21.0)] == ["", "failed: fell"]


def test_an_empty_log_tells_nothing():
    told = Telling([]).at(3.0)
    assert (told.state, told.mode, told.doing, told.crew, told.line, told.ended) == ("", "normal", "", "", "", "")


def test_what_a_real_run_tells_is_what_its_records_say(door):
    told = Telling.of(door.log)
    for record in door.log.records("machine/transition"):
        assert (
            told.at(record.t_s + 1e-9).state
            == [r.next_state for r in door.log.records("machine/transition") if r.t_s <= record.t_s + 1e-9][-1]
        )
    for record in door.log.records("field/episode"):
        if record.t_s > record.start_s:
            assert told.at((record.start_s + record.t_s) / 2).doing == record.skill
