"""A behaviour changed while it runs: what is refused and why, what would vanish, what no bytes can do."""

from __future__ import annotations

import json
import zlib
from dataclasses import replace

import pytest

from teleop_sim.core.errors import BadInput
from teleop_sim.machines import patch_bytes
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import Concurrence, Edge, Given, Group, Parameter, Rule, State
from teleop_sim.machines.engine import Engine
from teleop_sim.machines.library import MACHINES
from teleop_sim.machines.modify import (
    AddOutcome,
    AddState,
    BadPatch,
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
    vanishing,
)
from teleop_sim.machines.net import Configuration

BOTH = Concurrence(
    "both",
    (State("look", "look"), State("hold", "hold")),
    (Edge("look", "seen", "", 0), Edge("hold", "held", "", 0), Edge("hold", "slipped", "", 0, "failed")),
    ("ok", "lost"),
    "all",
    (Rule("ok", (("look", "seen"), ("hold", "held"))),),
    "lost",
)
ARM = Group(
    "arm",
    "plan",
    (State("plan", "plan", parameters=(("speed", 0.5),)), State("move", "move")),
    (Edge("plan", "planned", "move", 1), Edge("move", "moved", "ok", 2), Edge("plan", "failed", "bad", 2, "failed")),
    ("ok", "bad"),
    data=(("tries", 3),),
)
DOOR = Machine(
    "door",
    "walk",
    (State("walk", "walk"), ARM, BOTH),
    (
        Edge("walk", "there", "arm", 1),
        Edge("arm", "ok", "both", -1),
        Edge("arm", "bad", "walk", 0),
        Edge("both", "ok", "done", -1),
        Edge("both", "lost", "arm", 0),
    ),
    outcomes=("done",),
    goals=frozenset({"done"}),
    parameters=(Parameter("hand", "left", ("left", "right")),),
    data=(("hand", Given("hand")),),
)


def changed(*operations: Operation, machine: Machine = DOOR) -> Machine:
    return apply(machine, Patch(machine.checksum, operations))


def reasons(*operations: Operation) -> list[str]:
    with pytest.raises(BadInput) as refused:
        changed(*operations)
    return [str(problem) for problem in refused.value.problems]


def test_each_operation_changes_what_it_says():
    assert changed(SetThreshold("arm/plan", "planned", 3)).edge("arm/plan", "planned").threshold == 3
    assert changed(SetTarget("both", "lost", "walk")).edge("both", "lost").next_state == "walk"
    assert changed(SetParameter("arm/plan", "speed", 0.1)).leaf("arm/plan").parameters == (("speed", 0.1),)
    assert changed(SetData("arm", "tries", None)).net.nodes[DOOR.net.by_path["arm"]].element.data == (("tries", None),)
    assert changed(SetDefault("hand", "right")).given().parameters[0].default == "right"
    added = changed(AddState("arm", State("check", "check"), (Edge("check", "good", "ok", 0),)), to_check())
    assert added.edge("arm/move", "moved").next_state == "arm/check"
    assert added.edge("arm/check", "good").next_state == "arm"
    ended = changed(AddState("", State("rest"), end=True), SetTarget("arm", "bad", "rest"))
    assert ended.ends == {"rest"}
    assert changed(SetTarget("arm", "bad", "walk"), RemoveState("rest"), machine=ended) == DOOR


def to_check() -> SetTarget:
    return SetTarget("arm/move", "moved", "check")


def test_an_outcome_of_a_container_comes_and_goes_with_its_edge():
    more = changed(AddOutcome("", Edge("arm", "stuck", "walk", 0)), SetTarget("arm/plan", "failed", "stuck"))
    assert more.state("arm").outcomes == ("ok", "bad", "stuck")
    assert changed(SetTarget("arm/plan", "failed", "bad"), RemoveOutcome("arm", "stuck"), machine=more) == DOOR


def test_a_spare_state_that_is_reached_is_spare_no_more():
    spare = State("spare", "spare")
    edge = Edge("spare", "used", "done", 0)
    kept = replace(DOOR, states=(*DOOR.states, spare), edges=(*DOOR.edges, edge), spare=("spare",))
    used = changed(SetTarget("arm", "bad", "spare"), machine=kept)
    assert (used.spare, used.edge("arm", "bad").next_state) == ((), "spare")
    assert changed(RemoveState("spare"), machine=kept) == DOOR


