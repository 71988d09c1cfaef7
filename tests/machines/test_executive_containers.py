"""Containers on the clock: several states at work, containers that end, locks, priority.

In every test the control station follows what it is told, and ``Site`` compares it with the executive at each instant.
"""

from __future__ import annotations

import pytest
from scripted_site import REST_S, Site

from teleop_sim.core.records import ModeChanged, Released, Requested, TransitionTaken
from teleop_sim.machines.declare import FELL, INHERIT, Machine
from teleop_sim.machines.elements import PARKED, Concurrence, Edge, Group, Rule, State


def work(*names):
    return tuple(State(name, name) for name in names)


def top(child, *edges, tail=("after",)):
    """A machine of one container and what follows it."""
    states = (child, *work(*tail), State("end"))
    follow = tuple(Edge(name, "ok", "end", 0) for name in tail)
    return Machine("top", child.name, states, (*edges, *follow), frozenset({"end"}))


def beside(finish="all", rules=(), threshold=INHERIT, **thresholds):
    """``Both``: ``a`` and ``b`` at once, each with ``ok`` and ``bad``; ``Both`` itself has ``good`` and ``poor``."""
    edges = tuple(
        Edge(name, event, PARKED, thresholds.get(name, 0), "failed" if event == "bad" else "done")
        for name in ("a", "b")
        for event in ("ok", "bad")
    )
    both = Concurrence("Both", work("a", "b"), edges, ("good", "poor"), finish, rules, default="poor")
    out = (Edge("Both", "good", "after", threshold), Edge("Both", "poor", "help", threshold))
    return top(both, *out, tail=("after", "help"))


REST_OF = {"after": [(1.0, "ok")], "help": [(1.0, "ok")]}


def nested(g=INHERIT, h=INHERIT):
    inner = Group("H", "a", work("a", "b"), (Edge("a", "ok", "b", 0), Edge("b", "ok", "done", 0)), ("done",))
    outer = Group("G", "H", (inner,), (Edge("H", "done", "done", h),), ("done",))
    return top(outer, Edge("G", "done", "after", g))


NESTED = {"a": [(1.0, "ok")], "b": [(1.0, "ok")], "after": [(1.0, "ok")]}


# Containers one in the other


def test_an_outcome_goes_out_through_all_containers_that_let_it():
    site = Site(nested(), NESTED, 1)
    assert site.run().outcome == "completed"
    assert site.taken() == [
        (1.0, "G/H/a", "ok", "autonomous"),
        (2.0, "G/H/b", "ok", "autonomous"),
        (2.0, "G/H", "done", "autonomous"),
        (2.0, "G", "done", "autonomous"),
        (3.0, "after", "ok", "autonomous"),
    ]


def test_a_container_guards_its_own_outcome():
    site = Site(nested(h=2), NESTED, 2)
    site.at(5.0, lambda: site.executive.confirm(1))
    site.run()
    [asked] = site.of(Requested)
    assert (asked.t_s, asked.kind, asked.state, asked.event) == (2.0, "confirm", "G/H", "done")
    assert site.taken()[2:4] == [(5.0, "G/H", "done", "confirmed"), (5.0, "G", "done", "autonomous")]


def test_a_refused_outcome_of_a_container_begins_anew_what_is_in_it():
    site = Site(nested(h=2), NESTED, 2)
    site.at(5.0, lambda: site.executive.reject(1))
    site.at(9.0, lambda: site.executive.confirm(2))
    site.run()
    assert [path for _, path in site.started] == ["G/H/a", "G/H/b", "G/H/a", "G/H/b", "after"]
    assert site.told("snapshot")[0] == 5.0
    assert (9.0, "G/H", "done", "confirmed") in site.taken()


def test_a_loop_of_a_container_on_itself_enters_it_anew():
    inner = Group("G", "a", work("a"), (Edge("a", "ok", "out", 0), Edge("a", "more", "again", 0)), ("out", "again"))
    machine = top(inner, Edge("G", "out", "after", 0), Edge("G", "again", "G", INHERIT, "retry"))
    site = Site(machine, {"a": [(1.0, "more"), (1.0, "ok")], "after": [(1.0, "ok")]})
    site.run()
    assert site.events() == ["more", "again", "ok", "out", "ok"]
    assert [path for _, path in site.started] == ["G/a", "G/a", "after"]


