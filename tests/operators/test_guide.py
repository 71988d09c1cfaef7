"""What a person decides where ViGIR's behaviours ask: every decision has an answer, by the evidence."""

from __future__ import annotations

import pytest

from teleop_sim.channel.messages import Confirm, Force, MirrorUpdate, Reject, Request, StepDone, TakeOver
from teleop_sim.machines.drc import door_machine, valve_machine
from teleop_sim.machines.mirror import Mirror
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.collaborate import Collaborate
from teleop_sim.operators.guide import EVIDENCE, load_guide
from teleop_sim.operators.station import tell

HIGH = 2
MACHINES = {
    "door-atlas": door_machine("atlas"),
    "door-thor": door_machine("thormang3"),
    "valve-atlas": valve_machine("atlas"),
    "valve-thor": valve_machine("thormang3"),
}
DOOR = MACHINES["door-atlas"]
UNLOCK = "Open_Door/Unlock_Door"


def decisions(machine):
    """States that decide, with their suggestion's place in the table where it may be asked for at level high."""
    for path in machine.state_names:
        state = machine.leaf(path)
        if state.decides:
            suggested = machine.edge_index(path, state.suggests) if state.suggests else -1
            if suggested < 0 or not machine.table[suggested].passes(HIGH):
                yield path, suggested


def at(machine, path, event=""):
    """A request of a state, and a belief that knows it."""
    kind = "decide" if machine.leaf(path).decides else "confirm"
    request = Request(1, kind, machine.net.by_path[path], machine.edge_index(path, event) if event else -1)
    belief = Belief(Mirror(machine, HIGH))
    return belief, request


def felt(belief, *steps):
    for step in steps:
        belief.take(StepDone(*step), 1.0)


def came(belief, machine, path, event):
    """The machine left a state."""
    update = MirrorUpdate(machine.edge_index(path, event))
    tell(belief.mirror, update)
    belief.take(update, 2.0)


def chosen(machine, belief, request):
    (message,) = Collaborate().answer(belief, request)
    if isinstance(message, Force):
        return machine.table[message.edge].event
    return machine.table[request.edge].event if isinstance(message, Confirm) else type(message).__name__


@pytest.mark.parametrize("name", MACHINES)
def test_every_decision_that_is_asked_at_level_high_has_an_answer(name):
    machine, found = MACHINES[name], 0
    for path, suggested in decisions(machine):
        belief = Belief(Mirror(machine, HIGH))
        request = Request(1, "decide", machine.net.by_path[path], suggested)
        row = load_guide().choice(belief, request)
        assert row is not None, path
        assert row.by_hand or machine.has_edge(path, row.take)
        # However often it is asked.
        for _ in range(30):
            (message,) = Collaborate().answer(belief, request)
            assert isinstance(message, Confirm | Force | TakeOver)
        found += 1
    assert found >= 4


def test_the_table_names_states_that_there_are_and_evidence_that_is_known():
    names = {machine.leaf(path).name for machine in MACHINES.values() for path in machine.state_names}
    guide = load_guide()
    assert set(guide.rules) <= names
    assert {row.when for rule in guide.rules.values() for row in rule.choices} <= set(EVIDENCE)
    programs = {machine.leaf(path).program for machine in MACHINES.values() for path in machine.state_names}
    assert {row.program for row in guide.in_lieu} <= programs


def test_a_lever_is_turned_until_it_was_felt_to_go_far_enough_then_the_door_is_pushed():
    belief, request = at(DOOR, f"{UNLOCK}/Decide_Push_Turn", "skip")
    came(belief, DOOR, f"{UNLOCK}/Turn_Handle/Turn_Handle", "done")
    felt(belief, ("grasp", "reached", 0.0), ("affordance", "reached", 0.5))
    assert chosen(DOOR, belief, request) == "turn"
    felt(belief, ("affordance", "reached", 0.4))
    assert chosen(DOOR, belief, request) == "push"


