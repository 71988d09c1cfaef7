"""Who answers what, who tells whom, and what gives way. Bytes go in, bytes come out; no link."""

from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
import pytest
import simpy

from teleop_sim.channel.messages import (
    Answer,
    AskView,
    Chat,
    Confirm,
    Force,
    LogLine,
    Message,
    Preempt,
    Request,
    SyncState,
    TemplateHash,
    TemplateSync,
    decode_payload,
    encode_image,
    encode_message,
)
from teleop_sim.channel.template_ends import StationTemplates
from teleop_sim.core.records import OperatorActed, Record
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.library import MACHINES
from teleop_sim.machines.mirror import Mirror
from teleop_sim.machines.net import Configuration
from teleop_sim.machines.sync import Asked, Snapshot
from teleop_sim.operators.acts import Briefing
from teleop_sim.operators.crew import Crew
from teleop_sim.operators.desk import Giver
from teleop_sim.operators.human import Human
from teleop_sim.operators.policies import Policy, Supervise
from teleop_sim.operators.roles import ROLES, TEAMS, role_of
from teleop_sim.operators.timing import load_timing
from teleop_sim.operators.workload import Curve

DOOR = MACHINES["vigir-door-atlas"]()
EXACT = replace(load_timing(), spread=0.0)
CALM = Briefing(round_trip_s=4.0, uplink_bps=1e6)
DECIDE = "Open_Door/Go_to_Grasp/Decide_Which_Grasp"
INPUT = "Get_Door_Template_ID"
GRASP = "Open_Door/Go_to_Grasp/Move_To_Grasp_Pose"


class Fixed:
    """Gives the same template's number whatever is asked, after a minute's work."""

    def work_s(self, _belief, _request, _timing) -> float:
        return 60.0

    def give(self, _belief, request, _rng) -> tuple[Message, ...]:
        return (Answer(request.request, b"\x07"),)


@dataclass
class Room:
    """A crew on a clock."""

    team: int = 1
    policy: Policy = field(default_factory=Supervise)
    human: Human = field(default_factory=Human)
    machine: Machine = DOOR
    briefing: Briefing = CALM
    giver: Giver = field(default_factory=Fixed)
    templates: StationTemplates | None = None
    env: simpy.Environment = field(default_factory=simpy.Environment)
    sent: list[tuple[float, Message]] = field(default_factory=list)
    records: list[OperatorActed] = field(default_factory=list)

    def __post_init__(self) -> None:
        rng, mirror = np.random.default_rng(1), Mirror(self.machine, 2)
        more = {"SELECTED_OBJECT_ID": self.giver}, self.templates
        told, crew = self.briefing, (self.policy, self.team, self.human)
        self.crew = Crew(self.env, mirror, self._send, EXACT, rng, self._note, told, *crew, *more)
        self.env.process(self.crew.run())

    def _note(self, record: Record) -> None:
        assert isinstance(record, OperatorActed)
        self.records.append(record)

    def _send(self, _topic: str, payload: bytes, _text: str) -> None:
        self.sent.append((float(self.env.now), decode_payload(payload)))

    def at(self, time_s: float, *messages: Message) -> None:
        self.env.process(self._deliver(time_s, messages))

    def _deliver(self, time_s, messages):
        yield self.env.timeout(time_s)
        for message in messages:
            self.crew.receive(encode_message(message)[1])

    def asks(self, time_s: float, *asked: tuple[int, str, str, str]) -> None:
        """The whole state: the machine is at these states, which ask (number, kind, path, event)."""
        net = self.machine.net
        requests = tuple(
            Asked(n, kind, net.by_path[path], self.machine.edge_index(path, event) if event else -1)
            for n, kind, path, event in asked
        )
        active = tuple(dict.fromkeys(a.node for a in requests)) or (net.by_path[GRASP],)
        self.at(time_s, SyncState(Snapshot(self.machine.checksum, Configuration(active), 2, asked=requests).pack()))

    def acts(self, kind: str) -> list[OperatorActed]:
        return [r for r in self.records if r.kind == kind]


@pytest.mark.parametrize("team", sorted(TEAMS))
def test_every_role_is_held_by_exactly_one_person(team):
    assert len(TEAMS[team]) == team
    assert sorted(role for roles in TEAMS[team] for role in roles) == sorted(ROLES)
    assert TEAMS[team][0][0] == "supervisor"