def test_a_forced_outcome_of_a_container_brings_its_inside_to_rest():
    site = Site(nested(), NESTED | {"b": [(50.0, "ok")]})
    site.at(4.0, lambda: site.executive.force("done", "G"))
    site.run()
    assert site.taken()[1:] == [(4.0 + REST_S, "G", "done", "forced"), (5.0 + REST_S, "after", "ok", "autonomous")]
    assert [r.mode for r in site.of(ModeChanged)] == ["manual", "normal"]


def test_what_leaves_more_wins_over_what_is_decided_inside():
    site = Site(nested(), NESTED | {"a": [(50.0, "ok")]})
    site.at(4.0, lambda: site.executive.force("ok", "G/H/a"))
    site.at(4.1, lambda: site.executive.force("done", "G"))
    site.at(4.2, lambda: site.executive.force("done", "G"))
    site.run()
    assert site.effects() == ["forced", "forced", "ignored"]
    assert site.events() == ["done", "ok"]


def test_two_containers_forced_at_once_end_with_the_outer_one():
    site = Site(nested(), NESTED | {"a": [(50.0, "ok")]})
    site.at(4.0, lambda: site.executive.force("done", "G/H"), lambda: site.executive.force("done", "G"))
    assert site.run().outcome == "completed"
    assert site.taken()[0] == (4.0 + REST_S, "G", "done", "forced")


def test_nothing_is_forced_in_what_is_left_already():
    site = Site(nested(), NESTED | {"a": [(50.0, "ok")]})
    site.at(4.0, lambda: site.executive.force("done", "G"))
    site.at(4.1, lambda: site.executive.force("done", "G/H"), lambda: site.executive.force("ok", "G/H/a"))
    site.run()
    assert [(r.effect, r.note) for r in site.of(Released)] == [
        ("forced", "G"),
        ("ignored", "already decided"),
        ("ignored", "already decided"),
    ]
    assert site.events() == ["done", "ok"]


# Several at once


@pytest.mark.parametrize(
    ("finish", "rules", "a", "b", "ended_s", "outcome"),
    [
        ("all", (Rule("good", (("a", "ok"), ("b", "ok"))),), (1.0, "ok"), (3.0, "ok"), 3.0, "good"),
        ("all", (Rule("good", (("a", "ok"), ("b", "ok"))),), (1.0, "bad"), (3.0, "ok"), 3.0, "poor"),
        ("all", (Rule("good", (("a", "bad"),)), Rule("poor", (("b", "ok"),))), (1.0, "bad"), (3.0, "ok"), 3.0, "good"),
        ("all", (Rule("poor", (("b", "ok"),)), Rule("good", (("a", "bad"),))), (1.0, "bad"), (3.0, "ok"), 3.0, "poor"),
        ("any", (Rule("good", (("a", "ok"),)),), (1.0, "ok"), (3.0, "ok"), 1.0 + REST_S, "good"),
        ("any", (Rule("good", (("a", "ok"),)),), (4.0, "ok"), (3.0, "ok"), 3.0 + REST_S, "poor"),
        ("map", (Rule("good", (("b", "ok"),)),), (4.0, "ok"), (3.0, "ok"), 3.0 + REST_S, "good"),
        ("map", (Rule("good", (("a", "bad"),)),), (4.0, "ok"), (3.0, "ok"), 4.0, "poor"),
    ],
)
def test_how_a_concurrence_ends(finish, rules, a, b, ended_s, outcome):
    site = Site(beside(finish, rules), {"a": [a], "b": [b]} | REST_OF)
    site.run()
    [ended] = [r for r in site.of(TransitionTaken) if r.state == "Both"]
    assert (ended.t_s, ended.event) == (ended_s, outcome)
    assert site.started[2][0] == ended_s, "what follows starts when all is at rest"


