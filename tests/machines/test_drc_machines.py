"""ViGIR's door and valve machines with their programs, on a clock, the robot's replies given by hand."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
import simpy

from teleop_sim.core.errors import UnknownName
from teleop_sim.core.records import Requested, TransitionTaken
from teleop_sim.machines.drc import HANDLE, door_machine, valve_machine
from teleop_sim.machines.elements import Autonomy, State
from teleop_sim.machines.executive import Executive, Signal, Start
from teleop_sim.machines.operator_only import OPERATE, operator_only
from teleop_sim.machines.vigir import read_behaviour
from teleop_sim.robot.commands import Act, Fingers, Grasp, LetGo, PreGrasp, Walk
from teleop_sim.robot.commands import Step as Stride
from teleop_sim.robot.programs.pacing import pacing
from teleop_sim.robot.programs.steps import AskData, Memory, Reply, Say, Stepped, Wait
from teleop_sim.robot.programs.vigir import vigir_programs
from teleop_sim.robot.skills.act import ActReport
from teleop_sim.templates.library import library
from teleop_sim.templates.poses import Pose
from teleop_sim.templates.server import Server

PLACE = Pose((0.72, 0.30, 1.016))
ROBOTS = ("atlas", "thormang3")
ENDS = {PreGrasp: "reached", Grasp: "reached", LetGo: "released"}

Robot = Callable[[Any], Reply]


def good(command: Any) -> Reply:
    """All goes as asked."""
    outcome = ENDS.get(type(command), "reached")
    data = None
    if isinstance(command, Fingers):
        outcome = "closed" if command.close else "opened"
    if isinstance(command, Act):
        data = ActReport(command.amount, command.amount, 10.0, 5.0, 0.0, "arm")
    return Reply(outcome, "as told", data, 1.0)


class Run:
    """A machine, its programs, a robot that replies, and people who choose by a table of states."""

    def __init__(self, machine, robot_name, choices, level, robot=good, template="door", place=PLACE):
        self.env, self.robot = simpy.Environment(), robot
        self.choices = {state: list(c) if isinstance(c, list) else [c] for state, c in choices.items()}
        server, _ = Server("station").insert(library().named(template).type_id, place)
        facts = {"templates": lambda: server.placed, "pose": (0.0, 0.0, 0.0)}
        self.memory = Memory(facts)
        self.programs = vigir_programs(pacing("eager"), robot_name)
        self.records, self.commands, self.said, self.stepped, self.asked = [], [], [], [], []
        self.executive = Executive(self.env, machine, level, self._start, self, self.records.append)

    def _start(self, start: Start):
        return self.env.process(self._program(start))

    def _program(self, start: Start):
        visit = Memory(self.memory.facts, start.reads, start.parameters, path=start.path)
        program, answer = self.programs[start.program](visit), None
        while True:
            try:
                step = program.send(answer)
            except StopIteration as end:
                return Signal(end.value, "", visit.writes)
            answer = yield from self._step(step, start)

    def _step(self, step, start):
        match step:
            case Wait(seconds=seconds):
                yield self.env.timeout(seconds)
            case AskData():
                return (yield start.ask(step.what))
            case Say(text=text):
                self.said.append(text)
            case Stepped():
                self.stepped.append((step.step, step.outcome, step.amount))
            case command:
                self.commands.append(command)
                reply = self.robot(command)
                yield self.env.timeout(reply.duration_s)
                return reply
        return None

    # The voice, and the people at its other end

    def request(self, request, kind, node, _edge):
        path = self.executive.machine.net.nodes[node].path
        self.asked.append((kind, path))
        self.env.process(self._answer(request, kind, path))

    def _answer(self, request, kind, path):
        yield self.env.timeout(2.0)
        wanted = self.choices.get(path.rpartition("/")[2], [None])
        chosen = wanted.pop(0) if len(wanted) > 1 else wanted[0]
        if kind == "data":
            self.executive.answer(request, b"" if "Plan" in path else b"\x00")
        elif kind == "confirm" or chosen is None:
            self.executive.confirm(request)
        else:
            self.executive.force(chosen, path)

    def __getattr__(self, name: str):
        return lambda *_: None

    def run(self, until_s=3000.0):
        done = self.env.process(self.executive.run())
        self.env.run(simpy.AnyOf(self.env, [done, self.env.timeout(until_s)]))
        return done.value if done.triggered else None

    def taken(self):
        return [(r.state, r.event) for r in self.records if isinstance(r, TransitionTaken)]

    def kinds(self, *wanted):
        return [c for c in self.commands if isinstance(c, wanted)]


DOOR_ATLAS = {"Decide_Push_Turn": ["push", "skip"], "Decide_Push_or_Not": "skip", "Confirm_Plan": "ready"}
DOOR_THOR = {"Decide_Walking": "stand", "Ask_for_Retry": "release_handle"}
VALVE_ATLAS = {"Decide_Walking": "skip"}
VALVE_THOR = {
    "Adjust_Hand_Rotation": "done",
    "Decide_Turn_Again": ["turn", "turn", "extract"],
    "Decide_Repeat": "continue",
    "Decide_Step_Back": "stand",
}


@pytest.mark.parametrize("level", [Autonomy.HIGH, Autonomy.FULL])
@pytest.mark.parametrize("robot", ROBOTS)
def test_a_door_is_opened_and_the_lever_let_up_before_the_hand_lets_go(robot, level):
    run = Run(door_machine(robot), robot, DOOR_ATLAS if robot == "atlas" else DOOR_THOR, level)
    result = run.run()
    assert result is not None
    assert result.outcome == "completed", (result, run.taken()[-3:])
    turned = [c.amount for c in run.kinds(Act)]
    down, push, up = turned[0], turned[1], turned[2]
    assert down == pytest.approx(math.radians(55.0))
    assert push == pytest.approx(math.radians(20.0 if robot == "atlas" else 16.0))
    assert up == pytest.approx(-down)
    order = [type(c).__name__ for c in run.commands]
    assert order.index("PreGrasp") < order.index("Grasp") < order.index("Act") < order.index("LetGo")
    assert any(isinstance(c, Fingers) and c.close for c in run.commands[: order.index("Act")])


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_valve_is_turned(robot):
    choices = VALVE_ATLAS if robot == "atlas" else VALVE_THOR
    whole = valve_machine(robot)
    run = Run(whole, robot, choices, Autonomy.HIGH, template="DRC_valve", place=Pose((0.80, 0.30, 1.016)))
    result = run.run()
    assert result is not None
    assert result.outcome == "completed", (result, run.taken()[-3:])
    turned = [c.amount for c in run.kinds(Act)]
    degrees = [round(math.degrees(a)) for a in turned]
    assert degrees == ([400] if robot == "atlas" else [25, 200, 200]), "as the behaviours' functions say"
    assert all(c.shut for c in run.kinds(PreGrasp, Grasp))
    assert not run.kinds(Walk), "it stands there already"


@pytest.mark.parametrize(
    ("machine", "robot", "choices", "template", "asked"),
    [
        (door_machine, "atlas", DOOR_ATLAS, "door", (1, 3, 6)),
        (door_machine, "thormang3", DOOR_THOR, "door", (1, 13, 6)),
        (valve_machine, "atlas", VALVE_ATLAS, "DRC_valve", (1, 6, 3)),
        (valve_machine, "thormang3", VALVE_THOR, "DRC_valve", (1, 3, 6)),
    ],
)
def test_so_often_people_are_asked_at_level_high(machine, robot, choices, template, asked):
    run = Run(machine(robot), robot, choices, Autonomy.HIGH, template=template)
    run.run()
    kinds = [kind for kind, _ in run.asked]
    assert tuple(kinds.count(kind) for kind in ("data", "confirm", "decide")) == asked


def test_a_lab_robot_is_asked_for_no_look_at_footsteps_that_are_not_needed():
    run = Run(door_machine("atlas"), "atlas", DOOR_ATLAS, Autonomy.HIGH)
    run.run()
    assert [path for kind, path in run.asked if kind == "data"] == ["Get_Door_Template_ID"]
    assert not run.kinds(Walk)
    far = Run(door_machine("atlas"), "atlas", DOOR_ATLAS, Autonomy.HIGH, place=Pose((2.72, 0.30, 1.016)))
    far.run()
    assert [path for kind, path in far.asked if kind == "data"][1] == "Walk_to_Template/Planning_Pipeline/Modify_Plan"
    assert far.kinds(Walk)[0].path == ((pytest.approx(2.0), pytest.approx(0.0), pytest.approx(0.0)),)


def test_what_stands_in_the_way_fails_the_motion_and_a_person_chooses_to_try_again():
    tries = []

    def robot(command):
        if isinstance(command, PreGrasp):
            tries.append(command.obstacles)
            if len(tries) < 3:
                return Reply("no_plan", "left_wrist would touch something known of", None, 0.5)
        return good(command)

    run = Run(door_machine("atlas"), "atlas", {**DOOR_ATLAS, "Decide_Which_Pregrasp": "same"}, Autonomy.HIGH, robot)
    run.memory.facts["world"] = ((0.4, 0.3, 1.0),)
    assert run.run().outcome == "completed"
    assert tries == [((0.4, 0.3, 1.0),)] * 3
    assert [s for s in run.stepped if s[1] == "no_plan"] == [("pregrasp", "no_plan", 0.0)] * 2
    asked = [path.rpartition("/")[2] for _, path in run.asked]
    assert asked.count("Decide_Which_Pregrasp") == 2, "the decision is the state's suggestion, asked at High"


def test_a_planner_that_does_not_answer_fails_the_planning_states():
    run = Run(door_machine("atlas"), "atlas", {**DOOR_ATLAS, "Decide_Which_Pregrasp": "same"}, Autonomy.HIGH)
    answers = iter([True, False, False] + [True] * 100)
    run.memory.facts["onboard"] = lambda: next(answers)
    assert run.run().outcome == "completed"
    failed = [state for state, event in run.taken() if event == "failed"]
    assert failed == ["Open_Door/Go_to_Pregrasp/Plan_To_Pregrasp_Pose"] * 2


def test_settings_are_all_that_is_changed():
    for made, behaviour in ((door_machine, "open_door"), (valve_machine, "turn_valve")):
        for robot, name in zip(ROBOTS, ("atlas", "thor"), strict=True):
            ours, published = made(robot), read_behaviour(f"{behaviour}_{name}")
            assert (ours.table, ours.state_names) == (published.table, published.state_names)
            changed = [path for path in ours.state_names if ours.leaf(path) != published.leaf(path)]
            assert changed == ([HANDLE] if (behaviour, name) == ("open_door", "atlas") else [])
            assert {p.name: p.default for p in ours.parameters}["hand_side"] == "left"


def test_a_machine_with_nothing_to_set_is_the_published_one():
    assert valve_machine("atlas").checksum == read_behaviour("turn_valve_atlas").checksum
    assert door_machine("thormang3").checksum == read_behaviour("open_door_thor").checksum


def test_every_class_of_the_four_machines_has_a_program():
    programs = vigir_programs(pacing("eager"), "atlas")
    for made in (door_machine, valve_machine):
        for robot in ROBOTS:
            whole = made(robot)
            named = {n.element.program for n in whole.net.nodes if isinstance(n.element, State) and n.element.program}
            assert named <= set(programs)


def test_robots_nobody_has_a_behaviour_for_are_refused():
    assert door_machine("atlas+claw").name == "vigir_open_door_atlas"
    with pytest.raises(UnknownName, match="thormang3"):
        valve_machine("valkyrie")


@pytest.mark.parametrize("level", Autonomy)
@pytest.mark.parametrize(("event", "status"), [("done", "completed"), ("failed", "failed")])
def test_without_a_behaviour_everything_is_in_a_persons_hands_from_the_start(level, event, status):
    run = Run(operator_only(), "atlas", {OPERATE: event}, level)
    result = run.run()
    assert run.asked == [("act", OPERATE)]
    assert [(r.kind, r.event) for r in run.records if isinstance(r, Requested)] == [("act", "")]
    assert result.outcome == status
    assert run.executive.mode == "manual"


def test_a_step_back_is_a_stride():
    run = Run(valve_machine("atlas"), "atlas", VALVE_ATLAS, Autonomy.HIGH, template="DRC_valve")
    run.run()
    assert run.kinds(Stride)[-1] == Stride(forward_m=-0.3)
