"""The operator-only workflow: what is ordered when, what follows a failure, how long it takes. Bytes in, bytes out."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
import simpy

from teleop_sim.channel.link import Direction, DirectionSettings
from teleop_sim.channel.messages import (
    OUTCOMES,
    Answer,
    AskCloud,
    CartesianTarget,
    Force,
    HandCloud,
    HandPose,
    Message,
    MirrorUpdate,
    Request,
    ResetWorld,
    StepDone,
    SyncRequest,
    TemplateInsert,
    TemplateMove,
    TemplateStep,
    VoxelCloud,
    Withdrawn,
    decode_payload,
    encode_hand,
    encode_message,
    encode_voxels,
)
from teleop_sim.channel.template_ends import FieldTemplates, StationTemplates
from teleop_sim.core.records import Judged, Layer, OperatorActed, Record
from teleop_sim.machines.drc import door_machine
from teleop_sim.machines.mirror import Mirror
from teleop_sim.machines.operator_only import OPERATE, operator_only
from teleop_sim.operators.acts import Briefing
from teleop_sim.operators.alignment import alignment_s, load_alignment
from teleop_sim.operators.clouds import Region
from teleop_sim.operators.collaborate import Collaborate
from teleop_sim.operators.crew import Crew
from teleop_sim.operators.handling import handling
from teleop_sim.operators.layer_figures import layer_elements, load_layer
from teleop_sim.operators.template_giver import SELECTED_OBJECT, TemplateGiver
from teleop_sim.operators.template_layer import TemplateLayer
from teleop_sim.operators.timing import load_timing
from teleop_sim.templates.library import library
from teleop_sim.templates.poses import Pose, gap
from teleop_sim.templates.shapes import bounds

EXACT = replace(load_timing(), spread=0.0)
TRUTH = {"door": Pose((0.75, 0.3, 1.0), (0.0, 0.0, 0.05)), "DRC_valve": Pose((0.8, 0.3, 1.0), (0.2, 0.0, 0.0))}
MOTION_S = 8.0
AMOUNTS = {("door", 0): 0.96, ("door", 2): 0.3, ("DRC_valve", 1): 7.2}
WELL = {"pregrasp": "reached", "open": "opened", "grasp": "reached", "close": "closed", "affordance": "reached"}


def voxels(template, pose, voxel_m, seed=0):
    rng = np.random.default_rng(seed)
    low, high = bounds(template.shapes)
    points = rng.uniform(low - 0.03, high + 0.03, (9000, 3))
    points[:, 1] = np.clip(points[:, 1], -0.4, None)
    distance, normal = template.signed(points)
    placed = pose.place(points - distance[:, None] * normal)
    return encode_voxels(placed[np.linalg.norm(placed - np.array(pose.position_m), axis=1) < 0.5], voxel_m)


def hand_cloud(hand, off_m, voxel_m):
    """A hand of 10 cm, and where the robot's joints have it."""
    points = np.array(hand.position_m) + np.random.default_rng(0).uniform(-0.05, 0.05, (2000, 3))
    told = encode_hand(hand.side, points + off_m, points[None], voxel_m)
    assert told is not None
    return told


