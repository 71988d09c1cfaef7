"""Drawings: what is where, in which colour, and that nothing of a machine is left out."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from teleop_sim.core.errors import BadInput
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.draw import HUB_FROM, Look, machine_dot
from teleop_sim.machines.draw_file import write_drawing
from teleop_sim.machines.draw_text import COLOURS, quoted
from teleop_sim.machines.elements import Concurrence, Edge, Group, Rule, State
from teleop_sim.machines.library import MACHINES
from teleop_sim.machines.net import Configuration

BOTH = Concurrence(
    "both",
    (State("look", "look"), State("hold", "hold")),
    (Edge("look", "seen", "", 0), Edge("hold", "held", "", 1), Edge("hold", "slipped", "", 2, "failed")),
    ("ok", "lost"),
    "all",
    (Rule("ok", (("look", "seen"), ("hold", "held"))),),
    "lost",
)
ARM = Group(
    "arm", "ask", (State("ask", decides=True),), (Edge("ask", "yes", "out", 3, "command", "operator"),), ("out",)
)
DOOR = Machine(
    "door & <frame>",
    "both",
    (BOTH, ARM, State('wait "here"', manual=True), State("stop")),
    (
        Edge("both", "ok", "arm", -1),
        Edge("both", "lost", 'wait "here"', 0),
        Edge("arm", "out", "stop", 2),
        Edge('wait "here"', "go", "both", 3, "command", "operator"),
        Edge("stop", "again", "stop", 3),
    ),
    ends=frozenset({"stop"}),
)


def line_of(dot: str, begin: str) -> str:
    found = [line.strip() for line in dot.splitlines() if line.strip().startswith(begin)]
    assert len(found) == 1, (begin, found)
    return found[0]


def number(path: str, machine: Machine = DOOR) -> int:
    return machine.net.by_path[path]


def test_containers_are_frames_around_their_states():
    text = machine_dot(DOOR)
    frame = text.index(f"subgraph cluster_{number('both')} ")
    inside = text[frame : text.index("\n  }", frame)]
    assert f"n{number('both/look')} [" in inside
    assert f"n{number('both/hold')} [" in inside
    assert f"n{number('arm/ask')} [" not in inside
    assert "dashed" in inside
    assert "all at once; ends when all have ended" in inside
    assert inside.count('shape="oval"') == len(BOTH.outcomes)


def test_an_outcome_of_a_child_at_once_leads_where_its_rules_say():
    text, both = machine_dot(DOOR), number("both")
    look, hold = number("both/look"), number("both/hold")
    assert "seen" in line_of(text, f"n{look} -> o{both}_0")
    assert "held" in line_of(text, f"n{hold} -> o{both}_0")
    assert "slipped (otherwise)" in line_of(text, f"n{hold} -> o{both}_1")


def test_a_line_into_a_container_ends_at_its_frame():
    assert f'lhead="cluster_{number("arm")}"' in line_of(machine_dot(DOOR), f"o{number('both')}_0 -> ")


@pytest.mark.parametrize("name", sorted(MACHINES))
@pytest.mark.parametrize("stubs", [True, False])
def test_each_outcome_of_a_published_machine_is_drawn_once_in_its_colour(name: str, stubs: bool):
    machine = MACHINES[name]()
    text = machine_dot(machine, Look(stubs=stubs))
    body = text[text.index("node [fontname") :]
    for threshold, colour in COLOURS.items():
        lines = len(re.findall(rf'-> .*fontcolor="{colour}"', body))
        words = body.count(f'<font point-size="9" color="{colour}">')
        assert lines + words == sum(edge.threshold == threshold for edge in machine.table)


def test_commands_can_be_left_out_but_no_decision():
    assert "-> wait" not in machine_dot(DOOR)
    assert "both: go (operator)" in machine_dot(DOOR)
    without = machine_dot(DOOR, Look(commands=False))
    assert "both: go" not in without
    assert 'label=" yes "' in without


def test_a_hub_is_named_beside_each_state_that_leads_to_it():
    machine = MACHINES["src-dish"]()
    hub = machine.net.by_path["STATE_ERROR"]
    into = {machine.net.source[i] for i, target in enumerate(machine.net.target) if target == hub}
    text = machine_dot(machine)
    assert len(into) >= HUB_FROM
    assert text.count('label="STATE_ERROR", shape="cds"') == len(into)
    assert f"-> n{hub} " not in text
    assert f"-> n{hub} " in machine_dot(machine, Look(stubs=False))


def test_what_is_active_is_highlighted_with_what_is_around_it():
    parked = DOOR.edge_index("both/hold", "held")
    text = machine_dot(DOOR, Look(Configuration((number("both/look"),), (parked,))))
    assert 'fillcolor="#f0e442"' in line_of(text, f"n{number('both/look')} [")
    assert "(has ended)" in line_of(text, f"n{number('both/hold')} [")
    assert text.count("#f0e442") == 1
    assert 'fillcolor="#fbf8d2"' in text[text.index(f"subgraph cluster_{number('both')}") :].splitlines()[1]


def test_a_level_dashes_what_waits_for_a_person():
    def waiting(level: int) -> int:
        text = machine_dot(DOOR, Look(level=level, stubs=False))
        return len(re.findall(r'-> .*style="dashed"', text)) + text.count("<i>")

    # Dotted lines, an operator's, wait at every level.
    assert [waiting(level) for level in range(4)] == [
        sum(not e.passes(level) and e.raised_by != "operator" for e in DOOR.table) for level in range(4)
    ]


def test_the_legend_names_every_threshold_and_the_machine():
    text = machine_dot(DOOR)
    assert all(f"<b>{name}</b>" in text for name in ("off", "low", "high", "full", "inherit"))
    assert "door &amp; &lt;frame&gt;" in text


def test_quotes_and_line_ends_in_names_are_kept_out_of_dot():
    assert quoted('a "b"\\\n') == '"a \\"b\\"\\\\\\n"'
    assert quoted("a &lt; b\0\x01\uffff") == '"a &amp;lt; b???"'
    assert "wait &quot;here&quot;" in machine_dot(DOOR)


@pytest.mark.usefixtures("dot")
@pytest.mark.parametrize("suffix", [".svg", ".png", ".pdf"])
def test_pictures_are_made_of_it(tmp_path: Path, suffix: str):
    begins = {".svg": b"<?xml", ".png": b"\x89PNG", ".pdf": b"%PDF"}[suffix]
    out = tmp_path / f"door{suffix}"
    write_drawing(machine_dot(DOOR), out)
    assert out.read_bytes().startswith(begins)


@pytest.mark.usefixtures("dot")
def test_the_same_machine_gives_the_same_picture(tmp_path: Path):
    for name in ("a.svg", "b.svg"):
        write_drawing(machine_dot(DOOR), tmp_path / name)
    svg = (tmp_path / "a.svg").read_text()
    assert svg == (tmp_path / "b.svg").read_text()
    assert "wait &quot;here&quot;" in svg


@pytest.mark.usefixtures("dot")
def test_what_dot_cannot_read_is_said(tmp_path: Path):
    with pytest.raises(BadInput, match="made no picture"):
        write_drawing("digraph {", tmp_path / "x.svg")


def test_without_graphviz_there_is_dot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BadInput, match="apt install graphviz"):
        write_drawing("digraph {}", tmp_path / "x.svg")
    write_drawing("digraph {}", tmp_path / "x.dot")
    assert (tmp_path / "x.dot").read_text() == "digraph {}"


def test_other_suffixes_are_refused(tmp_path: Path):
    with pytest.raises(BadInput, match=r"\.jpg is no kind of drawing"):
        write_drawing("digraph {}", tmp_path / "x.jpg")
