"""What every entry of every registry promises. New entries are found by themselves.

Registries with a contract test of their own: ``MESSAGES`` (tests/channel), ``RECORDS`` (tests/core, tests/log), error
classes (tests/core).
"""

import pkgutil
from functools import cache, partial
from pathlib import Path
from typing import get_args

import mujoco
import numpy as np
import pytest

import teleop_sim.channel
from teleop_sim.channel.message import MESSAGES, Counts, Message, Number, Sized
from teleop_sim.channel.messages import Request, decode_message, encode_message
from teleop_sim.channel.picture_messages import Picture
from teleop_sim.channel.template_messages import Entries, Placed
from teleop_sim.core.errors import BadInput
from teleop_sim.core.streams import stream
from teleop_sim.machines.mirror import Mirror
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.registry import POLICIES
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Command, Look
from teleop_sim.robot.episode import NoiseKey, perform
from teleop_sim.robot.kinematics import SIDES, kinematics_of
from teleop_sim.robot.programs.pacing import pacing
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.skills import SKILLS
from teleop_sim.scenarios import names
from teleop_sim.scenarios.files import list_scenarios, load_scenario, read_scenario, scenario_to_toml
from teleop_sim.scenarios.objects import TASKS, autonomy_level, machine_of, operator_policy, operator_timing
from teleop_sim.scenarios.robots import robot_spec
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import Plant

ROOT = Path(__file__).parents[1]
FILES = [*list_scenarios(), *sorted(str(p.relative_to(ROOT)) for p in (ROOT / "examples").glob("*.toml"))]


def model_bytes(plant: Plant) -> bytes:
    buffer = np.empty(mujoco.mj_sizeModel(plant.model), np.uint8)
    mujoco.mj_saveModel(plant.model, None, buffer)
    return buffer.tobytes()


TEXT = """
schema = 1
[link.up]
rate_bps = 9600.0
delay_s = 0.0
[link.down]
rate_bps = 9600.0
delay_s = 0.0
"""


@cache
def scenario(task: str, robot: str, layer: str = "behaviour"):
    """A scenario with nothing but defaults; None if the task is not for this robot."""
    hand = {"hand": "claw"} if task.startswith("drc-") else {}
    policy = {"operator.policy": "collaborate"} if hand else {}
    chosen = {"task": task, "robot": robot, "layer": layer, **hand, **policy}
    try:
        return read_scenario(TEXT, "contract", "contract", overrides=chosen)
    except BadInput:
        return None


CASES = [(task, robot, layer) for task in TASKS for robot in ROBOTS for layer in names.LAYERS]
CASES = [case for case in CASES if scenario(*case) is not None]


def draw(task: str, robot: str, seed: int) -> tuple[Plant, object]:
    site = TASKS[task].site(scenario(task, robot), partial(stream, seed, 0))
    plant = Plant(robot_spec(scenario(task, robot)).model, site.scenery)
    return plant, site.score(plant.joint_names)


def test_what_a_scenario_may_name_is_what_there_is():
    assert list(names.ROBOTS) == list(ROBOTS)
    assert list(names.TASKS) == list(TASKS)
    assert list(names.POLICIES) == list(POLICIES)


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_every_robot_is_whole(name):
    spec = ROBOTS[name]()
    description = spec.model.description
    joints, links = {j.name for j in description.joints}, {link.name for link in description.links}
    assert description.name == name
    named = {*spec.torso, *spec.neck, *spec.head_pitch, *(n for leg in spec.legs for n in leg)}
    named |= {spec.head_yaw} if spec.head_yaw is not None else set()
    named |= {n for side in SIDES for n in spec.arms[side]} | {n for p in spec.postures.values() for n in p}
    assert named <= joints
    assert "walk" in spec.postures
    assert set(spec.model.servos) >= joints
    assert {shape.link for shape in spec.model.shapes} <= links
    assert {spec.camera_frame, spec.lidar_frame} <= {f.name for f in description.frames}
    assert [len(leg) for leg in spec.legs] == [6, 6]
    assert set(kinematics_of(name).joint_names) >= named


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_every_robot_stands_while_it_looks_round(name):
    spec = ROBOTS[name]()
    body = Body(spec, Plant(spec.model, BareFloor()))
    episode = perform(body, Look(0.2, 0.1, duration_s=0.5), body.standing(), NoiseKey(1, 0, 1))
    assert episode.outcome == "reached"
    assert not episode.end.fallen


def test_every_task_has_a_robot_and_a_layer():
    assert {task for task, _, _ in CASES} == set(TASKS)