@dataclass
class Far:
    """The far end of a link with a thing before it. Steps end as ``script`` says, else well; hands go where told.

    Clouds show everything so far off as ``off_m`` says, the hand, too, unless its own cloud is ``lost``.
    """

    thing: str = "door"
    delay_s: float = 0.5
    script: list[tuple[str, str, float]] = field(default_factory=list)
    seed: int = 1
    team: int = 1
    limit_s: float = 3000.0
    machine: object = None
    moves: bool = True
    ask: tuple[Request, ...] = ()
    off_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    lost: bool = True
    env: simpy.Environment = field(default_factory=simpy.Environment)
    records: list[Record] = field(default_factory=list)
    came: list[tuple[float, Message]] = field(default_factory=list)

    def __post_init__(self) -> None:
        env, note = self.env, self.records.append
        self.template, self.truth = library().named(self.thing), TRUTH[self.thing]
        self.hand = HandPose("left", (0.5, 0.2, 0.9), (0.0, 0.0, 0.0))
        self.templates = FieldTemplates()
        machine = self.machine or operator_only()
        self.net = machine
        up = Direction(env, "up", DirectionSettings(1e9, self.delay_s, 0), self._obey, note)
        self.down = Direction(env, "down", DirectionSettings(1e9, self.delay_s, 0), self._deliver, note)
        briefing = Briefing(2.0 * self.delay_s, 1e9, in_reach=True)
        station = StationTemplates(briefing.round_trip_s)
        x, y, z = self.truth.position_m
        giver = TemplateGiver(station, self.template, (0.0, 0.0, 1.6), region=Region((x, y, z)))
        self.layer = TemplateLayer(giver, EXACT)
        rng = np.random.default_rng(self.seed)
        self.crew = Crew(
            env, Mirror(machine, 2), up.send, EXACT, rng, note, briefing, Collaborate(), self.team,
            givers={SELECTED_OBJECT: giver}, templates=station, hands=self.layer,
        )  # fmt: skip
        self.prepare()
        for request in self.ask or (Request(1, "act", machine.net.by_path[OPERATE]),):
            self.tell(request)
        env.process(self.crew.run())
        env.run(self.limit_s)

    def prepare(self) -> None:
        """Before anything arrives."""

    def _deliver(self, payload: bytes) -> None:
        self.crew.receive(payload)

    def tell(self, message: Message) -> None:
        self.down.send(*encode_message(message))

    def _obey(self, payload: bytes) -> None:
        message = decode_payload(payload)
        self.came.append((float(self.env.now), message))
        match message:
            case AskCloud(voxel_mm=voxel_mm):
                if not self.lost:
                    self.tell(hand_cloud(self.hand, self.off_m, voxel_mm / 1000))
                seen = replace(self.truth, position_m=tuple(np.add(self.truth.position_m, self.off_m).tolist()))
                self.tell(voxels(self.template, seen, voxel_mm / 1000))
            case TemplateInsert() | TemplateMove():
                self.templates.receive(message)
            case TemplateStep():
                self.env.process(self._step(message))
            case CartesianTarget(side, position, rotation):
                self.env.process(self._move(HandPose(side, position, rotation)))
            case Force(edge=edge):
                self.tell(MirrorUpdate(edge))
            case Answer(request=request):
                self.tell(Withdrawn(request))

    def _step(self, order):
        yield self.env.timeout(MOTION_S)
        outcome, amount = WELL[order.step], 0.0
        if order.step == "affordance":
            amount = AMOUNTS[(self.thing, order.which)]
        if self.script and self.script[0][0] == order.step:
            _, outcome, amount = self.script.pop(0)
        if outcome in WELL.values() and order.step in ("pregrasp", "grasp"):
            (lying,) = self.templates.server.placed
            place = np.array(handling(self.thing).place(lying.pose, self.hand.position_m))
            x, y, z = place - (0.1 if order.step == "pregrasp" else 0.0) * lying.pose.matrix[:, 0]
            self.hand = HandPose("left", (float(x), float(y), float(z)), (0.0, 0.0, 0.0))
        self.tell(StepDone(order.step, outcome, amount))
        self.tell(self.hand)

    def _move(self, hand):
        yield self.env.timeout(2.0)
        if self.moves:
            self.hand = hand
        self.tell(self.hand)

    def ordered(self) -> list[str]:
        """What was ordered, in short."""
        names = {TemplateInsert: "insert", TemplateMove: "move", AskCloud: "cloud", CartesianTarget: "hand"}
        out = []
        for _, m in self.came:
            match m:
                case TemplateStep(step="affordance", which=which):
                    out.append(next(a.name for a in self.template.affordances if a.id == which))
                case TemplateStep(step=step):
                    out.append(step)
                case Force(edge=edge):
                    out.append(self.net.table[edge].event)
                case SyncRequest():
                    pass
                case _:
                    out.append(names.get(type(m), m.topic))
        return out

    def layers(self) -> dict[str, float]:
        """Seconds of work at each layer."""
        out: dict[str, float] = {}
        for r in self.records:
            if isinstance(r, Layer):
                out[r.layer] = out.get(r.layer, 0.0) + r.t_s - r.start_s
        return out


def test_a_door_is_opened_as_in_the_paper():
    far = Far()
    # Romay et al., 6.2.1.
    assert far.ordered() == [
        "cloud", "insert", "pregrasp", "open", "grasp", "cloud", "close", "turnCW", "push", "done",
    ]  # fmt: skip
    (lying,) = far.templates.server.placed
    assert gap(lying.pose, far.truth)[0] < 0.02


def test_a_valve_is_turned_as_in_the_paper():
    assert Far("DRC_valve").ordered() == ["cloud", "insert", "pregrasp", "grasp", "cloud", "open", "done"]


