"""A belief is made of what arrived; what was lost leaves a gap, not a crash."""

import pytest

from teleop_sim.channel.messages import LogLine, Message, MirrorUpdate, Request, SyncState
from teleop_sim.machines.declare import Edge
from teleop_sim.machines.mirror import Mirror
from teleop_sim.machines.net import Configuration
from teleop_sim.machines.src_dish import src_dish
from teleop_sim.machines.sync import Snapshot
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.station import tell

DISH = src_dish()


def update(state: str, event: str) -> MirrorUpdate:
    return MirrorUpdate(DISH.edge_index(state, event))


def node(state: str) -> int:
    return DISH.net.by_path[state]


def arrive(belief: Belief, message: Message) -> Edge | None:
    tell(belief.mirror, message)
    return belief.take(message)


@pytest.fixture
def belief() -> Belief:
    return Belief(Mirror(DISH, 3))


def test_states_are_remembered_once_a_visit(belief):
    for event in ("/GOTO_STATE_INIT", "/INIT_RETRY", "/INIT_RETRY", "/INIT_FAILED"):
        arrive(belief, update("STATE_PRE_INIT" if event.startswith("/GOTO") else "STATE_INIT", event))
    assert belief.visited == ("STATE_PRE_INIT", "STATE_INIT", "STATE_ERROR")
    assert belief.mirror.state == "STATE_ERROR"


def test_a_lost_update_still_tells_where_the_machine_was(belief):
    arrive(belief, update("STATE_CORRECT_YAW", "/YAW_CORRECTION_FAILED"))
    assert belief.visited == ("STATE_PRE_INIT", "STATE_CORRECT_YAW", "STATE_ERROR")
    assert not belief.mirror.in_step
    belief.note_help()
    assert belief.helped == ("STATE_CORRECT_YAW",)


def test_an_update_that_is_not_in_the_table_changes_nothing_but_the_doubt(belief):
    assert arrive(belief, MirrorUpdate(255)) is None
    assert belief.visited == ("STATE_PRE_INIT",)
    assert not belief.mirror.in_step


def test_lines_change_no_belief(belief):
    assert arrive(belief, LogLine(1.0, "all is well")) is None
    assert belief.mirror.in_step


@pytest.mark.parametrize("named", ["STATE_ERROR", "STATE_CORRECT_YAW"])
def test_a_request_for_help_waits_in_the_manual_state_whichever_state_it_names(belief, named):
    request = Request(1, "manual", node(named))
    assert belief.waiting_state(request) == "STATE_ERROR"


def test_a_request_for_confirmation_waits_in_its_own_state(belief):
    request = Request(1, "confirm", node("STATE_INIT"), DISH.edge_index("STATE_INIT", "/REGULAR"))
    assert belief.waiting_state(request) == "STATE_INIT"
    assert belief.question(request) == "INIT /REGULAR"


def test_the_whole_state_moves_the_belief(belief):
    there = Configuration((node("STATE_CORRECT_YAW"),))
    state = SyncState(Snapshot(DISH.checksum, there, 2, "auto").pack())
    for _ in range(2):
        assert arrive(belief, state) is None
    assert belief.visited == ("STATE_PRE_INIT", "STATE_CORRECT_YAW")
    assert (belief.mirror.level, belief.mirror.mode) == (2, "auto")


@pytest.mark.parametrize(("kind", "verb"), [("manual", "help"), ("decide", "choose"), ("data", "give"), ("act", "act")])
def test_a_question_says_what_is_wanted(belief, kind, verb):
    assert belief.question(Request(1, kind, node("STATE_INIT"))) == f"{verb} INIT"
