"""What a crew does besides confirming, found in records by hand; what a terminal is told of a door."""

from io import StringIO

import pytest
from rich.console import Console

from teleop_sim.core.records import (
    Layer,
    ModeChanged,
    PacketEnded,
    Released,
    Requested,
    RunEnded,
    RunStarted,
    Scored,
    TransitionTaken,
)
from teleop_sim.reports.captions import crew, settings, task
from teleop_sim.reports.drc_marks import MARKS, Mark, counts, laid_anew, marks
from teleop_sim.reports.drc_show import crew_lines, is_drc, times_json
from teleop_sim.reports.lanes import shown_names, state_bars
from teleop_sim.reports.run_tables import state_sheet
from teleop_sim.reports.table import state_table
from teleop_sim.reports.terminal import rich_times
from teleop_sim.reports.timeline_layers import draw_layers

SCENARIO = """
robot = "atlas"
task = "drc-door"
layer = "behaviour"
autonomy = "low"
pacing = "eager"
[operator]
policy = "collaborate"
team = 4
[link]
clock = "simulated"
preset = "drc-finals-2015"
"""
NAN = float("nan")


def started(text=SCENARIO, scenario="drc-door-day1"):
    return RunStarted(0.0, scenario, text, 1, 0, 1800.0, "")


def left(entered_s, t_s, state, how="autonomous"):
    return TransitionTaken(t_s, state, "done", "next", entered_s, how, "normal", 0, 1, 2, 0.0, "")


def sent(t_s, topic, direction="up"):
    return PacketEnded(
        t_s + 1.0, direction, 1, topic, 9, 72, t_s, t_s, t_s + 1.0, 0.0, 0.0, 0.5, 0.5, "delivered", "", ""
    )


def act(t_s, number, state):
    return Requested(t_s, number, "act", state, "", "")


RUN = [
    started(),
    sent(20.0, "template_insert"),
    Layer(20.0, 5.0, "alignment", "lay the template"),
    left(0.0, 22.0, "Ask"),
    Released(23.0, 0, "level 2", "level", ""),
    Layer(30.0, 25.0, "alignment", "compare template and cloud"),
    left(22.0, 31.0, "Arm/Look"),
    left(31.0, 32.0, "Arm/Choose", "forced"),
    act(40.0, 1, "Arm/Grasp"),
    Layer(50.0, 42.0, "template", "order grasp"),
    Layer(60.0, 52.0, "teleoperation", "hand to the lever"),
    sent(70.0, "template_move"),
    Layer(70.0, 62.0, "alignment", "lay the template anew"),
    Layer(80.0, 72.0, "template", "order grasp"),
    left(32.0, 90.0, "Arm/Grasp", "forced"),
    Requested(91.0, 2, "confirm", "Arm/Turn", "done", ""),
    Layer(99.0, 95.0, "template", "nudge"),
    left(90.0, 100.0, "Arm/Turn", "confirmed"),
    Scored(110.0, 1, "door off its latch"),
    RunEnded(110.0, "completed", "", 110.0, 0, 0),
]
"""A behaviour that people help: laid, compared, taken over, down to the hand and up again, handed back, nudged."""


def test_every_kind_of_mark_is_found_where_it_happened():
    assert marks(RUN) == [
        Mark(23.0, "level", "behaviour"),
        Mark(32.0, "forced", "behaviour"),
        Mark(40.0, "in lieu", "behaviour"),
        Mark(42.0, "down", "template"),
        Mark(52.0, "down", "teleoperation"),
        Mark(62.0, "anew", "alignment"),
        Mark(72.0, "up", "template"),
        Mark(90.0, "up", "behaviour"),
        Mark(95.0, "down", "template"),
        Mark(100.0, "up", "behaviour"),
    ]
    assert counts(RUN) == {"level": 1, "forced": 1, "in lieu": 1, "anew": 1, "down": 3, "up": 3}


def test_comparing_moves_no_template_and_neither_does_the_first_laying():
    assert laid_anew(RUN) == [(62.0, 70.0)]
    assert laid_anew([r for r in RUN if not isinstance(r, PacketEnded)]) == []
    assert laid_anew([*RUN[:-1], sent(98.0, "template_move", "down")]) == [(62.0, 70.0)]