@pytest.mark.parametrize("thing", ["door", "DRC_valve"])
def test_work_takes_the_sum_of_its_elements(thing):
    far, pieces, goals = Far(thing), layer_elements(EXACT, load_layer()), handling(thing).goals
    orders = sum(not g.startswith("preview") and g not in ("align", "stand") for g in goals)
    want = 2.0 * pieces["preview"] + orders * (pieces["order"] + pieces["judge"])
    spent = far.layers()
    # Times on a clock of some hundred seconds: rounding.
    assert spent["template"] == pytest.approx(want, abs=1e-6)
    assert spent["alignment"] == pytest.approx(alignment_s(EXACT, load_alignment(), 0.02), abs=1e-6)
    assert "teleoperation" not in spent


def test_deliberation_multiplies_template_commands_and_nothing_else():
    figures = load_layer()
    twice = layer_elements(EXACT, replace(figures, deliberation=2.0 * figures.deliberation))
    assert twice == pytest.approx({k: 2.0 * v for k, v in layer_elements(EXACT, figures).items()})


def test_each_order_costs_a_round_trip():
    near, far = Far(delay_s=0.1), Far(delay_s=2.1)
    assert near.ordered() == far.ordered()
    # Two clouds, six orders: each waits for what comes of it. Then what the person says travels once; the request did.
    slower_s = far.came[-1][0] - near.came[-1][0]
    assert slower_s == pytest.approx(2.0 * (2 * 8 + 2), abs=1e-4)


def test_a_lever_that_was_not_turned_enough_is_turned_again():
    far = Far(script=[("affordance", "reached", 0.5)])
    assert far.ordered() == [
        "cloud", "insert", "pregrasp", "open", "grasp", "cloud", "close", "turnCW", "turnCW", "push", "done",
    ]  # fmt: skip


def test_a_wheel_takes_as_many_goes_as_bring_something():
    far = Far("DRC_valve", script=[("affordance", "force_limit", 2.0), ("affordance", "reached", 3.0)])
    assert far.ordered() == ["cloud", "insert", "pregrasp", "grasp", "cloud", "open", "open", "open", "done"]
    amounts = [m.amount for _, m in far.came if isinstance(m, TemplateStep) and m.step == "affordance"]
    # Quarter turns, as sent to a thousandth.
    assert amounts == pytest.approx([math.pi / 2] * 3, abs=5e-4)


def test_a_blocked_grasp_is_tried_again_with_the_template_laid_anew():
    far = Far(script=[("grasp", "blocked", 0.0)])
    assert far.ordered() == [
        "cloud", "insert", "pregrasp", "open", "grasp", "cloud", "cloud", "move", "pregrasp", "open", "grasp", "close",
        "turnCW", "push", "done",
    ]  # fmt: skip


def test_after_two_failures_the_hand_is_moved_by_eye_and_the_workflow_goes_on():
    far = Far(script=[("grasp", "blocked", 0.0), ("grasp", "blocked", 0.0)])
    done = far.ordered()
    assert done.count("hand") >= 1
    assert done[done.index("hand") - 2 : done.index("hand")] == ["cloud", "move"]
    assert done[-4:] == ["close", "turnCW", "push", "done"]
    # The cloud for it is finer.
    asked = [m.voxel_mm for _, m in far.came if isinstance(m, AskCloud)]
    assert asked == [20, 20, 20, 10]
    assert far.layers()["teleoperation"] > 0.0


def test_a_lost_grip_is_taken_anew():
    far = Far(script=[("affordance", "grip_lost", 0.2)])
    assert far.ordered() == [
        "cloud", "insert", "pregrasp", "open", "grasp", "cloud", "close", "turnCW", "cloud", "move", "pregrasp", "open",
        "grasp", "close", "turnCW", "push", "done",
    ]  # fmt: skip


def test_no_way_twice_makes_people_doubt_the_world_model():
    far = Far(script=[("pregrasp", "no_plan", 0.0), ("pregrasp", "no_plan", 0.0)])
    done = far.ordered()
    assert any(isinstance(m, ResetWorld) for _, m in far.came)
    assert done[-1] == "done"


def test_who_gets_nowhere_gives_up():
    far = Far(script=[("pregrasp", "blocked", 0.0)] * 50, moves=False, limit_s=6000.0)
    done = far.ordered()
    assert done[-1] == "failed"
    # Two orders and three movements that bring nothing, as often as a person begins anew.
    rounds = load_layer().rounds
    assert (done.count("pregrasp"), done.count("hand")) == (2 * rounds, 3 * rounds)


