"""What a running machine asks for and is given: decisions, data, acts in lieu; keys, parameters, pauses, changes."""

from __future__ import annotations

import pytest
from scripted_site import REST_S, Asks, Site

from teleop_sim.core.records import Released, Requested
from teleop_sim.machines.declare import Machine, embed
from teleop_sim.machines.elements import INHERIT, Edge, Given, Group, Parameter, State
from teleop_sim.machines.modify import Patch, RemoveOutcome, SetTarget, SetThreshold


def one(threshold=0, **declared):
    """``s`` with outcomes ``ok`` and ``no``; then the end."""
    state = State("s", **(declared or {"program": "s"}))
    edges = (Edge("s", "ok", "end", threshold), Edge("s", "no", "end", threshold))
    return Machine("one", "s", (state, State("end")), edges, frozenset({"end"}))


# Decisions


def test_a_decision_waits_for_a_person_who_chooses():
    site = Site(one(decides=True), {})
    site.at(3.0, lambda: site.executive.confirm(1))
    site.at(4.0, lambda: site.executive.force("no"))
    site.run()
    assert [(r.kind, r.event) for r in site.of(Requested)] == [("decide", "")]
    assert [(r.effect, r.note) for r in site.of(Released)] == [
        ("ignored", "nothing is suggested: it asks for an event"),
        ("answered", "s"),
    ]
    assert site.taken() == [(4.0, "s", "no", "forced")]


def test_a_decision_that_suggests_is_confirmed_refused_or_passes():
    machine = one(1, decides=True, suggests="ok")
    site = Site(machine, {}, 1)
    site.at(2.0, lambda: site.executive.reject(1))
    site.at(3.0, lambda: site.executive.confirm(2))
    site.run()
    assert [(r.kind, r.event) for r in site.of(Requested)] == [("decide", "ok")] * 2
    assert site.taken() == [(3.0, "s", "ok", "confirmed")]
    alone = Site(machine, {}, 2)
    alone.run()
    assert alone.taken() == [(0.0, "s", "ok", "autonomous")]


def test_a_decision_that_suggests_passes_when_the_level_rises():
    site = Site(one(1, decides=True, suggests="ok"), {}, 0)
    site.at(2.0, lambda: site.executive.set_level(2))
    site.run()
    assert site.taken() == [(2.0, "s", "ok", "autonomous")]


# Data


def test_a_program_asks_for_data_and_goes_on_with_them():
    site = Site(one(), {"s": [Asks("where is the valve?", 2.0, "ok")]}, 3)
    site.at(4.0, lambda: site.executive.answer(1, (1, 2)), lambda: site.executive.answer(1, (3, 4)))
    result = site.run()
    assert [(r.kind, r.text) for r in site.of(Requested)] == [("data", "where is the valve?")]
    assert [(r.request, r.effect) for r in site.of(Released)] == [(1, "answered"), (0, "ignored")]
    assert site.told("withdrawn") == (4.0, "withdrawn", 1)
    assert (result.round_trips, site.env.now) == (1, 6.0)


def test_a_request_for_data_is_withdrawn_when_the_state_is_left():
    site = Site(one(), {"s": [Asks("where", 2.0, "ok")]}, 3)
    site.at(4.0, lambda: site.executive.force("no"))
    site.at(4.1, lambda: site.executive.answer(1, 0))
    site.run()
    assert site.told("withdrawn") == (4.0, "withdrawn", 1)
    assert site.effects() == ["answered", "ignored"]
    assert site.taken() == [(4.0 + REST_S, "s", "no", "forced")]


def test_a_request_for_data_is_withdrawn_when_the_program_goes_on_without():
    site = Site(one(1), {"s": [Asks("where", 0.0, "ok", patience_s=3.0)]}, 0)
    site.at(4.0, lambda: site.executive.answer(1, 0), lambda: site.executive.confirm(2))
    site.run()
    assert [(r.t_s, r.request, r.kind) for r in site.of(Requested)] == [(0.0, 1, "data"), (3.0, 2, "confirm")]
    assert site.effects() == ["ignored", "answered"]