@pytest.mark.parametrize("preset", sorted(names.PACINGS))
@pytest.mark.parametrize(("task", "robot", "layer"), CASES)
def test_every_task_has_a_program_for_each_state_that_acts(task, robot, layer, preset):
    machine = machine_of(scenario(task, robot, layer))
    programs = TASKS[task].programs(pacing(preset), robot)
    assert set(programs) >= {machine.leaf(path).program for path in machine.state_names} - {""}
    assert machine.start in machine.state_names or machine.start in {e.name for e in machine.states}


@pytest.mark.parametrize("task", sorted(TASKS))
def test_every_program_of_a_task_runs_in_some_machine(task):
    machines = [machine_of(scenario(*case)) for case in CASES if case[0] == task]
    robot = next(robot for name, robot, _ in CASES if name == task)
    wanted = {machine.leaf(path).program for machine in machines for path in machine.state_names}
    # The programs of the published behaviours are those of all tasks at once.
    shared = {machine_of(scenario(*case)) for case in CASES if case[0].startswith("drc-") and task.startswith("drc-")}
    wanted |= {machine.leaf(path).program for machine in shared for path in machine.state_names}
    assert set(TASKS[task].programs(pacing("eager"), robot)) <= wanted


@pytest.mark.parametrize(("task", "robot"), sorted({(task, robot) for task, robot, _ in CASES}))
def test_every_task_is_drawn_from_the_seed_alone(task, robot):
    first, score = draw(task, robot, 1)
    again, _ = draw(task, robot, 1)
    other, _ = draw(task, robot, 2)
    assert model_bytes(first) == model_bytes(again)
    assert model_bytes(first) != model_bytes(other)
    assert score.checkpoint == 0 < TASKS[task].last_checkpoint
    # A robot that never moves scores nothing but the time limit, and the scorer says when to look next.
    now_s = 0.0
    while np.isfinite(due_s := score.next_s(now_s)):
        assert due_s > now_s
        now_s = due_s
        score, _ = score.at(now_s, first.pelvis(), first.angles())
    assert now_s == (0.0 if TASKS[task].ends_when_scored else scenario(task, robot).time_limit_s)
    assert score.checkpoint == 0


@pytest.mark.parametrize(("task", "robot", "layer"), CASES)
@pytest.mark.parametrize("policy", sorted(POLICIES))
def test_every_policy_answers_with_messages_that_can_be_sent_up(policy, task, robot, layer):
    machine = machine_of(scenario(task, robot, layer))
    nodes = machine.net.by_path
    edges = [edge for edge in range(len(machine.table)) if not machine.leaf(machine.table[edge].state).manual]
    requests = [Request(1, "confirm", nodes[machine.table[edge].state], edge) for edge in edges[:1]]
    manual = next((path for path in machine.state_names if machine.leaf(path).manual), None)
    requests += [] if manual is None else [Request(2, "manual", nodes[manual], -1)]
    assert requests
    for request in requests:
        answers = [POLICIES[policy]().answer(Belief(Mirror(machine, 0)), request) for _ in (0, 1)]
        assert answers[0] == answers[1]
        for message in answers[0]:
            assert message.direction == "up"
            assert decode_message(*encode_message(message)) == message


def test_every_command_has_a_skill_and_every_skill_a_command():
    assert set(SKILLS) == set(get_args(Command))
    for command in SKILLS:
        assert command.__dataclass_params__.frozen


def test_every_message_class_is_registered_under_its_own_topic():
    for module in pkgutil.iter_modules(teleop_sim.channel.__path__, "teleop_sim.channel."):
        __import__(module.name)
    bases = (Message, Counts, Number, Picture, Sized, Placed, Entries)
    declared = {kind for base in bases for kind in base.__subclasses__()} - {*bases}
    # A second class under one topic would push the first one out.
    assert {c for c in declared if c.__module__.startswith("teleop_sim.")} == set(MESSAGES.values())


@pytest.mark.parametrize("file", FILES)
def test_every_scenario_file_loads_the_same_twice_and_names_what_there_is(file):
    first, second = (load_scenario(file if file in list_scenarios() else ROOT / file) for _ in (0, 1))
    assert first == second
    assert scenario_to_toml(first) == scenario_to_toml(second)
    assert read_scenario(scenario_to_toml(first), file) == first
    assert first.robot in ROBOTS
    assert first.task in TASKS
    assert operator_policy(first.operator)
    assert operator_timing(first.operator)
    assert 0 <= autonomy_level(first) <= 3