def test_who_is_asked_for_a_template_gets_a_cloud_first():
    door = door_machine("atlas")
    request = Request(1, "data", door.net.by_path["Get_Door_Template_ID"])
    far = Far(machine=door, ask=(request,), limit_s=200.0)
    assert far.ordered() == ["cloud", "insert", "answer"]
    (answer,) = (m for _, m in far.came if isinstance(m, Answer))
    assert answer.data == bytes([far.templates.server.placed[0].instance])
    assert far.layers()["alignment"] > 30.0


def test_four_people_hand_over_by_talk():
    far = Far(team=4)
    talks = [r.text for r in far.records if isinstance(r, OperatorActed) and r.kind == "talk"]
    assert "say: act Operate" in talks
    assert "say: done act Operate" in talks
    assert {r.role for r in far.records if isinstance(r, OperatorActed) and "step:" in r.text} == {"primary"}


# Checks for somebody who is asked ------------------------------------------------------------------------------------

DOOR = door_machine("atlas")
PROMPT = "Open_Door/Optional_Template_Adjustment"


@dataclass
class Shifted(Far):
    """A door whose template was laid before the robot walked, and now lies so far beside it."""

    moved_m: float = 0.0

    def __post_init__(self) -> None:
        self.machine, self.limit_s = DOOR, 300.0
        node = DOOR.net.by_path[PROMPT]
        self.ask = (Request(1, "confirm", node, DOOR.edge_index(PROMPT, "done")),)
        super().__post_init__()

    def prepare(self) -> None:
        """Before anything arrives: the template lies, and the machine has walked since."""
        work, giver = self.crew.belief.work, self.layer.giver
        x, y, z = self.truth.position_m
        lies = replace(self.truth, position_m=(x, y + self.moved_m, z))
        self.templates.receive(giver.station.insert(self.template.type_id, lies, 0.0))
        work.note_laid(0)
        work.walks = (2,)


@pytest.mark.parametrize("team", [1, 3])
def test_a_template_that_lies_off_after_a_walk_is_laid_anew_before_the_arm_moves(team):
    for moved_m, done in ((0.06, ["cloud", "move", "confirm"]), (0.0, ["cloud", "confirm"])):
        far = Shifted(moved_m=moved_m, team=team)
        # Who confirms repeats it: nothing here takes the outcome.
        assert far.ordered()[: len(done)] == done
        (judged,) = (r for r in far.records if isinstance(r, Judged))
        assert (judged.what, judged.verdict) == ("template", "rejected" if moved_m else "accepted")
        (lying,) = far.templates.server.placed
        assert gap(lying.pose, far.truth)[0] < 0.025
        if team == 3:
            assert {r.role for r in far.records if isinstance(r, OperatorActed) and "cloud" in r.text} == {"auxiliary"}


def test_nothing_is_looked_at_again_if_nothing_can_have_changed():
    far = Shifted(moved_m=0.0)
    request = far.ask[0]
    far.crew.belief.work.note_laid(len(far.crew.belief.visited))
    assert far.layer.check(far.crew.belief, request) == ""
    far.crew.belief.take(StepDone("grasp", "blocked"), 1.0)
    assert far.layer.check(far.crew.belief, request) == "template"


# What a cloud shows of the hand --------------------------------------------------------------------------------------

OFF_M = (-0.02, 0.04, 0.02)


def off_at_the_end(far):
    (lying,) = far.templates.server.placed
    return np.subtract(lying.pose.position_m, far.truth.position_m)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_who_sees_the_hand_beside_the_handle_moves_the_template_and_takes_the_hand_there_anew(seed):
    far = Far(off_m=OFF_M, lost=False, seed=seed)
    assert far.ordered() == [
        "cloud", "insert", "pregrasp", "open", "grasp", "cloud", "move", "pregrasp", "open", "grasp", "close", "turnCW",
        "push", "done",
    ]  # fmt: skip
    (judged,) = (r for r in far.records if isinstance(r, Judged))
    assert (judged.what, judged.verdict) == ("hand", "rejected")
    # Offset over what the eye can tell and what the middle of the hand's voxels tells, in voxels of 2 cm.
    n = len(hand_cloud(far.hand, OFF_M, 0.02).voxels.centres_m())
    assert judged.sigma_px == pytest.approx(math.hypot(0.2, 0.1, 1.0 / math.sqrt(n)), rel=0.05)
    assert judged.offset_px == pytest.approx(np.linalg.norm(OFF_M) / 0.02, abs=0.3)
    # Two times a person's 4.5 mm in each of three directions: four standard deviations.
    assert np.linalg.norm(off_at_the_end(far)) < 4.0 * 0.0045 * math.sqrt(2)