def test_data_may_be_given_to_a_locked_state():
    site = Site(one(), {"s": [Asks("where", 1.0, "ok")]}, 3)
    site.at(1.0, lambda: site.executive.lock("s"))
    site.at(2.0, lambda: site.executive.answer(1, 0))
    site.at(9.0, lambda: site.executive.unlock("s"))
    site.run()
    assert site.taken() == [(9.0, "s", "ok", "autonomous")]


def test_a_program_that_asks_again_withdraws_what_it_asked_before():
    site = Site(one(), {"s": [(9.0, "ok")]})
    site.at(2.0, lambda: site.starts[0].ask("where"), lambda: site.starts[0].ask("which"))
    site.at(3.0, lambda: site.executive.answer(1, 0), lambda: site.executive.answer(2, 0))
    site.run()
    assert [(p.request, p.text) for p in site.of(Requested)] == [(1, "where"), (2, "which")]
    assert site.effects() == ["ignored", "answered"]


# Acts in lieu


@pytest.mark.parametrize(("level", "seconds", "from_s"), [(3, 50.0, 2.0 + REST_S), (0, 1.0, 2.0)])
def test_the_operator_takes_over_from_a_program_or_a_suggestion_and_ends_it(level, seconds, from_s):
    site = Site(one(), {"s": [(seconds, "ok")]}, level)
    site.at(2.0, lambda: site.executive.take_over("s"))
    site.at(6.0, lambda: site.executive.force("no"))
    site.run()
    asked = site.of(Requested)[-1]
    assert (asked.t_s, asked.kind, asked.event) == (from_s, "act", "")
    assert site.effects() == ["taken over", "answered"]
    assert site.taken() == [(6.0, "s", "no", "forced")]


def test_the_operator_hands_back_and_the_program_starts_anew():
    site = Site(one(), {"s": [(50.0, "ok"), (1.0, "ok")]})
    site.at(2.0, lambda: site.executive.take_over("s"))
    site.at(6.0, lambda: site.executive.reject(1))
    site.run()
    assert site.started == [(0.0, "s"), (6.0, "s")]
    assert site.told("mode")[2] == "normal"
    assert site.taken() == [(7.0, "s", "ok", "autonomous")]


# Pause


def test_what_has_ended_at_the_instant_of_a_pause_is_not_done_twice():
    site = Site(one(), {"s": [(2.0, "ok")]})
    site.at(2.0, lambda: site.executive.pause())
    site.at(5.0, lambda: site.executive.resume())
    site.run()
    assert site.started == [(0.0, "s")]
    assert site.taken() == [(5.0, "s", "ok", "autonomous")]


def test_a_short_pause_does_not_swallow_what_is_forced_while_the_robot_comes_to_rest():
    site = Site(one(), {"s": [(50.0, "ok")]})
    site.at(2.0, lambda: site.executive.pause())
    site.at(2.1, lambda: site.executive.resume(), lambda: site.executive.force("no"))
    site.run()
    assert site.taken() == [(2.0 + REST_S, "s", "no", "forced")]


def test_what_was_confirmed_and_is_held_by_a_pause_is_asked_no_more():
    site = Site(one(2), {"s": [(1.0, "ok")]}, 0)
    site.at(2.0, lambda: site.executive.confirm(1), lambda: site.executive.pause())
    site.at(3.0, lambda: site.executive.resume())
    site.run(until_s=2.5)
    assert site.executive.pendings == ()
    site.go_on(9.0)
    assert site.taken() == [(3.0, "s", "ok", "confirmed")]


# Keys and parameters


