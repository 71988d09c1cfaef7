"""The drawing of a run's machine: what was done is in it, with its counts, and nothing else is loud."""

import re
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.core.errors import BadInput
from teleop_sim.machines import draw_file
from teleop_sim.machines.draw_file import can_draw, drawn
from teleop_sim.machines.draw_visits import HOW_COLOURS, MODE_FILLS, Seen, Stay, visits_dot
from teleop_sim.machines.library import MACHINES, machine
from teleop_sim.machines.net import Net

DISH = machine("src-dish")
SEEN = Seen(
    {
        "STATE_PRE_INIT": Stay(2.0, 1, "normal"),
        "STATE_INIT": Stay(3.25, 2, "auto"),
        "STATE_DETECT_PANEL_COARSE": Stay(4.0, 1, "manual"),
    },
    {
        ("STATE_PRE_INIT", "/GOTO_STATE_INIT"): {"autonomous": 1},
        ("STATE_INIT", "/REGULAR"): {"autonomous": 1, "confirmed": 2},
    },
    "STATE_DETECT_PANEL_COARSE",
)


def test_visited_states_have_time_and_mode_and_taken_outcomes_their_count():
    dot = visits_dot(DISH, SEEN)
    init = next(line for line in dot.splitlines() if "<b>INIT</b>" in line)
    assert "2 × , 3.2 s".replace(" ,", ",") in init
    assert MODE_FILLS["auto"] in init
    regular = next(line for line in dot.splitlines() if "/REGULAR ×3" in line)
    # The most of a person's doing gives the colour.
    assert HOW_COLOURS["confirmed"] in regular
    assert "FIX_HANDLE_DETECTION" in dot.split("not visited")[1]
    assert dot == visits_dot(DISH, SEEN)


machine_of = cache(machine)


@st.composite
def walks(draw):
    """Some states of a machine and some outcomes of theirs; nothing says that they make a run."""
    name = draw(st.sampled_from(sorted(MACHINES)))
    net: Net = machine_of(name).net
    paths = [node.path for node in net.nodes[1:]]
    stays = draw(st.dictionaries(st.sampled_from(paths), st.just(Stay(1.0, 1, "normal")), max_size=5))
    edges = st.sampled_from([(edge.state, edge.event) for edge in net.edges])
    taken = draw(st.dictionaries(edges, st.just({"forced": 1}), max_size=5))
    return name, Seen(stays, taken)


@given(walks())
def test_every_end_of_every_line_is_drawn(walk):
    """Graphviz would make a bare node of a name that nothing declares."""
    name, seen = walk
    dot = visits_dot(machine_of(name), seen)
    made = set(re.findall(r"^\s*([nou]\d+(?:_\d+)?) \[", dot, re.MULTILINE))
    for tail, head in re.findall(r"([no]\d+(?:_\d+)?) -> ([no]\d+(?:_\d+)?)", dot):
        assert {tail, head} <= made
    clusters = set(re.findall(r"subgraph (cluster_\d+)", dot))
    assert set(re.findall(r'lhead="(cluster_\d+)"', dot)) <= clusters


def test_graphviz_lays_it_out():
    assert can_draw(), "this test needs Graphviz's program dot: apt install graphviz"
    assert drawn(visits_dot(DISH, SEEN), "svg").startswith(b"<?xml")
    with pytest.raises(BadInput, match="made no picture"):
        drawn("digraph {", "svg")


def test_without_graphviz_it_says_what_is_missing(monkeypatch):
    monkeypatch.setattr(draw_file.shutil, "which", lambda _: None)
    assert not can_draw()
    with pytest.raises(BadInput, match="apt install graphviz"):
        drawn("digraph {}", "svg")
