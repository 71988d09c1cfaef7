"""Stills of a page: of which times, and how large."""

from io import BytesIO

import pytest
from PIL import Image

from teleop_sim.core.records import EpisodeEnded, RunEnded, TransitionTaken
from teleop_sim.replay.stills import MOST, moments, stays, stills


def taken(start_s, end_s, state, event, after):
    return TransitionTaken(end_s, state, event, after, start_s, "autonomous", "normal", 0, 0, 3, 0.0, "")


def skill(start_s, end_s, state, name):
    return EpisodeEnded(end_s, start_s, state, name, f"{name}()", "reached", "", end_s - start_s)


ENDED = RunEnded(40.0, "failed", "fell", float("nan"), 0, 0)
RUN = [
    taken(0.0, 10.0, "A", "go", "B"),
    taken(10.0, 15.0, "B", "again", "B"),
    taken(15.0, 20.0, "B", "done", "C"),
    taken(20.0, 30.0, "C", "on", "D"),
    ENDED,
]


def test_stays_join_self_loops_and_the_end_cuts_the_last():
    assert [(s.start_s, s.end_s, s.state, s.ended) for s in stays(RUN, 40.0)] == [
        (0.0, 10.0, "A", "go"),
        (10.0, 20.0, "B", "done"),
        (20.0, 30.0, "C", "on"),
        (30.0, 40.0, "D", "failed"),
    ]


def test_a_picture_is_taken_when_the_last_motion_of_a_stay_was_over():
    stirring = [(1.0, 2.0), (3.0, 4.0), (12.0, 22.0), (35.0, 38.0)]
    assert [(t_s, stay.state) for t_s, stay in moments(RUN, stirring, 40.0)] == [
        (4.0, "A"),
        (20.0, "B"),
        (22.0, "C"),
        (38.0, "D"),
    ]


def test_motion_that_ends_as_a_stay_begins_is_not_its_own():
    assert [s.state for _, s in moments(RUN, [(1.0, 2.0), (15.0, 20.0), (21.0, 22.0)], 40.0)] == ["A", "B", "C"]


def test_where_one_state_does_it_all_skills_are_shown():
    records = [
        skill(5.0, 6.0, "Operate", "look"),
        skill(8.0, 9.0, "Operate", "scan"),
        skill(9.0, 20.0, "Operate", "walk"),
    ]
    found = moments(records, [(5.0, 6.0), (9.0, 20.0)], 30.0)
    assert [(t_s, s.ended) for t_s, s in found] == [(6.0, "look: reached"), (20.0, "walk: reached")]


def test_of_too_many_the_first_stays_that_took_longest_are_kept_in_order():
    records, t_s = [], 0.0
    for k in range(60):
        records.append(taken(t_s, t_s + 1.0 + k % 30, f"S{k % 30}", "go", f"S{(k + 1) % 30}"))
        t_s += 1.0 + k % 30
    found = moments(records, [(0.0, t_s)], t_s)
    assert len(found) == MOST
    assert [s.state for _, s in found] == [f"S{k}" for k in range(6, 30)]
    assert [at_s for at_s, _ in found] == sorted(at_s for at_s, _ in found)


def test_where_nothing_moved_there_is_one_of_the_end():
    assert [(t_s, s.state) for t_s, s in moments(RUN, [], 40.0)] == [(40.0, "D")]
    assert len(moments([], [], 3.0)) == 1


@pytest.mark.parametrize("which", ["dish", "door", "valve"])
def test_a_run_has_small_pictures_of_its_states_with_words(which, request):
    log = request.getfixturevalue(which).log
    made = stills(log)
    assert 3 <= len(made) <= MOST
    assert sum(len(still.data) for still in made) < 600_000
    assert [still.t_s for still in made] == sorted(still.t_s for still in made)
    states = {r.state for r in log.records("machine/transition")} | {
        r.next_state for r in log.records("machine/transition")
    }
    for still in made:
        with Image.open(BytesIO(still.data)) as picture:
            assert (picture.format, picture.size) == ("JPEG", (320, 200))
        assert still.state in states
        assert still.state.rpartition("/")[2] in still.caption


def test_the_same_log_has_the_same_stills(door):
    assert stills(door.log, 96, 64) == stills(door.log, 96, 64)