def seeker():
    """Looks for something of a colour, in ``Look``, and goes there."""
    look = State(
        "look",
        "look",
        reads=(("start", "here"),),
        writes=(("data", "seen"),),
        parameters=(("colour", Given("colour")), ("tries", 3)),
    )
    inner = Group(
        "Look", "look", (look,), (Edge("look", "ok", "ok", 0),), ("ok",),
        reads=(("here", "home"),), writes=(("seen", "goal"),), data=(("seen", "none"),),
    )  # fmt: skip
    go = State("go", "go", reads=(("to", "goal"),))
    edges = (Edge("Look", "ok", "go", 0), Edge("go", "ok", "ok", 0), Edge("go", "no", "Look", 0))
    return Machine(
        "seeker", "Look", (inner, go), edges, outcomes=("ok",), goals=frozenset({"ok"}),
        parameters=(Parameter("colour", "red", ("red", "blue")),), data=(("home", 7),), writes=("goal",),
    )  # fmt: skip


def test_keys_go_through_containers_under_other_names_and_parameters_are_told():
    site = Site(seeker().given(colour="blue"), {"look": [(1.0, "ok", {"data": 42})], "go": [(1.0, "ok")]})
    assert site.run().outcome == "completed"
    look, go = site.starts
    assert (dict(look.reads), dict(look.parameters)) == ({"start": 7}, {"colour": "blue", "tries": 3})
    assert dict(go.reads) == {"to": 42}


def test_a_container_that_is_forced_writes_nothing_and_one_that_is_entered_again_begins_afresh():
    site = Site(seeker(), {"look": [(50.0, "ok"), (1.0, "ok")], "go": [(1.0, "no"), (1.0, "ok")]})
    site.at(2.0, lambda: site.executive.force("ok", "Look"))
    site.run()
    assert [dict(s.reads) for s in site.starts if s.path == "go"] == [{"to": None}, {"to": "none"}]


@pytest.mark.parametrize("how", ["loop", "rejected"])
def test_a_container_that_begins_anew_at_once_has_forgotten_its_keys(how):
    note = State("note", "note", reads=(("old", "seen"),), writes=(("data", "seen"),))
    edges = (Edge("note", "ok", "ok", 0), Edge("note", "more", "more", 0))
    inner = Group("In", "note", (note,), edges, ("ok", "more"), data=(("seen", "none"),))
    around = (Edge("In", "ok", "end", 2), Edge("In", "more", "In", INHERIT))
    machine = Machine("again", "In", (inner, State("end")), around, frozenset({"end"}))
    first = (1.0, "more" if how == "loop" else "ok", {"data": 42})
    site = Site(machine, {"note": [first, (1.0, "ok")]}, 1)
    if how == "rejected":
        site.at(3.0, lambda: site.executive.reject(1))
    site.at(9.0, lambda: site.executive.force("ok", "In"))
    site.run()
    assert [dict(s.reads) for s in site.starts] == [{"old": "none"}] * 2


def test_an_embedded_behaviour_has_its_parameters_and_its_keys_under_the_names_around_it():
    part = embed("Seek", seeker().given(colour="blue"), reads=(), writes=(("goal", "place"),), data=(("home", 8),))
    use = State("use", "use", reads=(("at", "place"),))
    machine = Machine(
        "whole", "Seek", (part, use, State("end")), (Edge("Seek", "ok", "use", INHERIT), Edge("use", "ok", "end", 0)),
        frozenset({"end"}),
    )  # fmt: skip
    site = Site(machine, {"look": [(1.0, "ok", {"data": 42})], "go": [(1.0, "ok")], "use": [(1.0, "ok")]})
    site.run()
    assert [s.path for s in site.starts] == ["Seek/Look/look", "Seek/go", "use"]
    assert (dict(site.starts[0].reads), dict(site.starts[0].parameters)["colour"]) == ({"start": 8}, "blue")
    assert dict(site.starts[2].reads) == {"at": 42}


# Changes while it runs


def change(site, *operations, base=None):
    checksum = site.executive.machine.checksum if base is None else base
    site.executive.modify(Patch(checksum, operations))


