"""What a declaration promises, and what is refused."""

from __future__ import annotations

import csv
import dataclasses
import pickle
from importlib.resources import files

import pytest

from teleop_sim.core.errors import BadInput, UnknownName
from teleop_sim.machines.declare import FELL, INHERIT, Autonomy, Counter, Edge, Machine, Row, State
from teleop_sim.machines.src_dish import THRESHOLDS, src_dish

GOOD = {
    "name": "two",
    "start": "a",
    "states": (State("a", "a"), State("b")),
    "edges": (Edge("a", "go", "b", 0),),
    "ends": frozenset({"b"}),
}


def test_the_dish_machine_has_the_published_size():
    machine = src_dish()
    assert (len(machine.states), len(machine.table)) == (18, 63)
    names = set(machine.state_names)
    assert all({e.state, e.next_state} <= names for e in machine.table)
    assert [s.name for s in machine.states if s.manual] == ["STATE_ERROR"]


def test_at_full_all_that_code_raises_passes_and_at_off_only_inherit():
    for edge in src_dish().table:
        assert edge.passes(Autonomy.FULL) == (edge.raised_by == "code")
        assert edge.passes(Autonomy.OFF) == (edge.threshold == INHERIT) == edge.event.endswith("_EXECUTING")


def test_each_level_lets_more_pass():
    passing = [sum(e.passes(level) for e in src_dish().table) for level in Autonomy]
    assert passing == sorted(passing)
    assert len(set(passing)) == len(Autonomy)


def test_thresholds_follow_the_rule():
    text = files("teleop_sim.machines").joinpath("src_dish_edges.csv").read_text(encoding="utf-8")
    for row in csv.DictReader(text.splitlines()):
        assert int(row["threshold"]) == THRESHOLDS[row["follows"]], row


def test_the_eight_tuple_says_the_same_as_the_table():
    machine = src_dish()
    found = machine.as_tuple()
    assert len(found) == 8
    assert found.states == machine.state_names
    assert found.start == "STATE_PRE_INIT"
    assert dict(found.transitions) == {(e.state, e.event): e.next_state for e in machine.table}
    assert {e.event for e in machine.table} | {"!timed_out", "!pitch_disturbed", FELL} == set(found.symbols)
    assert len(found.triggers) == len(found.updates) == 16
    assert len(found.actions) == 16
    # b and c for each state, one count for each row and one more for each of the three two-stage rows, h.
    assert len(found.variables) == 2 * 18 + 16 + 3 + 1


def test_an_edge_is_found_by_its_place():
    machine = src_dish()
    for place, edge in enumerate(machine.table):
        assert machine.edge_index(edge.state, edge.event) == place < 256
        assert machine.edge(edge.state, edge.event) is edge
    with pytest.raises(UnknownName, match="Did you mean '/REGULAR'"):
        machine.edge_index("STATE_INIT", "/REGULA")
    with pytest.raises(UnknownName):
        machine.state("STATE_NOWHERE")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"edges": (Edge("a", "go", "b", 0), Edge("a", "go", "a", 0))}, "2 edges on one event"),
        ({"edges": (Edge("a", "go", "c", 0),)}, "unknown name 'c'"),
        ({"edges": (Edge("a", "go", "b", 4),)}, "threshold 4"),
        ({"edges": (Edge("a", "go", "b", -2),)}, "threshold -2"),
        ({"edges": (Edge("a", "go", "b", -1),)}, "Inherit (-1) is for containers"),
        ({"edges": (Edge("a", "go", "b", -1, "executing"),)}, "Only a self-loop"),
        ({"edges": (Edge("a", "go", "a", 0),)}, "no way out"),
        ({"states": (State("a", "a"), State("b"), State("c", "c"))}, "unreachable"),
        ({"states": (State("a", "a"), State("a", "a"), State("b"))}, "declared twice"),
        ({"states": (State("a"), State("b"))}, "nothing runs in it"),
        ({"states": (State("a", "a", (Row("go", (Counter(-1, "go"),), "off"),)), State("b"))}, "limit -1"),
        ({"states": (State("a", "a", (Row("go", (), "go"), Row("go", (), "go"))), State("b"))}, "two rows"),
        ({"ends": frozenset()}, "Name a state in which the machine stops"),
        ({"start": "z"}, "unknown name 'z'"),
        ({"edges": tuple(Edge("a", str(i), "b", 0) for i in range(65536))}, "two bytes"),
    ],
)
def test_a_bad_machine_is_refused(change, says):
    with pytest.raises(BadInput) as caught:
        Machine(**(GOOD | change))
    assert says in str(caught.value)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_all_problems_come_at_once():
    with pytest.raises(BadInput) as caught:
        Machine("bad", "a", (State("a", "a"),), (Edge("a", "x", "y", 9), Edge("a", "x", "a", 0)), frozenset({"q"}))
    text = str(caught.value)
    assert all(part in text for part in ("'y'", "threshold 9", "2 edges", "'q'", "no way out"))


def test_a_machine_cannot_be_changed():
    with pytest.raises(dataclasses.FrozenInstanceError):
        src_dish().name = "other"


@pytest.mark.parametrize(("threshold", "refused"), [(0, True), (2, True), (3, False)])
def test_suggestions_that_chase_each_other_are_refused_unless_a_person_is_asked(threshold, refused):
    """They would pass for ever without any time going by, at full at the latest."""
    states = (State("a", decides=True, suggests="on"), State("b", decides=True, suggests="back"))
    edges = (Edge("a", "on", "b", 0), Edge("b", "back", "a", threshold), Edge("b", "out", "ok", 3))
    if not refused:
        assert Machine("round", "a", states, edges, outcomes=("ok",)).outcomes == ("ok",)
        return
    with pytest.raises(BadInput) as caught:
        Machine("round", "a", states, edges, outcomes=("ok",))
    assert [p.where for p in caught.value.problems] == ["machine round: a", "machine round: b"]