def test_what_one_operation_leaves_open_a_later_one_may_close():
    assert reasons(RemoveState("both"))
    assert "both" not in changed(RemoveState("both"), SetTarget("arm", "ok", "done")).state_names


def test_all_reasons_are_given_at_once():
    with pytest.raises(BadInput) as refused:
        apply(DOOR, Patch(1, (RemoveState("leg"), SetThreshold("walk", "their", 1), SetParameter("arm", "x", 1))))
    first, *others = (str(problem) for problem in refused.value.problems)
    assert "00000001" in first
    assert f"{DOOR.checksum:08x}" in first
    assert [other.split(": ")[1] for other in others] == ["1. RemoveState", "2. SetThreshold", "3. SetParameter"]
    assert "Did you mean 'there'?" in others[1]


@pytest.mark.parametrize(
    ("operation", "word"),
    [
        (SetThreshold("walk", "there", 4), "threshold 4"),
        (SetTarget("walk", "there", "leg"), "unknown name 'leg'"),
        (AddState("arm", State("plan", "plan")), "declared twice"),
        (AddState("", State("far", "far"), (Edge("far", "done", "done", 0),)), "unreachable"),
        (RemoveOutcome("both", "ok"), "unknown name 'ok'"),
        (SetDefault("hand", "third"), "is no choice"),
        (SetData("", "hand", Given("foot")), "unknown name 'foot'"),
        (SetData("", "foot", 1), "unknown name 'foot'"),
        (SetParameter("arm/plan", "sped", 1), "Did you mean 'speed'?"),
        (RemoveState("both/hold"), "hold"),
    ],
)
def test_a_change_that_would_spoil_the_machine_is_refused(operation: Operation, word: str):
    assert any(word in reason for reason in reasons(operation))


def at(*paths: str, parked: tuple[tuple[str, str], ...] = ()) -> Configuration:
    numbers = tuple(sorted(DOOR.edge_index(*pair) for pair in parked))
    return Configuration(tuple(sorted(DOOR.net.by_path[path] for path in paths)), numbers)


WITHOUT_ARM = (RemoveState("arm"), SetTarget("walk", "there", "both"), SetTarget("both", "lost", "walk"))
NO_SLIP = (RemoveOutcome("both/hold", "slipped"),)
THREE = (AddState("both", State("wait", "wait"), (Edge("wait", "waited", "", 0),)),)
OTHER_PLAN = (
    RemoveState("arm/plan"),
    AddState("arm", State("plan", "think"), (Edge("plan", "planned", "move", 1), Edge("plan", "failed", "bad", 1))),
)


@pytest.mark.parametrize(
    ("operations", "configuration", "gone"),
    [
        (WITHOUT_ARM, at("walk"), ()),
        (WITHOUT_ARM, at("arm/move"), ("arm/move", "arm")),
        (WITHOUT_ARM, at("arm"), ("arm",)),
        (NO_SLIP, at("both/look", parked=(("both/hold", "slipped"),)), ("both/hold: slipped",)),
        (NO_SLIP, at("both/look", parked=(("both/hold", "held"),)), ()),
        (THREE, at("both/look", "both/hold"), ("both",)),
        (THREE, at("arm/plan"), ()),
        (OTHER_PLAN, at("arm/plan"), ("arm/plan",)),
        (OTHER_PLAN, at("arm/move"), ()),
        ((SetParameter("arm/plan", "speed", 0.1),), at("arm/plan"), ()),
    ],
)
def test_what_is_at_work_must_not_vanish(
    operations: tuple[Operation, ...], configuration: Configuration, gone: tuple[str, ...]
):
    assert vanishing(DOOR, changed(*operations), configuration) == gone


def test_a_needed_outcome_must_not_vanish():
    assert vanishing(DOOR, changed(*NO_SLIP), at("walk"), (("walk", "there"),)) == ()
    assert vanishing(DOOR, changed(*NO_SLIP), at("walk"), (("both/hold", "slipped"),)) == ("both/hold: slipped",)


