"""The executive on a real clock, with scripted programs."""

from __future__ import annotations

from dataclasses import astuple

import pytest
from scripted_site import REST_S, Site

from teleop_sim.core.errors import BadInput
from teleop_sim.core.records import ModeChanged, Released, Requested, TransitionTaken
from teleop_sim.machines.declare import FELL, INHERIT, Counter, Edge, Machine, Row, State
from teleop_sim.machines.src_dish import src_dish


def chain(thresholds):
    """States s0, s1, ... that follow each other on ``ok``, with the given thresholds."""
    names = [f"s{i}" for i in range(len(thresholds))]
    edges = tuple(Edge(a, "ok", b, t) for a, b, t in zip(names, [*names[1:], "end"], thresholds, strict=True))
    return Machine("chain", "s0", (*(State(n, n) for n in names), State("end")), edges, frozenset({"end"}))


def chain_script(n, seconds=1.0):
    return {f"s{i}": [(seconds, "ok")] for i in range(n)}


def worker(limit=2, **counter):
    """A state that may retry, give up to a person, or be forced past."""
    row = Row("retry", (Counter(limit, "retry", **counter),), "failed")
    return Machine(
        "worker",
        "work",
        (State("work", "work", (row,)), State("help", manual=True), State("end")),
        (
            Edge("work", "done", "end", 2),
            Edge("work", "retry", "work", 0, "retry"),
            Edge("work", "failed", "help", 2, "failed"),
            Edge("work", "busy", "work", INHERIT, "executing"),
            Edge("help", "again", "work", 3, "command", "operator"),
            Edge("help", "stop", "end", 3, "command", "operator"),
        ),
        frozenset({"end"}),
    )


@pytest.mark.parametrize("level", range(4))
def test_an_outcome_passes_by_itself_iff_its_threshold_is_below_the_level(level):
    thresholds = [0, 1, 2, 3]
    site = Site(chain(thresholds), chain_script(4), level, answer_s=5.0)
    result = site.run()
    hows = [r.how for r in site.of(TransitionTaken)]
    assert hows == ["autonomous" if t < level else "confirmed" for t in thresholds]
    assert result.outcome == "completed"
    assert result.round_trips == len(site.of(Requested)) == 4 - level
    assert [r.waited_s for r in site.of(TransitionTaken)] == [0.0 if t < level else 5.0 for t in thresholds]
    table = site.executive.machine.table
    assert table[site.told("transition")[2]].next_state == site.executive.state == "end"


@pytest.mark.parametrize("delay_s", [0.0, 3.0, 20.0])
def test_the_end_is_later_by_the_delay_of_each_round_trip(delay_s):
    site = Site(src_dish(), nominal(), level=0, answer_s=delay_s)
    result = site.run()
    alone = Site(src_dish(), nominal(), level=3)
    alone.run()
    assert result.round_trips == 14
    # Exact: the times are small binary fractions.
    assert site.env.now == alone.env.now + result.round_trips * delay_s


def nominal():
    """The shortest way through the dish task."""
    done = {e.state: e.event for e in reversed(src_dish().table) if e.kind == "done" and e.raised_by == "code"}
    return {state: [(0.5, event)] for state, event in done.items()}


def test_inherit_passes_even_at_off():
    site = Site(worker(), {"work": [(1.0, "busy"), (1.0, "busy"), (1.0, "done")]}, level=0, answer_s=1.0)
    site.run()
    assert [(r.event, r.how) for r in site.of(TransitionTaken)] == [
        ("busy", "autonomous"),
        ("busy", "autonomous"),
        ("done", "confirmed"),
    ]


def test_force_interrupts_the_program_and_waits_until_the_robot_rests():
    site = Site(worker(), {"work": [(100.0, "done")]})
    site.at(7.0, lambda: site.executive.force("done"))
    site.run()
    assert site.interrupted == [(7.0, "forced done")]
    [taken] = site.of(TransitionTaken)
    assert (taken.t_s, taken.how, taken.mode) == (7.0 + REST_S, "forced", "manual")
    assert [(r.effect, r.command) for r in site.of(Released)] == [("forced", "done")]


def test_a_second_command_while_the_robot_comes_to_rest_is_ignored():
    site = Site(worker(), {"work": [(100.0, "done")]})
    site.at(7.0, lambda: site.executive.force("done"))
    site.at(7.1, lambda: site.executive.force("failed"))
    site.run()
    assert site.events() == ["done"]
    assert [r.effect for r in site.of(Released)] == ["forced", "ignored"]


def test_an_event_that_the_state_does_not_have_is_ignored():
    site = Site(worker(), {"work": [(10.0, "done")]})
    site.at(1.0, lambda: site.executive.force("again"))
    site.run()
    assert [(r.effect, r.note) for r in site.of(Released)] == [("ignored", "not declared for work")]
    assert site.env.now == 10.0
    assert (1.0, "ignored again: not declared for work") in site.heard


