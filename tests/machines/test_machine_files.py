"""Machines in TOML: every mistake is found at once, with its line; nothing is run."""

from __future__ import annotations

from pathlib import Path

import pytest

from teleop_sim.core.errors import BadInput
from teleop_sim.machines import files
from teleop_sim.machines.elements import Edge, Given, State
from teleop_sim.machines.files import load_machine, machine_to_toml, parse_machine
from teleop_sim.machines.library import MACHINES

FETCH = """\
name = "fetch"
start = "look"
outcomes = ["fetched", "not_found"]
goals = ["fetched"]
edges = [
    { state = "look", event = "seen", to = "grasp", threshold = "low" },
    { state = "look", event = "unseen", to = "not_found", threshold = "high", kind = "failed" },
    { state = "grasp", event = "held", to = "fetched", threshold = "off" },
]

[[states]]
name = "look"
program = "detect"
parameters = { colour = "red", tries = 3, side = { given = "hand" }, hint = { none = true } }

[[states]]
name = "grasp"
outcomes = ["held"]
start = "reach"
edges = [
    { state = "reach", event = "there", to = "close", threshold = "off" },
    { state = "close", event = "held", to = "held", threshold = "full" },
]

# A comment between.

[[states.states]]
name = "reach"
program = "reach"

[[states.states]]
name = 'close'
program = "grip"

[[parameters]]
name = "hand"
default = "left"
"""


def mistakes(text: str) -> list[str]:
    with pytest.raises(BadInput) as refused:
        parse_machine(text, "f.toml")
    return [problem.where + " | " + problem.what for problem in refused.value.problems]


def without(old: str, new: str = "") -> list[str]:
    assert old in FETCH
    return mistakes(FETCH.replace(old, new, 1))


def test_a_file_is_a_machine():
    machine = parse_machine(FETCH, "f.toml")
    assert machine.state_names == ("look", "grasp", "grasp/reach", "grasp/close")
    assert machine.edge("look", "unseen") == Edge("look", "unseen", "not_found", 2, "failed")
    assert machine.state("look") == State(
        "look", "detect", parameters=(("colour", "red"), ("tries", 3), ("side", Given("hand")), ("hint", None))
    )


def test_the_example_of_the_docs_is_a_machine():
    assert files.__doc__ is not None
    text = files.__doc__.split("::\n")[1].split("\nStates of a container")[0]
    assert parse_machine(text.replace("\n    ", "\n"), "example").state_names == ("look", "grasp")


@pytest.mark.parametrize("name", sorted(MACHINES))
def test_published_machines_come_back_from_their_files(name: str, tmp_path: Path):
    machine = MACHINES[name]()
    (tmp_path / "m.toml").write_text(machine_to_toml(machine), encoding="utf-8")
    assert load_machine(tmp_path / "m.toml") == machine


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('threshold = "low"', 'threshold = "lo"', "f.toml:6: edges[0].threshold | unknown name 'lo'"),
        ('threshold = "full"', "threshold = 3", "f.toml:22: states[1].edges[1].threshold | 3 does not fit"),
        (
            'program = "grip"',
            'programme = "grip"',
            "f.toml:31: states[1].states[1].programme | unknown name 'programme'",
        ),
        ('name = "look"\n', "", "f.toml:11: states[0].name | is missing"),
        ('outcomes = ["held"]', 'outcomes = "held"', "f.toml:16: states[1].outcomes | 'held' does not fit"),
        ("tries = 3", "tries = [3]", "f.toml:11: states[0].parameters.tries | [3] does not fit"),
        ('default = "left"', "", "f.toml: parameters[0].default | is missing"),
        ('default = "left"', "default = {given = 'hand'}", "f.toml: parameters[0] | stands for a parameter"),
        ('to = "grasp"', 'to = "grsp"', "f.toml:6: machine fetch: look: seen | unknown name 'grsp'"),
        ('program = "grip"', "", "f.toml:31: machine fetch: grasp/close | nothing runs in it"),
        ('program = "grip"', "decides = 1", "f.toml:31: states[1].states[1].decides | 1 does not fit"),
        ("goals = [", "goals = ", "f.toml:4:18 | is not TOML: expected newline or end of document after a statement"),
        ("# A comment between.", "states = 1", "f.toml:27:16 | is not TOML: cannot overwrite a value"),
        ('name = "fetch"', "name = 2024-01-01", "f.toml: name | datetime.date(2024, 1, 1) does not fit"),
    ],
)
def test_a_mistake_is_found_in_its_line(old: str, new: str, expected: str):
    assert any(mistake.startswith(expected) for mistake in without(old, new)), without(old, new)


def test_all_mistakes_are_found_at_once():
    spoilt = FETCH.replace('"low"', '"lo"').replace("tries = 3", "tries = []").replace('"reach"\n\n', "3\n\n")
    assert [mistake.split(" | ")[0].split(": ")[0] for mistake in mistakes(spoilt)] == [
        "f.toml:6",
        "f.toml:11",
        "f.toml:27",
    ]


@pytest.mark.parametrize("text", ["", "name = 3", "states = [[1]]", "states = [{ states = 1 }]", "edges = {}"])
def test_what_is_no_machine_is_refused(text: str):
    assert mistakes(text)


def test_states_may_be_inline_tables():
    text = "name = 'a'\nstart = 'b'\nends = ['c']\nedges = [{state = 'b', event = 'e', to = 'c', threshold = 'off'}]\n"
    assert parse_machine(text + "states = [{name = 'b', program = 'p'}, {name = 'c'}]\n", "f").start == "b"
    assert mistakes(text + "states = [{name = 'b'}, {name = 'c'}]\n") == ["f.toml: machine a: b | nothing runs in it"]


@pytest.mark.parametrize("text", ["x = " + "[" * 50_000, "x = " + "9" * 5_000])
def test_monstrous_files_are_refused(text: str):
    assert mistakes(text)


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path):
    with pytest.raises(BadInput, match="cannot be read"):
        load_machine(tmp_path / "none.toml")
    (tmp_path / "latin.toml").write_bytes(b"name = 'a'\nstart = '\xe9'\n")
    with pytest.raises(BadInput, match=r"latin\.toml:2: is not UTF-8"):
        load_machine(tmp_path / "latin.toml")