def test_what_was_learnt_at_the_hand_is_taken_off_every_later_laying():
    far = Far(off_m=OFF_M, lost=False, script=[("affordance", "grip_lost", 0.2)])
    assert far.ordered().count("move") == 2
    assert np.linalg.norm(off_at_the_end(far)) < 4.0 * 0.0045 * math.sqrt(2)
    assert far.crew.belief.work.sensor_off_m == pytest.approx(OFF_M, abs=4.0 * 0.0045)


def test_a_hand_that_is_seen_where_it_should_be_is_left_there():
    far = Far(lost=False)
    assert "move" not in far.ordered()
    assert far.crew.belief.work.sensor_off_m == (0.0, 0.0, 0.0)
    (judged,) = (r for r in far.records if isinstance(r, Judged))
    assert judged.verdict == "accepted"


def test_who_never_gets_a_cloud_of_the_hand_goes_by_its_joints():
    far = Far(off_m=OFF_M)
    # The joints say that the hand is where the template is: nobody can know better.
    assert "move" not in far.ordered()
    assert np.linalg.norm(off_at_the_end(far) - OFF_M) < 0.025


# Nothing but what arrives --------------------------------------------------------------------------------------------


def noise_like(payload: bytes, rng: np.random.Generator) -> bytes:
    """A message of the same kind and size that says something at random."""
    match decode_payload(payload):
        case StepDone(step=step):
            made: Message = StepDone(step, OUTCOMES[int(rng.integers(8))], float(rng.uniform(0.0, 1.0)))
        case HandPose(side=side):
            x, y, z = (float(v) for v in rng.uniform(0.2, 1.0, 3))
            made = HandPose(side, (x, y, z), (0.0, 0.0, 0.0))
        case HandCloud() as hand:
            x, y, z = (v + float(d) for v, d in zip(hand.expected_m, rng.uniform(-0.1, 0.1, 3), strict=True))
            made = replace(hand, expected_m=(x, y, z))
        case VoxelCloud() as cloud:
            # What a template could be laid on, somewhere.
            shift = tuple(int(v) for v in rng.integers(-3, 4, 3))
            made = replace(cloud, origin=tuple(a + b for a, b in zip(cloud.origin, shift, strict=True)))
        case _:
            return payload
    assert len(made.encode()) == len(payload)
    return made.encode()


@dataclass
class Noisy(Far):
    """A far end whose words are lost: what is heard is given."""

    instead: tuple[tuple[float, bytes], ...] | None = None
    heard: list[tuple[float, bytes]] = field(default_factory=list)

    def prepare(self) -> None:
        if self.instead is not None:
            self.env.process(self._replay(self.instead))

    def _deliver(self, payload: bytes) -> None:
        self.heard.append((float(self.env.now), payload))
        if self.instead is None:
            super()._deliver(payload)

    def _replay(self, arrivals):
        for t_s, payload in arrivals:
            yield self.env.timeout(t_s - self.env.now)
            self.crew.receive(payload)

    def behaviour(self) -> list[object]:
        return [r for r in self.records if isinstance(r, OperatorActed | Layer | Judged)]


@pytest.mark.parametrize("team", [1, 4])
def test_the_crew_knows_nothing_but_what_arrives(team):
    rng = np.random.default_rng(3)
    script = [("grasp", "blocked", 0.0), ("grasp", "blocked", 0.0)]
    true = Noisy(script=list(script), team=team, limit_s=900.0, lost=False)
    noise = tuple((t_s, noise_like(payload, rng)) for t_s, payload in true.heard)
    here = Noisy(team=team, limit_s=900.0, instead=noise, lost=False)
    elsewhere = Noisy(script=[("pregrasp", "no_plan", 0.0)] * 9, moves=False, team=team, limit_s=900.0, instead=noise)
    assert any(isinstance(decode_payload(payload), HandCloud) for _, payload in noise)
    assert here.behaviour() == elsewhere.behaviour()
    assert here.heard != elsewhere.heard
    assert true.behaviour() != elsewhere.behaviour()
