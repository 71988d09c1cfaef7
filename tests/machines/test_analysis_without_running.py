"""What is said of a machine without running it."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.machines.analysis import analyse
from teleop_sim.machines.analysis_loops import longest, loops
from teleop_sim.machines.declare import Concurrence, Counter, Edge, Group, Machine, Row, Rule, State
from teleop_sim.machines.engine import Engine
from teleop_sim.machines.src_dish import src_dish


def machine(states, edges, start="a", outcomes=("ok", "off"), **rest) -> Machine:
    return Machine("m", start, tuple(states), tuple(edges), outcomes=outcomes, **rest)


def test_the_dish_machine():
    report = analyse(src_dish())
    assert report.states == 18
    assert report.by_hand == ("STATE_SKIP_TO_CP3",)
    assert report.stuck == ("STATE_ERROR",)
    assert report.unraised == (("STATE_END", "/END_SUCESSFUL"),)
    assert (report.unreachable, report.dead_ends, report.silent, report.unwritten) == ((), (), (), ())
    assert len(report.attempts) == 16
    assert ("STATE_DETECT_HANDLE_CENTER", "/DETECT_HANDLE_RETRY", 44) in report.attempts
    # A lost grip is not counted, so grasping and turning may go on for ever; all else is counted.
    assert report.longest is None
    assert {e.state for loop in report.loops for e in loop} <= {"STATE_GRASP_PITCH_HANDLE", "STATE_REDETECT_HANDLE"}
    assert "STATE_ERROR" in str(report)
    assert ("outcomes in a row at most", "src_dish", "unlimited") in report.rows()


def test_an_outcome_that_a_container_never_comes_to():
    """The container declares ``off``, nothing in it leads there: what lies behind is never reached."""
    inside = Group("a", "x", (State("x", "x"), State("y", "y")), (
        Edge("x", "go", "ok", 0), Edge("x", "never", "y", 0, raised_by="nobody"), Edge("y", "go", "off", 0),
    ), ("ok", "off"))  # fmt: skip
    report = analyse(machine((inside, State("b", "b")), (
        Edge("a", "ok", "ok", -1), Edge("a", "off", "b", -1), Edge("b", "go", "off", 0),
    )))  # fmt: skip
    assert report.unreachable == ("a/y", "b")
    assert report.silent == (("", "off"), ("a", "off"))
    assert report.unraised == (("a/x", "never"),)
    assert report.longest == 2


@pytest.mark.parametrize(
    ("finish", "silent"),
    [("all", (("a", "no"), ("a", "odd"))), ("any", (("a", "odd"),)), ("map", (("a", "no"), ("a", "odd")))],
)
def test_outcomes_of_concurrent_states(finish, silent):
    """Both must come to ``ok`` for ``ok``; if the first to come counts, the default can come too, never ``odd``."""
    edges = (Edge("x", "ok", "", 0), Edge("y", "ok", "", 0))
    needs = (("x", "ok"), ("y", "ok")) if finish != "any" else (("x", "ok"),)
    pair = Concurrence(
        "a", (State("x", "x"), State("y", "y")), edges, ("ok", "no", "odd"), finish, (Rule("ok", needs),), "no"
    )
    ways = tuple(Edge("a", outcome, "ok" if outcome == "ok" else "off", -1) for outcome in ("ok", "no", "odd"))
    report = analyse(machine((pair,), ways))
    assert tuple(pair for pair in report.silent if pair[0]) == silent
    assert report.longest is None


def test_dead_ends_and_what_only_people_end():
    states = (State("a", "a"), State("b", "b"), State("c", manual=True))
    edges = (
        Edge("a", "go", "ok", 0), Edge("a", "lost", "b", 0), Edge("a", "help", "c", 0),
        Edge("b", "again", "b", 0, "retry"), Edge("b", "out", "ok", 0, raised_by="nobody"),
        Edge("c", "stop", "off", 3, "command", "operator"),
    )  # fmt: skip
    report = analyse(machine(states, edges))
    assert report.dead_ends == ("b",)
    assert report.stuck == ("c",)
    assert [e.event for loop in report.loops for e in loop] == ["again"]


def keyed(*, other_writes: bool) -> Machine:
    """A reader that is reached by two ways; the shorter one passes a writer only if ``other_writes``."""
    key = (("k", "goal"),)
    states = (
        State("a", "a", writes=key if other_writes else ()),
        State("b", "b", writes=key),
        State("c", "c", reads=key),
    )
    edges = (Edge("a", "far", "b", 0), Edge("a", "near", "c", 0), Edge("b", "go", "c", 0), Edge("c", "go", "ok", 0))
    return machine(states, edges, outcomes=("ok",))


def test_keys_that_are_unwritten_on_some_way():
    assert analyse(keyed(other_writes=True)).unwritten == ()
    (found,) = analyse(keyed(other_writes=False)).unwritten
    assert (found.path, found.own, found.key) == ("c", "k", "goal")


@pytest.mark.parametrize(
    ("writes", "off_to", "found"),
    [((("goal", "goal"),), "ok", 1), ((("goal", "goal"),), "off", 0), ((), "off", 0)],
)
def test_keys_that_a_container_writes_on_one_of_its_outcomes_only(writes, off_to, found):
    inside = Group(
        "a",
        "x",
        (State("x", "x"), State("y", "y", writes=(("k", "goal"),))),
        (Edge("x", "go", "y", 0), Edge("x", "no", "off", 0), Edge("y", "go", "ok", 0)),
        ("ok", "off"),
        writes=writes,
    )
    reader = State("b", "b", reads=(("k", "goal"),))
    edges = (Edge("a", "ok", "b", -1), Edge("a", "off", "b" if off_to == "ok" else "off", -1), Edge("b", "go", "ok", 0))
    # What is nothing at the start is meant so, unless somebody writes it: then it stands in for what he writes.
    assert len(analyse(machine((inside, reader), edges, data=(("goal", None),))).unwritten) == found


def row(*counters: Counter) -> tuple[Row, ...]:
    return (Row("bad", counters, "off"),)


def retrying(rows: tuple[Row, ...], back_to: str = "a") -> Machine:
    states = (State("a", "a", rows), State("b", "b"))
    edges = (Edge("a", "bad", back_to, 0, "retry"), Edge("a", "off", "off", 0, "failed"), Edge("a", "good", "b", 0),
             Edge("b", "done", "ok", 0), Edge("b", "back", "a", 0, "retry"))  # fmt: skip
    return machine(states, edges)


def test_a_success_on_the_loop_makes_it_endless_unless_failures_are_kept():
    """The way back from b is not counted: a loop by itself, whatever a's counter does."""
    (loop,) = loops(retrying(row(Counter(3, "bad"))))
    assert [(e.state, e.event) for e in loop] in ([("a", "good"), ("b", "back")], [("a", "bad")])