@pytest.mark.parametrize("name", sorted(MACHINES))
def test_every_request_that_a_machine_can_make_has_a_role(name):
    machine = MACHINES[name]()
    for node in machine.net.nodes[1:]:
        for kind in ("confirm", "manual", "decide", "data", "act"):
            assert role_of(machine, Request(1, kind, node.number)) in ROLES


def test_the_papers_division_of_labour():
    def role(kind: str, path: str) -> str:
        return role_of(DOOR, Request(1, kind, DOOR.net.by_path[path]))

    goal, plan = "Walk_to_Template/Get_Goal_from_Operator", "Walk_to_Template/Planning_Pipeline/Plan_To_Waypoint"
    assert role("data", INPUT) == "auxiliary"
    assert role("data", goal) == "primary"
    assert role("act", GRASP) == "primary"
    assert role("confirm", plan) == "auxiliary"
    assert role("confirm", GRASP) == role("decide", DECIDE) == "supervisor"


@pytest.mark.parametrize("team", sorted(TEAMS))
def test_a_template_is_given_by_the_auxiliary_operator_after_his_work(team):
    room = Room(team)
    room.asks(1.0, (1, "data", INPUT, ""))
    room.env.run(100.0)
    (sent_s, answer), *_ = room.sent
    assert answer == Answer(1, b"\x07")
    words_s = 0.55 + 0.26 * len(
        room.crew.belief.question(Request(1, "data", DOOR.net.by_path[INPUT]))
        .replace("/", " ")
        .replace("_", " ")
        .split()
    )
    assert sent_s == pytest.approx(1.0 + words_s + 60.0 + EXACT.command_s())
    assert {r.role for r in room.records} == {"auxiliary"}


def test_while_one_aligns_another_confirms_and_alone_one_waits_for_the_other():
    times = {}
    for team in (1, 3):
        room = Room(team)
        room.asks(0.0, (1, "data", INPUT, ""))
        room.asks(1.0, (1, "data", INPUT, ""), (2, "confirm", GRASP, "done"))
        room.env.run(200.0)
        times[team] = next(t for t, m in room.sent if m == Confirm(2))
    assert times[3] < 12.0
    assert times[1] > 60.0


def test_before_a_decision_the_supervisor_asks_who_sees_the_scene():
    alone, four = Room(1), Room(4)
    for room in (alone, four):
        room.asks(0.0, (1, "decide", DECIDE, "same"))
        room.env.run(60.0)
    assert not alone.acts("talk")
    talks = {(a.role, a.start_s, a.text) for a in four.acts("talk")}
    text = four.crew.belief.spoken(Request(1, "decide", DOOR.net.by_path[DECIDE]))
    assert talks == {("supervisor", 0.0, f"say: {text}"), ("immersed", 0.0, f"hear: {text}")}
    spoken_s = four.acts("talk")[0].t_s
    assert four.sent[0][0] == pytest.approx(alone.sent[0][0] + spoken_s)
    assert four.sent[0][1] == alone.sent[0][1]


def test_a_call_for_help_breaks_talk_off_and_some_of_it_is_said_again():
    calm, broken = Room(4), Room(4)
    for room in (calm, broken):
        room.asks(0.0, (1, "decide", DECIDE, "same"))
    broken.asks(1.0, (1, "decide", DECIDE, "same"), (2, "manual", GRASP, ""))
    for room in (calm, broken):
        room.env.run(120.0)
    parts = [a for a in broken.acts("talk") if a.role == "supervisor"]
    assert [a.text.startswith("interrupted: ") for a in parts] == [True, False]
    assert parts[0].t_s == 1.0
    whole_s = calm.acts("talk")[0].t_s
    # What was left, and three words again.
    assert parts[1].t_s - parts[1].start_s == pytest.approx(whole_s - 1.0 + 3 * 0.4)
    assert any(a.request == 2 for a in broken.acts("decide"))


def test_talk_about_a_request_that_is_over_ends():
    room = Room(4)
    room.asks(0.0, (1, "decide", DECIDE, "same"))
    room.asks(1.0)
    room.env.run(120.0)
    assert {a.t_s for a in room.acts("talk")} == {1.0}
    assert not room.sent