def test_people_alone_act_in_lieu_of_nobody_and_begin_at_the_template():
    run = [
        started(scenario="x"),
        act(0.0, 1, "Operate"),
        Layer(20.0, 10.0, "template", "order grasp"),
        Layer(30.0, 21.0, "teleoperation", "hand"),
        Layer(40.0, 31.0, "template", "order push"),
        left(0.0, 50.0, "Operate", "forced"),
        RunEnded(50.0, "completed", "", 50.0, 0, 0),
    ]
    assert marks(run) == [Mark(21.0, "down", "teleoperation"), Mark(31.0, "up", "template")]


def test_a_run_that_ends_in_a_persons_hands_hands_nothing_back():
    run = [*RUN[:11], Scored(70.0, 1, "door off its latch"), RunEnded(70.0, "completed", "", 70.0, 0, 0)]
    assert [mark.kind for mark in marks(run)][-2:] == ["down", "down"]


def test_nothing_has_no_marks():
    assert marks([]) == []
    assert counts([started()]) == dict.fromkeys(MARKS, 0)


def test_the_picture_has_a_shape_for_each_and_says_what_it_means(tmp_path):
    draw_layers([RUN], tmp_path / "a.svg")
    text = (tmp_path / "a.svg").read_text()
    for words in ("level of autonomy changed", "template laid anew", "fell back a layer", "handed back"):
        assert words in text
    assert "atlas · behaviour at level low · 4 at the station · collaborate · link drc-finals-2015" in text
    calm = tmp_path / "calm.svg"
    draw_layers([[r for r in RUN if not isinstance(r, Released | PacketEnded)]], calm)
    # a level change and a template laid anew are two marks more, and nothing else
    assert text.count("<use") == calm.read_text().count("<use") + 2


def shown(table, width=120):
    out = StringIO()
    Console(width=width, file=out).print(table)
    return out.getvalue()


def test_a_terminal_gets_the_papers_row_beside_the_runs_own():
    text = shown(rich_times(RUN))
    assert "ViGIR Door Day 1" in text
    assert "in reset" in text
    assert "…" not in text
    assert "…" not in shown(rich_times(RUN, narrow=True), 60)
    assert "this run, not completed" in shown(rich_times(RUN[:-1]))
    told, longest = crew_lines(RUN)
    assert told.startswith("crew: 1 x level of autonomy changed, 1 x transition forced, ")
    assert longest == "longest states: Arm/Grasp 58 s, Ask 22 s, Arm/Turn 10 s"
    assert crew_lines([started(), RunEnded(9.0, "failed", "", NAN, 0, 0)]) == []
    assert times_json(RUN)["crew"] == counts(RUN)
    assert set(times_json(RUN)) == {"times", "crew"}


@pytest.mark.parametrize("text", ["", "not toml [", "[operator]\nteam = 1", "link = 3\nrobot = 'atlas'"])
def test_captions_of_a_log_that_says_little(text):
    assert isinstance(crew([started(text)]), str)
    assert isinstance(settings([started(text)]), str)
    assert task([started(text)]) == ""
    assert not is_drc([started(text)])


def test_captions_say_who_and_over_what():
    assert task([]) == ""
    assert is_drc([started()])
    assert settings([started()]) == "autonomy low · pacing eager · link drc-finals-2015"
    both = 'layer = "template"\n[link]\nclock = "x"\n[link.up]\nrate_bps = 1e7\ndelay_s = 0.002\n'
    assert crew([started(both)]) == "people only · one at the station · uplink 10 Mbit/s, 2 ms one way"


def test_states_of_machines_in_machines_that_took_no_time_have_no_row():
    run = [left(0.0, 5.0, "Arm/Go/Plan"), left(5.0, 5.0, "Arm/Go"), left(5.0, 9.0, "Arm/Turn")]
    run.append(ModeChanged(12.0, "x", "auto"))
    names, bars = state_bars(run)
    assert names == ["Arm/Go/Plan", "Arm/Turn", "next"]
    assert [(bar.start_s, bar.end_s, bar.row) for bar in bars] == [(0.0, 5.0, 0), (5.0, 9.0, 1), (9.0, 12.0, 2)]
    assert shown_names(["A/B/C", "STATE_A", "D/E/F", "G/E/F"]) == ["B/C", "A", "D/E/F", "G/E/F"]


def test_the_states_of_another_machine_have_no_columns_of_the_wpi_paper():
    sheet = state_sheet(state_table([RUN]))
    assert not any(c.name.startswith("paper") for c in sheet.columns)
    assert ("Arm/Grasp", 100.0, 0.0, 0.0, 0, 58.0) in sheet.rows
    theirs = state_sheet(state_table([[left(0.0, 5.0, "STATE_DETECT_PANEL_COARSE")]]))
    assert theirs.columns[-1].name == "paper_time_s"