def test_a_sibling_that_ends_in_the_same_instant_is_left_without_a_word():
    site = Site(beside("any", (Rule("good", (("a", "ok"),)),)), {"a": [(2.0, "ok")], "b": [(2.0, "ok")]} | REST_OF)
    site.run()
    assert site.taken()[:2] == [(2.0, "Both/a", "ok", "autonomous"), (2.0, "Both", "good", "autonomous")]
    assert site.interrupted == []


def test_a_suggestion_beside_is_withdrawn_when_it_is_left():
    site = Site(beside("any", b=2), {"a": [(3.0, "ok")], "b": [(1.0, "ok")]} | REST_OF, 1)
    site.run()
    assert site.told("withdrawn") == (3.0, "withdrawn", 1)
    assert site.taken()[0] == (3.0, "Both/a", "ok", "autonomous")


def test_both_ask_and_each_is_answered():
    site = Site(beside(a=2, b=2), {"a": [(1.0, "ok")], "b": [(2.0, "ok")]} | REST_OF, 1)
    site.at(4.0, lambda: site.executive.confirm(2))
    site.at(5.0, lambda: site.executive.confirm(1))
    site.run()
    assert site.taken()[:2] == [(4.0, "Both/b", "ok", "confirmed"), (5.0, "Both/a", "ok", "confirmed")]


def test_a_fall_in_one_brings_the_other_to_rest():
    site = Site(beside(), {"a": [(2.0, FELL)], "b": [(50.0, "ok")]} | REST_OF)
    result = site.run()
    assert (result.outcome, site.env.now) == ("failed", 2.0 + REST_S)
    assert site.taken() == []
    assert site.executive.mode == "not_recoverable"


def test_a_forced_outcome_of_a_container_brings_all_in_it_to_rest():
    site = Site(beside(), {"a": [(50.0, "ok")], "b": [(50.0, "ok")]} | REST_OF)
    site.at(4.0, lambda: site.executive.force("good", "Both"))
    site.run()
    assert site.taken()[0] == (4.0 + REST_S, "Both", "good", "forced")
    assert [t_s for t_s, _ in site.interrupted] == [4.0, 4.0]


def test_the_mode_is_the_worst_of_those_at_work_and_each_keeps_its_own():
    site = Site(beside(), {"a": [(50.0, "ok")], "b": [(10.0, "ok")]} | REST_OF)
    site.at(4.0, lambda: site.executive.force("bad", "Both/a"))
    site.run()
    assert [(r.t_s, r.mode) for r in site.of(ModeChanged)] == [
        (4.0 + REST_S, "manual"),
        (4.0 + REST_S, "normal"),
    ]
    assert [(r.state, r.mode) for r in site.of(TransitionTaken)][:2] == [("Both/a", "manual"), ("Both/b", "normal")]


def test_a_concurrence_in_a_concurrence_leaves_everything_when_the_outer_ends():
    park = (Edge("x", "ok", PARKED, 0), Edge("y", "ok", PARKED, 0))
    inner = Concurrence("In", work("x", "y"), park, ("ok",), "any", default="ok")
    edges = (Edge("a", "ok", PARKED, 0), Edge("In", "ok", PARKED, 2))
    outer = Concurrence("Out", (*work("a"), inner), edges, ("ok",), "any", default="ok")
    script = {"a": [(1.1, "ok")], "x": [(1.0, "ok")], "y": [(50.0, "ok")], "after": [(1.0, "ok")]}
    site = Site(top(outer, Edge("Out", "ok", "after", 0)), script)
    site.run()
    # At 1.0 s x begins to leave y; at 1.1 s a leaves them all, before y is at rest.
    assert site.taken()[:2] == [
        (1.0 + REST_S, "Out/a", "ok", "autonomous"),
        (1.0 + REST_S, "Out", "ok", "autonomous"),
    ]


def test_a_pause_while_siblings_come_to_rest_holds_what_is_decided():
    site = Site(beside("any"), {"a": [(2.0, "ok")], "b": [(50.0, "ok")]} | REST_OF)
    site.at(2.1, lambda: site.executive.pause())
    site.at(6.0, lambda: site.executive.resume())
    site.run()
    assert site.taken()[:2] == [(6.0, "Both/a", "ok", "autonomous"), (6.0, "Both", "poor", "autonomous")]


