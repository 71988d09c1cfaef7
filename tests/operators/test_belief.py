"""A belief is made of what arrived; what was lost leaves a gap, not a crash."""

import pytest

from teleop_sim.channel.messages import LogLine, MirrorUpdate, Request
from teleop_sim.machines.mirror import Mirror
from teleop_sim.machines.src_dish import src_dish
from teleop_sim.operators.belief import Belief

DISH = src_dish()


def update(state: str, event: str) -> MirrorUpdate:
    return MirrorUpdate(DISH.edge_index(state, event))


@pytest.fixture
def belief() -> Belief:
    return Belief(Mirror(DISH, 3))


def test_states_are_remembered_once_a_visit(belief):
    for event in ("/GOTO_STATE_INIT", "/INIT_RETRY", "/INIT_RETRY", "/INIT_FAILED"):
        belief.take(update("STATE_PRE_INIT" if event.startswith("/GOTO") else "STATE_INIT", event))
    assert belief.visited == ("STATE_PRE_INIT", "STATE_INIT", "STATE_ERROR")
    assert belief.mirror.state == "STATE_ERROR"


def test_a_lost_update_still_tells_where_the_machine_was(belief):
    belief.take(update("STATE_CORRECT_YAW", "/YAW_CORRECTION_FAILED"))
    assert belief.visited == ("STATE_PRE_INIT", "STATE_CORRECT_YAW", "STATE_ERROR")
    assert not belief.mirror.in_step
    belief.note_help()
    assert belief.helped == ("STATE_CORRECT_YAW",)


def test_an_update_that_is_not_in_the_table_changes_nothing_but_the_doubt(belief):
    assert belief.take(MirrorUpdate(255)) is None
    assert belief.visited == ("STATE_PRE_INIT",)
    assert not belief.mirror.in_step


def test_lines_change_no_belief(belief):
    assert belief.take(LogLine(1.0, "all is well")) is None
    assert belief.mirror.in_step


@pytest.mark.parametrize("named", ["STATE_ERROR", "STATE_CORRECT_YAW"])
def test_a_request_for_help_waits_in_the_manual_state_whichever_state_it_names(belief, named):
    request = Request(1, "manual", DISH.state_names.index(named), 0)
    assert belief.waiting_state(request) == "STATE_ERROR"


def test_a_request_for_confirmation_waits_in_its_own_state(belief):
    request = Request(1, "confirm", DISH.state_names.index("STATE_INIT"), DISH.events.index("/REGULAR"))
    assert belief.waiting_state(request) == "STATE_INIT"
    assert belief.question(request) == "INIT /REGULAR"