@pytest.mark.parametrize("asked_first", [True, False])
def test_a_forced_event_wins_over_an_outcome_of_the_same_instant(asked_first):
    site = Site(worker(), {"work": [(5.0, "done")]})
    if asked_first:
        site.at(5.0, lambda: site.executive.force("retry"))
    else:
        site.at(1.0, lambda: site.at(5.0, lambda: site.executive.force("retry")))
    site.run(until_s=6.0)
    first = site.of(TransitionTaken)[0]
    assert (first.event, first.how, first.t_s) == ("retry", "forced", 5.0)


@pytest.mark.parametrize("limit", [0, 1, 5])
def test_the_attempt_after_the_last_retry_fails(limit):
    site = Site(worker(limit), {"work": [(1.0, "retry")]})
    site.at(50.0, lambda: site.executive.force("stop"))
    result = site.run()
    assert site.events() == ["retry"] * limit + ["failed", "stop"]
    assert [r.retries for r in site.of(TransitionTaken)][:-1] == list(range(1, limit + 2))
    assert (result.outcome, result.cause) == ("failed", "ended by the operator in help after work failed: after 1.0 s")
    assert result.round_trips == 1


def test_modes_follow_the_counts():
    script = {"work": [(1.0, "retry"), (1.0, "retry"), (1.0, "retry"), (1.0, "done")]}
    site = Site(worker(2), script)
    site.at(10.0, lambda: site.executive.force("again"))
    site.run()
    assert site.events() == ["retry", "retry", "failed", "again", "done"]
    assert [r.mode for r in site.of(TransitionTaken)] == ["normal", "auto", "auto", "manual", "manual"]
    assert [r.mode for r in site.of(ModeChanged)] == ["auto", "manual"]
    assert site.told("mode")[2] == "manual"


def test_a_success_ends_auto_mode():
    machine = chain([0, 0])
    edges = (*machine.edges, Edge("s0", "retry", "s0", 0, "retry"))
    machine = Machine("chain", "s0", machine.states, edges, machine.ends)
    site = Site(machine, {"s0": [(1.0, "retry"), (1.0, "ok")], "s1": [(1.0, "ok")]})
    site.run()
    assert [(r.event, r.mode, r.retries) for r in site.of(TransitionTaken)] == [
        ("retry", "normal", 1),
        ("ok", "auto", 1),
        ("ok", "normal", 0),
    ]


def test_every_row_of_the_dish_machine_exits_at_the_exact_count():
    for state in src_dish().states:
        for row in state.rows:
            assert count_failures(state.name, row) == row.attempts, (state.name, row.signal)


def count_failures(state, row):
    """Failures of one state until its row gives up, counted by driving the whole machine there."""
    script = nominal() | {state: [(0.5, row.signal)]}
    script["STATE_REDETECT_HANDLE"] = script.get("STATE_REDETECT_HANDLE", [])
    if state != "STATE_REDETECT_HANDLE":
        axis = "YAW" if "YAW" in state else "PITCH"
        script["STATE_REDETECT_HANDLE"] = [(0.5, f"/REDETECTED_HANDLE_GRASP_{axis}")]
    site = Site(src_dish(), script)
    bring_to(site, state)
    site.run(until_s=200.0)
    taken = [r for r in site.of(TransitionTaken) if r.state == state and r.how == "autonomous"]
    return 1 + [r.event for r in taken].index(row.failed)


def bring_to(site, state):
    """Two states lie off the nominal way; a person sends the machine there."""
    if state == "STATE_SKIP_TO_CP3":
        site.script["STATE_INIT"] = [(50.0, "/REGULAR")]
        site.at(2.0, lambda: site.executive.force("/SKIP_CHECKPOINT"))
    if state == "STATE_REDETECT_HANDLE":
        site.script["STATE_CORRECT_PITCH"] = [(0.5, "/PITCH_CORRECTION_RETRY")]


def test_passes_through_redetection_count_as_recovery_of_the_correcting_state():
    script = nominal() | {
        "STATE_CORRECT_YAW": [(1.0, "/YAW_CORRECTION_RETRY"), (1.0, "!timed_out"), (1.0, "/YAW_CORRECTION_SUCESSFUL")],
        "STATE_REDETECT_HANDLE": [(1.0, "/REDETECTED_HANDLE_GRASP_YAW")],
    }
    site = Site(src_dish(), script)
    assert site.run().outcome == "completed"
    yaw = [r for r in site.of(TransitionTaken) if r.state == "STATE_CORRECT_YAW"]
    assert [(r.mode, r.retries) for r in yaw] == [("normal", 1), ("auto", 2), ("auto", 2)]
    assert {r.mode for r in site.of(TransitionTaken) if r.state != "STATE_CORRECT_YAW"} == {"normal"}