def test_a_running_engine_goes_on_in_the_changed_machine():
    engine = Engine(DOOR, 3)
    engine.signal("walk", "there")
    engine.signal("arm/plan", "planned")
    new = changed(AddState("arm", State("check", "check"), (Edge("check", "good", "ok", 0),)), to_check())
    assert vanishing(DOOR, new, engine.configuration) == ()
    engine.renew(new)
    engine.signal("arm/move", "moved")
    assert [new.net.nodes[n].path for n in engine.configuration.active] == ["arm/check"]
    engine.signal("arm/check", "good")
    assert [new.net.nodes[n].path for n in engine.configuration.active] == ["both/look", "both/hold"]


def test_a_threshold_is_a_small_message():
    machine = MACHINES["vigir-door-atlas"]()
    change = SetThreshold("Open_Door/Go_to_Grasp/Plan_To_Grasp", "planned", 3)
    # 36 + 7 bytes of names, a checksum of ten digits; the form itself must cost next to nothing.
    assert len(pack_patch(Patch(machine.checksum, (change,)))) < 75


def deflated(text: bytes) -> bytes:
    deflate = zlib.compressobj(9, zlib.DEFLATED, -15, zdict=patch_bytes._WORDS)
    return b"\x01" + deflate.compress(text) + deflate.flush()


def plain(**changes: object) -> bytes:
    one = {"op": "set_threshold", "path": "walk", "event": "there", "threshold": "low"} | changes
    return json.dumps({"base": 1, "do": [one]}, separators=(",", ":")).encode()


def test_the_reader_takes_its_own_form():
    assert unpack_patch(deflated(plain())) == Patch(1, (SetThreshold("walk", "there", 1),))


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\x02",
        b"\x01",
        b"\x01\xff\xff",
        deflated(plain()) + b"\0",
        deflated(plain())[:-1],
        deflated(b"[]"),
        deflated(b"\xff"),
        deflated(b'{"base":1,"do":[[]]}'),
        deflated(b'{"base":-1,"do":[]}'),
        deflated(b'{"base":true,"do":[]}'),
        deflated(b'{"base":1,"do":[],"more":1}'),
        deflated(b'{"base":1, "do":[]}'),
        deflated(b'{"base":1,"base":1,"do":[]}'),
        deflated(plain(op="os.system")),
        deflated(plain(op=["set_threshold"])),
        deflated(plain(threshold=1)),
        deflated(plain(threshold=["low"])),
        deflated(plain(path=None)),
        deflated(plain(why="because")),
        deflated(b'{"base":1,"do":[{"op":"remove_state","path":"\\ud800"}]}'),
        deflated(b'{"base":' + b"9" * 5000 + b',"do":[]}'),
        deflated(b"[" * 100_000),
        deflated(b" " * (patch_bytes.MOST_BYTES + 1)),
    ],
    ids=range(24),
)
def test_what_is_no_patch_is_refused_as_such(data: bytes):
    with pytest.raises(BadPatch):
        unpack_patch(data)


@pytest.mark.parametrize(
    "operation",
    [SetData("", "k", "x" * patch_bytes.MOST_BYTES), SetThreshold("walk", "there", 4), SetData("", "k", "\ud800")],
    ids=("large", "threshold", "surrogate"),
)
def test_a_patch_that_nobody_could_read_is_not_packed(operation: Operation):
    with pytest.raises(BadPatch):
        pack_patch(Patch(1, (operation,)))


def test_a_checksum_sees_every_published_threshold():
    machine = MACHINES["vigir-valve-thor"]()
    sums = {machine.checksum}
    for edge in machine.edges:
        if edge.threshold >= 0:
            sums.add(changed(SetThreshold(edge.state, edge.event, 3 - edge.threshold), machine=machine).checksum)
    assert len(sums) == 1 + sum(edge.threshold >= 0 for edge in machine.edges)


def test_words_are_not_part_of_what_both_sites_agree_on():
    noted = replace(DOOR, edges=tuple(replace(edge, note="a note") for edge in DOOR.edges))
    assert noted.checksum == DOOR.checksum
