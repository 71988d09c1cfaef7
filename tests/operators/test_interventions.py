"""What is typed by hand, against the machine's own table."""

import pytest

from teleop_sim.machines.declare import Edge, Machine, State
from teleop_sim.machines.src_dish import src_dish
from teleop_sim.operators.interventions import Interventions, commands, failed_state, load_interventions
from teleop_sim.operators.interventions import shortest_way_back as way_back

DISH, TABLE, ERROR = src_dish(), load_interventions(), "STATE_ERROR"


def typed(failed: str, tries: int = 0, before: tuple[str, ...] = ()) -> tuple[str, ...]:
    return commands(TABLE, DISH, (*before, failed, ERROR), (failed,) * tries, ERROR)


def test_every_command_of_the_table_is_accepted_where_the_machine_waits():
    for rule in TABLE.rules:
        for row in rule.ladder:
            assert all(DISH.has_edge(ERROR, c) for c in row if c.startswith("/"))
            assert row[-1].startswith("/"), "the last command must be one whose effect the mirror shows"
    assert DISH.has_edge(ERROR, TABLE.give_up)


def test_every_state_that_can_fail_has_a_rule():
    failing = {edge.state for edge in DISH.edges if edge.next_state == ERROR}
    # Not run by the operator: the teleport of a skipped checkpoint has no rule and falls back on the edges.
    ruled = {name for rule in TABLE.rules for name in rule.failed}
    assert failing - ruled == {"STATE_SKIP_TO_CP3"}
    assert ruled <= set(DISH.state_names)


@pytest.mark.parametrize(
    ("failed", "first", "second"),
    [
        ("STATE_DETECT_PANEL_FINE", "/RESTART", "/RESTART"),
        ("STATE_CORRECT_PITCH", "/REDETECT_HANDLES_FROM_ERROR", "/REGRASP_PITCH_HANDLE_FROM_ERROR"),
        ("STATE_CORRECT_YAW", "/REDETECT_HANDLES_FROM_ERROR", "/REGRASP_YAW_HANDLE_FROM_ERROR"),
        ("STATE_WALK_TO_FINISH", "/REGRASP_YAW_HANDLE_FROM_ERROR", "/REGRASP_YAW_HANDLE_FROM_ERROR"),
    ],
)
def test_the_ladder_goes_from_the_first_try_to_the_next(failed, first, second):
    assert typed(failed) == (first,)
    assert typed(failed, tries=1) == (second,)


@pytest.mark.parametrize("axis", ["PITCH", "YAW"])
def test_handles_that_are_not_seen_get_another_view_then_the_axis_at_work(axis):
    before = (f"STATE_CORRECT_{axis}",)
    assert typed("STATE_REDETECT_HANDLE", 0, before) == ("&0 30 0", "/REDETECT_HANDLES_FROM_ERROR")
    assert typed("STATE_REDETECT_HANDLE", 1, before) == (f"/REGRASP_{axis}_HANDLE_FROM_ERROR",)


def test_after_enough_failed_interventions_the_operator_gives_up():
    assert typed("STATE_CORRECT_YAW", tries=TABLE.give_up_after_same) == (TABLE.give_up,)
    many = tuple(f"STATE_{i}" for i in range(TABLE.give_up_after))
    assert commands(TABLE, DISH, ("STATE_CORRECT_YAW", ERROR), many, ERROR) == (TABLE.give_up,)


def test_the_failed_state_is_the_last_in_which_nobody_was_awaited():
    assert failed_state(DISH, ("STATE_INIT", "STATE_CORRECT_YAW", ERROR)) == "STATE_CORRECT_YAW"
    assert failed_state(DISH, (ERROR,)) == ""


def test_without_a_rule_the_shortest_way_back_is_taken():
    assert way_back(DISH, ERROR, "STATE_DETECT_FINISH") == "/REGRASP_YAW_HANDLE_FROM_ERROR"
    assert way_back(DISH, ERROR, "STATE_WALK_TO_PANEL") == "/RESTART"
    assert way_back(DISH, ERROR, "STATE_SKIP_TO_CP3") == "/RESTART"
    bare = Interventions(TABLE.give_up, 3, 3, ())
    assert commands(bare, DISH, ("STATE_CORRECT_PITCH", ERROR), (), ERROR) == ("/REGRASP_PITCH_HANDLE_FROM_ERROR",)


def test_a_state_that_cannot_be_reached_again_means_giving_up():
    once = Machine(
        name="once",
        start="a",
        states=(State("a", "a"), State("wait", manual=True), State("end")),
        edges=(
            Edge("a", "/BAD", "wait", 2, "failed"),
            Edge("a", "/GOOD", "end", 0),
            Edge("wait", "/END_THE_STATE_MACHINE", "end", 3, "command", "operator"),
        ),
        ends=frozenset({"end"}),
    )
    assert way_back(once, "wait", "a") == ""
    assert commands(TABLE, once, ("a", "wait"), (), "wait") == (TABLE.give_up,)
