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
from teleop_sim.scenarios.objects import TASKS, autonomy_level, operator_policy, operator_timing
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import Plant

ROOT = Path(__file__).parents[1]
FILES = [*list_scenarios(), *sorted(str(p.relative_to(ROOT)) for p in (ROOT / "examples").glob("*.toml"))]


def model_bytes(plant: Plant) -> bytes:
    buffer = np.empty(mujoco.mj_sizeModel(plant.model), np.uint8)
    mujoco.mj_saveModel(plant.model, None, buffer)
    return buffer.tobytes()


@cache
def scenario(task: str):
    text = scenario_to_toml(load_scenario("src-dish"))
    return read_scenario(text, "src-dish", overrides={"task": task})


def draw(task: str, robot: str, seed: int) -> tuple[Plant, object]:
    site = TASKS[task].site(scenario(task), partial(stream, seed, 0))
    plant = Plant(ROBOTS[robot]().model, site.scenery)
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


@pytest.mark.parametrize("preset", sorted(names.PACINGS))
@pytest.mark.parametrize("task", sorted(TASKS))
def test_every_task_has_a_program_for_each_state_that_acts(task, preset):
    machine = TASKS[task].machine()
    programs = TASKS[task].programs(pacing(preset), "valkyrie")
    assert set(programs) == {state.program for state in machine.states if state.program}
    assert machine.start in machine.state_names


@pytest.mark.parametrize("robot", sorted(ROBOTS))
@pytest.mark.parametrize("task", sorted(TASKS))
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
    assert now_s == scenario(task).time_limit_s
    assert score.checkpoint == 0


@pytest.mark.parametrize("task", sorted(TASKS))
@pytest.mark.parametrize("policy", sorted(POLICIES))
def test_every_policy_answers_with_messages_that_can_be_sent_up(policy, task):
    machine = TASKS[task].machine()
    manual = next(i for i, state in enumerate(machine.states) if state.manual)
    edge = machine.edges[0]
    confirm = Request(1, "confirm", machine.state_names.index(edge.state), machine.events.index(edge.event))
    for request in (confirm, Request(2, "manual", manual, 0)):
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