@pytest.mark.parametrize("team", sorted(TEAMS))
def test_nobody_does_two_things_at_once(team):
    room = Room(team, human=Human(curve=Curve(window_s=60.0)))
    picture = encode_image(np.zeros((8, 16), np.uint8), 16, 8, 50)
    for i in range(1, 30):
        asked = [
            (3 * i, "data", INPUT, ""),
            (3 * i + 1, "decide", DECIDE, "same"),
            (3 * i + 2, "confirm", GRASP, "done"),
        ]
        room.asks(40.0 * i, *asked)
        room.at(40.0 * i + 5.0, LogLine(float(i), "some words to read"), picture)
    room.env.run(2000.0)
    assert {r.role for r in room.records} >= {"supervisor", "auxiliary"}
    for roles in TEAMS[team]:
        acts = sorted((r.start_s, r.t_s) for r in room.records if r.role in roles)
        assert all(end <= start + 1e-9 for (_, end), (start, _) in pairwise(acts))


@pytest.mark.parametrize("team", sorted(TEAMS))
def test_the_same_arrivals_give_the_same_records(team):
    def records():
        room = Room(team, human=Human(0.1, 0.2, Curve()))
        for i in range(1, 10):
            room.asks(30.0 * i, (i, "decide", DECIDE, "same"))
        room.env.run(500.0)
        return room.records

    assert records() == records()


class Careful(Supervise):
    """Does not confirm on a view older than ten seconds."""

    def stale_s(self, _request, /) -> float:
        return 10.0


def test_a_view_that_is_too_old_is_asked_for_again_and_waited_for():
    room = Room(policy=Careful())
    picture = encode_image(np.zeros((8, 16), np.uint8), 16, 8, 50)
    room.at(0.0, picture)
    room.asks(5.0, (1, "confirm", GRASP, "done"))
    # Old enough by now. A picture that comes sooner than a round trip was taken before it was asked for.
    room.asks(30.0, (2, "confirm", GRASP, "done"))
    room.at(36.0, picture)
    room.at(40.0, picture)
    room.env.run(70.0)
    kinds = [(type(m), t) for t, m in room.sent]
    assert [k for k, _ in kinds] == [Confirm, AskView, Confirm]
    asked_s = kinds[1][1]
    assert asked_s == pytest.approx(30.0 + EXACT.command_s())
    assert kinds[2][1] == pytest.approx(40.0 + EXACT.read_image_s() + (kinds[0][1] - 5.0))


@pytest.mark.parametrize("name", sorted(MACHINES))
def test_help_of_every_machine_is_something_it_understands(name):
    machine = MACHINES[name]()
    path = next(n.path for n in machine.net.nodes[1:] if machine.outcomes_of(n.path))
    room = Room(machine=machine)
    room.asks(0.0, (1, "manual", path, ""))
    room.env.run(30.0)
    ((_, message), *_) = room.sent
    match message:
        case Force(edge=edge):
            assert machine.table[edge].state == path
        case Chat(text=text):
            waiting = room.crew.belief.waiting_state(Request(1, "manual", machine.net.by_path[path]))
            assert machine.has_edge(waiting, text)
        case other:
            assert other == Preempt()


class Seeing(Fixed):
    """Gives nothing before a picture has come."""

    def give(self, belief, request, rng) -> tuple[Message, ...]:
        return super().give(belief, request, rng) if belief.views else ()


def test_what_cannot_be_given_yet_is_given_when_a_view_has_come():
    room = Room(giver=Seeing())
    room.asks(0.0, (1, "data", INPUT, ""))
    room.env.run(100.0)
    assert room.sent == []
    room.at(10.0, encode_image(np.zeros((8, 16), np.uint8), 16, 8, 50))
    room.env.run(1000.0)
    # The work begins anew; nothing else is in the way but looking at the picture, which comes after.
    assert room.sent[0][0] == pytest.approx(110.0 + 0.55 + 5 * 0.26 + 60.0 + EXACT.command_s())
    assert room.sent[0][1] == Answer(1, b"\x07")


def test_the_stations_software_keeps_the_templates_in_step():
    room = Room(templates=StationTemplates(4.0))
    room.at(1.0, TemplateHash(room.crew.belief.machine.checksum))
    room.env.run(10.0)
    ((sent_s, message),) = room.sent
    assert sent_s == 1.0
    assert isinstance(message, TemplateSync)