def test_counters_that_wpi_never_cleared_are_kept():
    script = nominal() | {
        "STATE_WALK_TO_SEE_PANEL": [(0.5, "/WALK_RETRY")] * 4 + [(0.5, "/REACHED_PANEL")],
        "STATE_DETECT_FINISH": [(0.5, "/DETECT_FINISH_RETRY")] * 4 + [(0.5, "/DETECT_FINISH_SUCESSFUL")],
    }
    site = Site(src_dish(), script)
    site.run()
    counts = site.executive.variables.counts
    assert counts["STATE_WALK_TO_SEE_PANEL", "/WALK_RETRY"] == [4]
    assert counts["STATE_DETECT_FINISH", "/DETECT_FINISH_RETRY"] == [0]


def test_stale_answers_change_nothing():
    site = Site(chain([0, 0]), chain_script(2), level=0)
    for when_s, request in ((0.5, 1), (1.5, 2), (2.0, 1), (2.5, 1), (4.0, 2)):
        site.at(when_s, lambda request=request: site.executive.confirm(request))
    result = site.run()
    assert [(r.t_s, r.request, r.effect) for r in site.of(Released)] == [
        (0.5, 0, "ignored"),
        (1.5, 0, "ignored"),
        (2.0, 1, "answered"),
        (2.5, 0, "ignored"),
        (4.0, 2, "answered"),
    ]
    assert (result.round_trips, site.env.now) == (2, 4.0)


def test_a_rejected_event_is_not_taken_and_the_program_runs_again():
    site = Site(worker(), {"work": [(1.0, "done"), (1.0, "done")]}, level=0)
    site.at(3.0, lambda: site.executive.reject(1))
    site.at(6.0, lambda: site.executive.confirm(2))
    result = site.run()
    assert site.started == [(0, "work"), (3.0, "work")]
    assert site.events() == ["done"]
    assert (result.round_trips, site.env.now) == (2, 6.0)


def test_a_force_answers_the_open_request():
    site = Site(worker(), {"work": [(1.0, "done"), (1.0, "done")]}, level=0)
    site.at(3.0, lambda: site.executive.force("retry"))
    site.at(6.0, lambda: site.executive.force("done"))
    result = site.run()
    assert [(r.request, r.effect) for r in site.of(Released)] == [(1, "answered"), (2, "answered")]
    assert [(r.event, r.how, r.waited_s) for r in site.of(TransitionTaken)] == [
        ("retry", "forced", 2.0),
        ("done", "forced", 2.0),
    ]
    assert result.round_trips == 2


def test_a_level_that_is_high_enough_lets_the_suggested_event_pass():
    site = Site(worker(), {"work": [(1.0, "done")]}, level=0)
    site.at(2.0, lambda: site.executive.set_level(2))
    site.at(4.0, lambda: site.executive.set_level(3))
    result = site.run()
    [taken] = site.of(TransitionTaken)
    assert (taken.t_s, taken.how, taken.level, taken.waited_s) == (4.0, "autonomous", 3, 3.0)
    assert result.round_trips == 0
    assert [r.effect for r in site.of(Released)] == ["level", "level"]
    assert site.told("level")[2] == 3


def test_a_level_that_falls_holds_the_next_outcome():
    site = Site(chain([0, 0]), chain_script(2), level=3, answer_s=1.0)
    site.at(1.5, lambda: site.executive.set_level(0))
    assert site.run().round_trips == 1
    with pytest.raises(BadInput):
        site.executive.set_level(4)


def test_the_manual_state_waits_for_ever():
    site = Site(worker(0), {"work": [(1.0, "retry")]})
    assert site.run(until_s=500.0) is None
    assert [(r.kind, r.event) for r in site.of(Requested)] == [("manual", "")]
    assert site.told("request")[2] == 1
    site.executive.confirm(1)
    assert site.of(Released)[-1].effect == "ignored"


@pytest.mark.parametrize("noticed_by", ["program", "field", "field while waiting", "while coming to rest"])
def test_a_fall_cannot_be_recovered(noticed_by):
    script = {"work": [(2.0, FELL if noticed_by == "program" else "done")]}
    site = Site(worker(), script, level=0 if noticed_by == "field while waiting" else 3)
    if noticed_by == "while coming to rest":
        site.at(1.0, lambda: site.executive.force("done"))
    if noticed_by != "program":
        when_s = 5.0 if noticed_by == "field while waiting" else 1.1
        site.at(when_s, lambda: site.executive.fell("toppled"))
    result = site.run()
    assert result.outcome == "failed"
    assert result.cause == ("after 2.0 s" if noticed_by == "program" else "toppled")
    assert site.of(TransitionTaken) == []
    assert site.of(ModeChanged)[-1].mode == "not_recoverable"


def test_a_signal_that_the_machine_does_not_know_is_a_fault_of_the_program():
    site = Site(worker(), {"work": [(1.0, "reached")]})
    with pytest.raises(BadInput, match="'reached', which the machine does not know"):
        site.run()


def test_the_same_script_gives_the_same_records():
    def once():
        site = Site(src_dish(), nominal(), level=1, answer_s=2.5)
        site.at(3.0, lambda: site.executive.set_level(0))
        site.at(3.0, lambda: site.executive.force("/REGULAR"))
        site.run()
        return [(type(r).__name__, astuple(r)) for r in site.records]

    assert once() == once()
