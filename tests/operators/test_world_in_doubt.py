"""What people do where steps find no way again and again: another try, a new world model, by hand. Bytes in, bytes out.

Source of the order: A. Romay et al., sections 6.1.1 and 7.1.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
import simpy

from teleop_sim.channel.messages import (
    Confirm,
    LevelIs,
    Message,
    MirrorUpdate,
    Reject,
    Request,
    ResetWorld,
    StepDone,
    TakeOver,
    Withdrawn,
    decode_payload,
    encode_message,
)
from teleop_sim.channel.template_ends import StationTemplates
from teleop_sim.core.records import OperatorActed, Record
from teleop_sim.machines.drc import door_machine
from teleop_sim.machines.mirror import Mirror
from teleop_sim.operators.acts import Briefing
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.collaborate import Collaborate
from teleop_sim.operators.crew import Crew
from teleop_sim.operators.guide import load_guide
from teleop_sim.operators.roles import TEAMS
from teleop_sim.operators.station import tell
from teleop_sim.operators.template_giver import TemplateGiver
from teleop_sim.operators.template_layer import TemplateLayer
from teleop_sim.operators.timing import load_timing
from teleop_sim.templates.library import library

EXACT = replace(load_timing(), spread=0.0)
CALM = Briefing(round_trip_s=0.2, uplink_bps=1e6)
THOR = door_machine("thormang3")
PLACE = "Open_Door/Place_Handle_Hand"
FIRST = f"{PLACE}/Go_to_Pre_Grasp_Pose/Move_To_Pregrasp_Pose"
"""After its failure people are asked what to do next."""
LAST = f"{PLACE}/Next_Pre_Grasp_Pose/Move_To_Prerasp_Pose"
"""Its failure ends the behaviour, unless somebody refuses it."""
NO_WAY = StepDone("pregrasp", "no_plan", 0.0)
PEOPLES = (Confirm, Reject, ResetWorld, TakeOver)


@dataclass
class Room:
    """A crew on a clock, with a drawer for what it sends."""

    team: int = 4
    env: simpy.Environment = field(default_factory=simpy.Environment)
    sent: list[Message] = field(default_factory=list)
    records: list[Record] = field(default_factory=list)

    def __post_init__(self) -> None:
        station = StationTemplates(CALM.round_trip_s)
        giver = TemplateGiver(station, library().named("door"), (0.0, 0.0, 1.6))
        layer, rng = TemplateLayer(giver, EXACT), np.random.default_rng(1)
        self.crew = Crew(
            self.env, Mirror(THOR, 2), self._send, EXACT, rng, self.records.append, CALM, Collaborate(), self.team,
            templates=station, hands=layer,
        )  # fmt: skip
        self.env.process(self.crew.run())

    def _send(self, _topic: str, payload: bytes, _text: str) -> None:
        message = decode_payload(payload)
        # The station's software asks for the machine's state, which nobody here tells.
        if isinstance(message, PEOPLES):
            self.sent.append(message)

    def arrives(self, *messages: Message) -> list[Message]:
        """Let messages arrive now; what people have sent when they would lose their patience."""
        before = len(self.sent)
        for message in messages:
            self.crew.receive(encode_message(message)[1])
        self.env.run(self.env.now + EXACT.patience_s)
        return self.sent[before:]

    def acts(self, kind: str) -> list[OperatorActed]:
        return [r for r in self.records if isinstance(r, OperatorActed) and r.kind == kind]


def failed(number: int, path: str = LAST) -> Request:
    return Request(number, "confirm", THOR.net.by_path[path], THOR.edge_index(path, "failed"))


@pytest.mark.parametrize("team", sorted(TEAMS))
def test_the_second_step_without_a_way_has_the_world_model_reset_before_the_failure_is_refused(team):
    room = Room(team)
    assert room.arrives(NO_WAY, failed(1, FIRST)) == [Confirm(1)]
    assert room.arrives(Withdrawn(1), NO_WAY, failed(2)) == [ResetWorld(), Reject(2)]
    (reset,) = [a for a in room.acts("send") if "reset the world model" in a.text]
    assert reset.role == "auxiliary"


def test_the_supervisor_asks_for_it_hears_that_it_is_done_and_only_then_answers():
    room = Room(team=3)
    room.arrives(NO_WAY, failed(1, FIRST))
    room.arrives(Withdrawn(1), NO_WAY, failed(2))
    said = [(a.role, a.text) for a in room.acts("talk") if a.request == 2 and a.text.startswith("say")]
    assert said == [("supervisor", "say: reset the world model"), ("auxiliary", "say: the world model is reset")]
    reset, report = room.acts("send")[-2], room.acts("talk")[-1]
    answer = room.acts("send")[-1]
    # Four words are 1.6 s, five are 2.0 s; then the answer takes what it always does.
    assert report.t_s == pytest.approx(reset.t_s + 5 * 0.4)
    assert answer.start_s == pytest.approx(report.t_s + EXACT.judge_s(len(answer_words(room, 2))))


def answer_words(room: Room, number: int) -> list[str]:
    """What the supervisor reads."""
    return room.crew.belief.question(failed(number)).replace("/", " ").replace("_", " ").split()


def test_what_fails_in_a_new_world_model_is_done_by_hand_and_then_left_to_fail():
    room = Room()
    room.arrives(NO_WAY, failed(1, FIRST))
    room.arrives(Withdrawn(1), NO_WAY, failed(2))
    # Refused once, and it finds no way in what people have seen to already.
    assert room.arrives(Withdrawn(2), NO_WAY, failed(3)) == [TakeOver(THOR.net.by_path[LAST])]
    assert load_guide().goals(THOR, LAST) == ("pregrasp",)
    room.crew.belief.note_in_lieu(LAST)
    assert room.arrives(Withdrawn(3), NO_WAY, failed(4)) == [Confirm(4)]
    assert room.sent.count(ResetWorld()) == 1


def test_a_failure_after_which_people_are_asked_what_to_do_next_waits_for_nothing():
    # The second one is the primary operator's to take over; what he finds in doubt he resets himself.
    room, take_over = Room(), TakeOver(THOR.net.by_path[FIRST])
    assert room.arrives(NO_WAY, failed(1, FIRST)) == [Confirm(1)]
    came(room.crew.belief, FIRST)
    assert room.arrives(Withdrawn(1), NO_WAY, failed(2, FIRST))[0] == take_over


def came(belief: Belief, path: str) -> None:
    """The machine was seen to fail there."""
    belief.take(MirrorUpdate(THOR.edge_index(path, "failed")), 1.0)


@pytest.mark.parametrize(
    "felt",
    [(), (NO_WAY,), (NO_WAY, StepDone("pregrasp", "reached", 0.0), NO_WAY), (StepDone("grasp", "blocked", 0.0),) * 2],
    ids=("nothing", "once", "not in a row", "blocked"),
)
def test_who_has_no_reason_to_doubt_the_world_model_leaves_it(felt):
    assert Room().arrives(*felt, failed(1)) == [Reject(1)]


def test_where_nobody_is_asked_the_supervisor_has_it_reset_all_the_same():
    assert Room().arrives(NO_WAY, NO_WAY, LevelIs(3)) == [ResetWorld()]


def test_it_is_not_advised_where_it_comes_before_an_answer():
    belief, request = Belief(Mirror(THOR, 2)), failed(1)
    for message in (NO_WAY, NO_WAY):
        belief.take(message, 1.0)
    assert Collaborate().advise(belief, 1.0, CALM) == (ResetWorld(),)
    tell(belief.mirror, request)
    assert Collaborate().advise(belief, 1.0, CALM) == ()