def test_a_level_that_falls_while_siblings_come_to_rest_changes_nothing():
    site = Site(beside("any"), {"a": [(2.0, "ok")], "b": [(50.0, "ok")]} | REST_OF)
    site.at(2.1, lambda: site.executive.set_level(0))
    site.run(until_s=3.0)
    first = site.of(TransitionTaken)[0]
    assert (first.t_s, first.how, first.level) == (2.0 + REST_S, "autonomous", 3)


# Locks


def test_a_locked_sibling_is_not_left():
    site = Site(beside("any"), {"a": [(2.0, "ok")], "b": [(50.0, "ok")]} | REST_OF)
    site.at(1.0, lambda: site.executive.lock("Both/b"))
    site.at(7.0, lambda: site.executive.unlock("Both/b"))
    site.run()
    assert site.taken()[0] == (7.0 + REST_S, "Both/a", "ok", "autonomous")
    assert site.interrupted[0][0] == 7.0


def test_a_lock_on_a_sibling_that_is_being_left_is_too_late():
    site = Site(beside("any"), {"a": [(2.0, "ok")], "b": [(50.0, "ok")]} | REST_OF)
    site.at(2.1, lambda: site.executive.lock("Both/b"))
    site.run()
    assert site.of(Released)[0].note == "too late: Both/a ok is decided"
    assert site.taken()[0][0] == 2.0 + REST_S


def test_in_a_locked_container_the_inside_goes_on_until_it_would_be_left():
    site = Site(nested(), NESTED)
    site.at(0.5, lambda: site.executive.lock("G"))
    site.at(6.0, lambda: site.executive.unlock("G"))
    site.run()
    assert [(t_s, path) for t_s, path, _, _ in site.taken()][:4] == [
        (1.0, "G/H/a"),
        (2.0, "G/H/b"),
        (2.0, "G/H"),
        (6.0, "G"),
    ]


def test_what_a_lock_held_is_guarded_at_the_level_of_its_end():
    site = Site(beside(), {"a": [(1.0, "ok")], "b": [(2.0, "ok")]} | REST_OF)
    site.at(0.5, lambda: site.executive.lock("Both/a"))
    site.at(3.0, lambda: site.executive.set_level(0))
    site.at(4.0, lambda: site.executive.unlock("Both/a"))
    site.run(until_s=5.0)
    assert [(p.path, p.event) for p in site.executive.pendings] == [("Both/a", "ok")]
    assert [(r.t_s, r.kind) for r in site.of(Requested)] == [(4.0, "confirm")]


def held_by_a_lock():
    """``a`` has come to an outcome that would park it, and is locked."""
    site = Site(beside(), {"a": [(1.0, "ok")], "b": [(50.0, "ok")]} | REST_OF)
    site.at(0.5, lambda: site.executive.lock("Both/a"))
    return site


def test_a_state_whose_outcome_is_held_may_be_taken_over_and_handed_back():
    site = held_by_a_lock()
    site.at(2.0, lambda: site.executive.take_over("Both/a"))
    site.at(4.0, lambda: site.executive.reject(1))
    site.at(6.0, lambda: site.executive.unlock("Both/a"))
    site.run(until_s=7.0)
    assert [(r.t_s, r.kind) for r in site.of(Requested)] == [(2.0, "act")]
    assert [t_s for t_s, path in site.started if path == "Both/a"] == [0.0, 4.0]
    assert site.taken() == [(6.0, "Both/a", "ok", "autonomous")]


def test_another_outcome_may_be_forced_while_one_is_held_that_would_leave_a_locked_sibling():
    site = Site(beside("map", (Rule("good", (("a", "ok"),)),)), {"a": [(1.0, "ok")], "b": [(8.0, "ok")]} | REST_OF)
    site.at(0.5, lambda: site.executive.lock("Both/b"))
    site.at(3.0, lambda: site.executive.force("bad", "Both/a"))
    site.at(4.0, lambda: site.executive.unlock("Both/b"))
    site.run()
    assert site.effects() == ["locked", "forced", "unlocked"]
    assert [(t_s, path, event) for t_s, path, event, _ in site.taken()][:3] == [
        (3.0, "Both/a", "bad"),
        (8.0, "Both/b", "ok"),
        (8.0, "Both", "poor"),
    ]


