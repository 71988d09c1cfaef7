"""Random machines: as TOML, as patches, as drawings. What is said of one must hold of all."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.machines.declare import Machine
from teleop_sim.machines.draw import Look, machine_dot
from teleop_sim.machines.elements import (
    INHERIT,
    Concurrence,
    Counter,
    Edge,
    Element,
    Given,
    Group,
    Parameter,
    Row,
    Rule,
    State,
)
from teleop_sim.machines.files import machine_to_toml, parse_machine
from teleop_sim.machines.modify import (
    AddOutcome,
    AddState,
    Operation,
    Patch,
    RemoveOutcome,
    RemoveState,
    SetData,
    SetDefault,
    SetParameter,
    SetTarget,
    SetThreshold,
    apply,
    pack_patch,
    unpack_patch,
)
from teleop_sim.machines.plain import machine_plain, read_machine
from teleop_sim.machines.plain_table import Table

WORDS = st.text(max_size=6)
NAMES = st.text(min_size=1, max_size=6).filter(lambda s: "/" not in s and s.strip() == s)
PLAIN_VALUES = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | WORDS
VALUES = PLAIN_VALUES | st.just(Given("p"))
HELD = st.dictionaries(NAMES, VALUES, max_size=2).map(lambda held: tuple(held.items()))
KEYS = st.sampled_from(((), (("k", "k"),), (("own", "k"), ("other", "k")), (("twice", "k"), ("twice", "k"))))
LEAF_THRESHOLDS = st.integers(0, 3)


@st.composite
def leaves(draw: st.DrawFn, name: str) -> tuple[State, tuple[Edge, ...]]:
    """A state and its edges, which lead to itself: whoever takes it leads some elsewhere."""
    events = draw(st.lists(NAMES, min_size=1, max_size=3, unique=True))
    edges = tuple(
        Edge(
            name,
            event,
            name,
            draw(LEAF_THRESHOLDS),
            draw(st.sampled_from(("done", "retry", "failed", "command"))),
            draw(st.sampled_from(("code", "operator", "nobody"))),
            draw(WORDS),
        )
        for event in events
    )
    counter = st.builds(Counter, st.integers(0, 50), st.sampled_from(events), st.booleans(), st.booleans())
    row = st.builds(Row, st.just("!lost"), st.lists(counter, max_size=2).map(tuple), st.sampled_from(events))
    kind = draw(st.sampled_from(("program", "manual", "decides")))
    state = State(
        name,
        program=draw(NAMES) if kind == "program" else "",
        rows=tuple(draw(st.lists(row, max_size=1))),
        manual=kind == "manual",
        action=draw(WORDS),
        decides=kind == "decides",
        suggests=draw(st.sampled_from(("", *events))),
        reads=draw(KEYS),
        writes=draw(KEYS),
        parameters=draw(HELD),
        outcomes=draw(st.sampled_from(((), tuple(events)))),
    )
    return state, edges


@st.composite
def groups(draw: st.DrawFn, name: str, depth: int) -> Group:
    """Children in a chain from the start to the first outcome, with random edges besides."""
    count = draw(st.integers(1, 3))
    names = [f"s{i}" for i in range(count)]
    outcomes = tuple(f"o{i}" for i in range(draw(st.integers(1, 2))))
    states: list[Element] = []
    edges: list[Edge] = []
    for i, child in enumerate(names):
        element, own = draw(elements(child, depth))
        onward = names[i + 1] if i + 1 < count else outcomes[0]
        goals = st.sampled_from((*names, *outcomes))
        states.append(element)
        edges += (replace(e, next_state=onward if n == 0 else draw(goals)) for n, e in enumerate(own))
        if isinstance(element, State) and draw(st.booleans()) and not element.outcomes:
            edges.append(Edge(child, "at work", child, INHERIT, "executing"))
    edges = _unhurried(states, edges)
    data = (("k", draw(VALUES)), *draw(HELD.map(lambda held: tuple(pair for pair in held if pair[0] != "k"))))
    return Group(
        name,
        "s0",
        tuple(states),
        tuple(draw(st.permutations(edges))),
        outcomes,
        writes=draw(KEYS.map(lambda keys: tuple(("k", around) for _, around in keys))),
        data=data,
        priority=draw(st.booleans()),
    )


def _unhurried(states: list[Element], edges: list[Edge]) -> list[Edge]:
    """What a decision suggests waits for a person where another decision follows: the checks refuse circles of them."""
    suggests = {s.name: s.suggests for s in states if isinstance(s, State) and s.decides}
    return [
        replace(e, threshold=3) if suggests.get(e.state) == e.event and e.next_state in suggests else e for e in edges
    ]


@st.composite
def concurrences(draw: st.DrawFn, name: str, depth: int) -> Concurrence:
    """One to three children at once, and rules about some of their outcomes."""
    made = [draw(elements(f"c{i}", depth)) for i in range(draw(st.integers(1, 3)))]
    edges = tuple(replace(e, next_state="") for _, own in made for e in own)
    outcomes = ("all_well", "not")
    pairs = st.sampled_from(tuple((e.state, e.event) for e in edges))
    rule = st.builds(Rule, st.sampled_from(outcomes), st.lists(pairs, min_size=1, max_size=2, unique=True).map(tuple))
    return Concurrence(
        name,
        tuple(element for element, _ in made),
        edges,
        outcomes,
        draw(st.sampled_from(("all", "any", "map"))),
        tuple(draw(st.lists(rule, max_size=2))),
        draw(st.sampled_from(outcomes)),
        data=(("k", draw(VALUES)),),
    )


@st.composite
def elements(draw: st.DrawFn, name: str, depth: int) -> tuple[Element, tuple[Edge, ...]]:
    kind = draw(st.sampled_from(("leaf", "leaf", "group", "concurrence"))) if depth else "leaf"
    if kind == "leaf":
        return draw(leaves(name))
    element = draw(groups(name, depth - 1) if kind == "group" else concurrences(name, depth - 1))
    edges = tuple(Edge(name, outcome, name, draw(st.integers(-1, 3))) for outcome in element.outcomes)
    return element, edges


@st.composite
def machines(draw: st.DrawFn) -> Machine:
    top = draw(groups("", 1))
    states, edges, ends = top.states, top.edges, frozenset[str]()
    first = states[0]
    if isinstance(first, State) and draw(st.booleans()):
        states, ends = (*states, State("rest")), frozenset({"rest"})
        edges = (*edges, Edge("s0", "to rest", "rest", 2))
        if first.outcomes:
            states = (replace(first, outcomes=(*first.outcomes, "to rest")), *states[1:])
    choices = draw(st.lists(PLAIN_VALUES, max_size=2).map(tuple))
    return Machine(
        draw(NAMES),
        "s0",
        states,
        edges,
        ends,
        top.outcomes,
        frozenset(draw(st.sets(st.sampled_from(top.outcomes)))),
        (Parameter("p", choices[0] if choices else draw(PLAIN_VALUES), choices),),
        top.data,
    )


@st.composite
def operations(draw: st.DrawFn) -> Operation:
    path, edge = draw(WORDS), st.builds(Edge, NAMES, NAMES, WORDS, LEAF_THRESHOLDS)
    return draw(
        st.one_of(
            st.builds(AddState, WORDS, elements("new", 1).map(lambda made: made[0]), st.lists(edge).map(tuple)),
            st.builds(RemoveState, WORDS),
            st.builds(AddOutcome, WORDS, edge),
            st.builds(RemoveOutcome, WORDS, WORDS),
            st.builds(SetTarget, st.just(path), WORDS, WORDS),
            st.builds(SetThreshold, st.just(path), WORDS, st.integers(-1, 3)),
            st.builds(SetParameter, WORDS, WORDS, VALUES),
            st.builds(SetData, WORDS, WORDS, VALUES),
            st.builds(SetDefault, WORDS, PLAIN_VALUES),
        )
    )


@settings(deadline=None, max_examples=30)
@given(machines())
def test_a_machine_comes_back_from_its_toml(machine: Machine) -> None:
    again = parse_machine(machine_to_toml(machine), "m.toml")
    assert again == machine
    assert again.checksum == machine.checksum
    assert machine_to_toml(again) == machine_to_toml(machine)


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 2**32 - 1), st.lists(operations(), max_size=4))
def test_a_patch_comes_back_from_its_bytes(base: int, done: list[Operation]) -> None:
    patch = Patch(base, tuple(done))
    assert unpack_patch(pack_patch(patch)) == patch


@settings(deadline=None, max_examples=30)
@given(machines(), st.data())
def test_what_is_added_and_removed_again_leaves_no_trace(machine: Machine, data: st.DataObject) -> None:
    groups_of = [""] + [n.path for n in machine.net.nodes[1:] if isinstance(n.element, Group)]
    at = data.draw(st.sampled_from(groups_of))
    group = machine.top if not at else machine.state(at)
    assert isinstance(group, Group)
    element, own = data.draw(elements("new", 1))
    element = replace(element, reads=())
    edges = tuple(replace(edge, next_state=group.outcomes[0]) for edge in own)
    way = Edge(group.start, "to the new", "new", 2)
    path = f"{at}/" if at else ""
    changed = apply(machine, Patch(machine.checksum, (AddState(at, element, edges), AddOutcome(at, way))))
    assert f"{path}new" in changed.state_names
    assert changed.checksum != machine.checksum
    back = (RemoveOutcome(f"{path}{group.start}", "to the new"), RemoveState(f"{path}new"))
    assert apply(changed, Patch(changed.checksum, back)) == machine
    assert apply(changed, Patch(changed.checksum, back)).checksum == machine.checksum


@settings(deadline=None, max_examples=30)
@given(machines(), st.data())
def test_a_patched_machine_is_the_one_declared_so(machine: Machine, data: st.DataObject) -> None:
    """The other way there: the plain tables of the machine are changed by hand and read."""
    number = data.draw(st.integers(0, len(machine.edges) - 1))
    edge = machine.edges[number]
    inside = machine.state(edge.state)
    suggested = isinstance(inside, State) and inside.suggests == edge.event
    threshold = edge.threshold if suggested or edge.threshold == INHERIT else data.draw(LEAF_THRESHOLDS)
    operations_done: list[Operation] = [SetThreshold(edge.state, edge.event, threshold), SetDefault("p", "new")]
    plain: Any = machine_plain(replace(machine, parameters=(Parameter("p", "new"),)))
    plain["edges"][number]["threshold"] = ("inherit", "off", "low", "high", "full")[threshold + 1]
    operations_done.append(SetData("", "k", 7))
    plain["data"]["k"] = 7
    declared = read_machine(Table(plain))
    old = replace(machine, parameters=(Parameter("p", "old"),))
    changed = apply(old, Patch(old.checksum, tuple(operations_done)))
    assert changed == declared
    assert declared is not None
    assert changed.checksum == declared.checksum


@settings(deadline=None, max_examples=30)
@given(machines())
def test_every_state_and_outcome_is_drawn(machine: Machine) -> None:
    dot = machine_dot(machine, Look(stubs=False))
    lines = [line.strip() for line in dot.splitlines()]
    nodes = machine.net.nodes[1:]
    for node in nodes:
        begin = f"n{node.number} [" if isinstance(node.element, State) else f"subgraph cluster_{node.number} {{"
        assert sum(line.startswith(begin) for line in lines) == 1
    loops = sum(
        machine.net.source[i] == machine.net.target[i] and isinstance(machine.state(e.state), State)
        for i, e in enumerate(machine.table)
    )
    inside = sum(line.count("\u21bb") for line in lines if line.startswith("n"))
    named = sum(name.count("\u21bb") for node in nodes for name in (node.element.name,))
    assert inside - named >= loops
    # A child of a concurrence may help to several outcomes.
    assert sum(" -> " in line for line in lines) >= sum(t >= 0 for t in machine.net.target) - loops
    assert dot == machine_dot(machine, Look(stubs=False))


@pytest.mark.usefixtures("dot")
@settings(deadline=None, max_examples=10)
@given(machines(), st.booleans(), st.sampled_from((None, 0, 3)))
def test_graphviz_reads_every_drawing(machine: Machine, stubs: bool, level: int | None) -> None:
    dot = machine_dot(machine, Look(machine.net.begin(), level, stubs=stubs))
    done = subprocess.run(["dot", "-Tsvg"], input=dot.encode(), capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