def test_a_lower_threshold_lets_pass_what_was_suggested():
    site = Site(one(2), {"s": [(1.0, "ok")]}, 1)
    site.at(4.0, lambda: change(site, SetThreshold("s", "ok", 0)))
    site.run()
    assert site.effects() == ["modified"]
    assert site.taken() == [(4.0, "s", "ok", "autonomous")]
    assert site.told("snapshot")[2].behaviour == site.executive.machine.checksum


def test_a_change_is_refused_that_is_for_another_version_or_takes_away_what_is_suggested():
    site = Site(one(2), {"s": [(1.0, "ok")]}, 1)
    site.at(
        4.0, lambda: change(site, SetThreshold("s", "ok", 0), base=1), lambda: change(site, RemoveOutcome("s", "ok"))
    )
    site.run(until_s=5.0)
    first, second = site.of(Released)
    assert (first.effect, second.effect) == ("ignored", "ignored")
    assert "checksum" in first.note
    assert second.note == "would vanish while at work: s: ok"
    assert site.executive.machine == one(2)


def test_what_a_running_program_may_come_to_is_not_taken_away():
    machine = Machine(
        "two", "s", (State("s", "s"), State("end")), (Edge("s", "ok", "end", 0), Edge("s", "no", "s", 0, "retry")),
        frozenset({"end"}),
    )  # fmt: skip
    site = Site(machine, {"s": [(3.0, "no"), (3.0, "ok")]})
    site.at(1.0, lambda: change(site, RemoveOutcome("s", "no")))
    site.run()
    assert site.effects() == ["ignored"]
    assert [event for _, _, event, _ in site.taken()] == ["no", "ok"]


def test_a_new_target_holds_for_what_is_at_work():
    machine = Machine(
        "two", "s", (State("s", "s"), State("t", "t"), State("end")),
        (Edge("s", "ok", "t", 0), Edge("s", "no", "end", 0), Edge("t", "ok", "end", 0), Edge("t", "no", "s", 0)),
        frozenset({"end"}),
    )  # fmt: skip
    site = Site(machine, {"s": [(3.0, "no"), (3.0, "ok")], "t": [(1.0, "ok")]})
    site.at(1.0, lambda: change(site, SetTarget("s", "no", "t")))
    site.run()
    assert [path for _, path in site.started] == ["s", "t"]


# A control station that joins


@pytest.mark.parametrize("known", [True, False])
def test_a_control_station_that_joins_is_told_everything(known):
    site = Site(one(), {"s": [(9.0, "ok")]})
    checksum = site.executive.machine.checksum
    site.at(4.0, lambda: site.executive.attach(checksum if known else 5))
    site.run()
    assert site.told("snapshot")[0] == 4.0
    assert ((4.0, f"machine one has checksum {checksum:08x} here") in site.heard) is not known


# Before and after


def test_nothing_can_be_done_before_the_start_or_after_the_end():
    site = Site(one(), {"s": [(1.0, "ok")]})
    acts = (
        lambda e: e.force("ok"), lambda e: e.take_over("s"), lambda e: e.lock("s"), lambda e: e.unlock("s"),
        lambda e: e.pause(), lambda e: e.resume(), lambda e: e.preempt(), lambda e: e.confirm(1), lambda e: e.reject(1),
        lambda e: e.answer(1, 0),
    )  # fmt: skip
    for act in acts:
        act(site.executive)
    site.run()
    for act in acts:
        act(site.executive)
    assert site.effects() == ["ignored"] * 20
    assert site.taken() == [(1.0, "s", "ok", "autonomous")]


def test_preempting_tells_where_and_withdraws_what_is_asked():
    site = Site(one(2), {"s": [(1.0, "ok")]}, 0)
    site.at(4.0, lambda: site.executive.preempt())
    result = site.run()
    assert (result.outcome, result.cause, site.env.now) == ("failed", "preempted by the operator in s", 4.0)
    assert site.told("withdrawn") == (4.0, "withdrawn", 1)