# Priority


def urgent(first):
    """``Both``: ``Calm`` works; in the other region ``Urgent``, which has priority, follows ``first``."""
    edges = (Edge("act", "ok", "ok", 0),)
    group = Group("Urgent", "act", work("act"), edges, ("ok",), priority=True)
    onward = (Edge(first, "ok", "Urgent", 0), Edge("Urgent", "ok", "ok", 0))
    region = Group("R", first, (*work(first), group), onward, ("ok",))
    calm = Group("Calm", "act", work("act"), edges, ("ok",))
    parked = (Edge("Calm", "ok", PARKED, 0), Edge("R", "ok", PARKED, 0))
    return top(
        Concurrence("Both", (calm, region), parked, ("ok",), "all", default="ok"), Edge("Both", "ok", "after", 0)
    )


def test_priority_brings_the_others_to_rest_first_and_they_resume_afterwards():
    script = {"Both/Calm/act": [(50.0, "ok"), (1.0, "ok")], "wait": [(2.0, "ok")], "Both/R/Urgent/act": [(3.0, "ok")]}
    site = Site(urgent("wait"), script | REST_OF)
    site.run()
    assert site.started == [
        (0.0, "Both/Calm/act"),
        (0.0, "Both/R/wait"),
        (2.0 + REST_S, "Both/R/Urgent/act"),
        (5.0 + REST_S, "Both/Calm/act"),
        (6.0 + REST_S, "after"),
    ]


def test_what_is_suspended_neither_passes_nor_is_answered():
    script = {"Both/Calm/act": [(1.0, "ok")], "wait": [(2.0, "ok")], "Both/R/Urgent/act": [(3.0, "ok")]}
    site = Site(urgent("wait"), script | REST_OF, 0)
    site.at(2.5, lambda: site.executive.confirm(2))
    site.at(3.0, lambda: site.executive.confirm(1))
    site.at(4.0, lambda: site.executive.set_level(1))
    site.run()
    assert site.effects() == ["answered", "ignored", "level"]
    assert site.of(Released)[1].note == "suspended by a container of priority"
    # What is urgent begins when the operator confirms, for 3 s; only then passes what was suggested beside it.
    assert [(t_s, path) for t_s, path, _, _ in site.taken()][:5] == [
        (2.5, "Both/R/wait"),
        (5.5, "Both/R/Urgent/act"),
        (5.5, "Both/R/Urgent"),
        (5.5, "Both/R"),
        (5.5, "Both/Calm/act"),
    ]


def test_of_two_containers_of_priority_that_are_entered_at_once_the_first_one_works():
    park = (Edge("One", "ok", PARKED, 0), Edge("Two", "ok", PARKED, 0))
    groups = tuple(
        Group(name, "act", work("act"), (Edge("act", "ok", "ok", 0),), ("ok",), priority=True)
        for name in ("One", "Two")
    )
    both = Concurrence("Both", groups, park, ("ok",), "all", default="ok")
    site = Site(top(both, Edge("Both", "ok", "after", 0)), {"act": [(1.0, "ok")]} | REST_OF)
    assert site.run().outcome == "completed"
    assert [t_s for t_s, _ in site.started] == [0.0, 1.0, 2.0]


def test_the_whole_may_be_forced_while_a_part_of_it_has_priority():
    script = {"Both/Calm/act": [(50.0, "ok")], "wait": [(2.0, "ok")], "Both/R/Urgent/act": [(50.0, "ok")]}
    site = Site(urgent("wait"), script | REST_OF)
    site.at(5.0, lambda: site.executive.force("ok", "Both"))
    site.run()
    assert site.taken()[1] == (5.0 + REST_S, "Both", "ok", "forced")