@pytest.mark.parametrize(("amount", "choice"), [(0.3, "skip"), (0.05, "turn")])
def test_after_a_push_it_counts_how_far_the_door_went(amount, choice):
    belief, request = at(DOOR, f"{UNLOCK}/Decide_Push_Turn", "skip")
    tell(belief.mirror, MirrorUpdate(DOOR.edge_index(f"{UNLOCK}/Push_Door/Plan_Push_Door", "done")))
    felt(belief, ("affordance", "reached", amount))
    came(belief, DOOR, f"{UNLOCK}/Push_Door/Push_Door", "done")
    came(belief, DOOR, f"{UNLOCK}/Push_Door", "finished")
    assert chosen(DOOR, belief, request) == choice


def test_a_wheel_is_turned_on_until_goes_add_up_to_a_whole_turn():
    machine = MACHINES["valve-atlas"]
    belief, request = at(machine, "Turn_Valve/Decide_Keep_Turning", "done")
    felt(belief, ("affordance", "reached", 2.0), ("affordance", "force_limit", 2.2))
    assert chosen(machine, belief, request) == "turn_more"
    felt(belief, ("affordance", "reached", 2.9))
    assert chosen(machine, belief, request) == "done"


def test_people_who_stand_there_do_not_walk():
    for name in ("valve-atlas", "valve-thor"):
        belief, request = at(MACHINES[name], "Decide_Walking")
        assert chosen(MACHINES[name], belief, request) == "walk"
        belief.work.in_reach = True
        assert chosen(MACHINES[name], belief, request) == "skip"


def test_what_was_found_off_is_repeated_twice_at_most():
    belief, request = at(DOOR, "Open_Door/Go_to_Grasp/Optional_Template_Adjustment", "skip")
    assert chosen(DOOR, belief, request) == "skip"
    belief.work.checked[1] = "template"
    assert [chosen(DOOR, belief, request) for _ in range(3)] == ["pregrasp", "pregrasp", "skip"]
    belief.work.checked[1] = "hand"
    assert [chosen(DOOR, belief, request) for _ in range(3)] == ["grasp", "grasp", "skip"]


def test_a_hand_goes_all_the_way_anew_where_it_was_learnt_that_clouds_are_off():
    belief, request = at(DOOR, "Open_Door/Go_to_Grasp/Optional_Template_Adjustment", "skip")
    belief.work.checked[1] = "sensor"
    # It is off, too.
    assert [chosen(DOOR, belief, request) for _ in range(5)] == ["pregrasp", "pregrasp", "grasp", "grasp", "skip"]


def test_the_first_failure_is_tried_anew_where_it_would_end_the_container_the_second_is_done_by_hand():
    path = f"{UNLOCK}/Turn_Handle/Turn_Handle"
    belief, request = at(DOOR, path, "failed")
    (first,) = Collaborate().answer(belief, request)
    assert first == Reject(1)
    belief.note_refusal(request)
    assert Collaborate().answer(belief, request) == (TakeOver(request.node),)
    assert load_guide().goals(DOOR, path) == ("turn",)
    acting = Request(2, "act", request.node)
    belief.work.done[2] = True
    assert Collaborate().answer(belief, acting) == (Force(DOOR.edge_index(path, "done"), belief.mirror.seen),)


def test_a_plan_that_was_carried_out_by_hand_is_not_carried_out_again():
    planned, moved = (f"Open_Door/Go_to_Pregrasp/{name}" for name in ("Plan_To_Pregrasp_Pose", "Move_To_Pregrasp_Pose"))
    belief, request = at(DOOR, moved, "failed")
    came(belief, DOOR, planned, "planned")
    belief.work.last_by_hand = planned
    assert Collaborate().answer(belief, request) == (Force(DOOR.edge_index(moved, "done"), belief.mirror.seen),)


def test_a_walk_that_was_made_by_hand_is_not_made_again():
    """Between a plan of footsteps and the walk lie other states, which have nothing to do then."""
    pipeline = "Walk_to_Template/Planning_Pipeline"
    belief, request = at(DOOR, "Walk_to_Template/Walk_To_Waypoint", "failed")
    assert load_guide().goals(DOOR, f"{pipeline}/Plan_To_Waypoint") == ("stand",)
    belief.work.last_by_hand = f"{pipeline}/Plan_To_Waypoint"
    for path, event in (
        (f"{pipeline}/Plan_To_Waypoint", "planned"),
        (f"{pipeline}/Modify_Plan", "received"),
        (pipeline, "finished"),
    ):
        came(belief, DOOR, path, event)
    assert chosen(DOOR, belief, request) == "finished"