def counted_back(kept: bool) -> Machine:
    states = (State("a", "a"), State("b", "b", row(Counter(3, "bad", kept=kept))), State("c", "c"))
    edges = (
        Edge("a", "go", "b", 0), Edge("b", "bad", "a", 0, "retry"), Edge("b", "off", "off", 0, "failed"),
        Edge("b", "good", "c", 0), Edge("c", "go", "ok", 0),
    )  # fmt: skip
    return machine(states, edges)


def test_a_counted_loop_ends():
    """Three times a, b and back, then a, b, and either on over c or off: 3·2 + 2 + 1."""
    assert loops(counted_back(kept=False)) == ()
    assert longest(counted_back(kept=False)) == 9


@given(
    st.lists(st.builds(Counter, st.integers(0, 3), st.just("bad"), st.booleans(), st.booleans()), max_size=3),
    st.randoms(),
)
@settings(max_examples=40, deadline=None)
def test_no_run_is_longer_than_the_longest_way(counters, random):
    rows = row(*counters)
    ring = Machine(
        "ring",
        "a",
        (State("a", "a", rows), State("b", "b", rows), State("end")),
        tuple(
            e
            for here, onward in (("a", "b"), ("b", "end"))
            for e in (
                Edge(here, "good", onward, 0),
                Edge(here, "bad", "a", 0, "retry"),
                Edge(here, "off", "end", 0, "failed"),
            )
        ),
        frozenset({"end"}),
    )
    most = longest(ring)
    # What a's success puts back, b's failures bring into play again.
    assert (most is None) == bool(loops(ring))
    if most is None:
        return
    for _ in range(20):
        engine, taken = Engine(ring, 3), 0
        while not engine.over():
            path = ring.net.nodes[engine.configuration.active[0]].path
            taken += len(engine.signal(path, random.choice(("good", "bad", "bad", "bad"))))
        assert taken <= most
