"""What a hand round a lever goes on holding between commands, and how much room an arm needs before a door."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Command, PreGrasp
from teleop_sim.robot.commands import Step as Stride
from teleop_sim.robot.drc_plans import drc_stand
from teleop_sim.robot.episode import Episode, NoiseKey, perform
from teleop_sim.robot.hands import robot_of
from teleop_sim.robot.programs.steps import Memory, Reply
from teleop_sim.robot.programs.template_steps import StepOutcome, step_program
from teleop_sim.robot.programs.template_work import DOOR, Instance, affordance_id
from teleop_sim.templates.poses import Pose
from teleop_sim.world import door
from teleop_sim.world.door import Door, lever_rad, opened_rad
from teleop_sim.world.plant import Plant


class Robot:
    """THORMANG3 before a door, its commands and what came of them."""

    def __init__(self, scene: Door, name: str = "thormang3") -> None:
        spec = robot_of(name, "claw")
        self.body = Body(spec, Plant(spec.model, scene))
        self.state = self.body.standing()
        self.done: list[Episode] = []
        self.memory = Memory()

    def do(self, command: Command) -> Episode:
        episode = perform(self.body, command, self.state, NoiseKey(1, 0, len(self.done)))
        self.done.append(episode)
        self.state = episode.end
        self.body.load(self.state)
        return episode

    def step(self, name: Any, at: Instance, which: str = "") -> StepOutcome:
        number = affordance_id(DOOR, which) or 0
        return self._driven(step_program(name, at, number, 0.0, self.memory))

    def _driven(self, program: Generator[Any, Any, StepOutcome]) -> StepOutcome:
        said: Any = None
        while True:
            try:
                command = program.send(said)
            except StopIteration as end:
                return end.value
            episode = self.do(command)
            said = Reply(episode.outcome, episode.cause, episode.data, episode.duration_s)


def scene_of(**figures: float) -> Door:
    return replace(Door(place=(*drc_stand("thormang3").door, door.LEVER_HEIGHT_M)), **figures)


def instance_at(scene: Door, off_m: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Instance:
    place = np.array(scene.place) + off_m
    return Instance(DOOR, Pose((float(place[0]), float(place[1]), float(place[2])), (0.0, 0.0, 0.0)), "thormang3")


def test_a_lever_stays_down_between_two_acts_against_the_stiffest_spring():
    scene = scene_of(spring_nm=3.0)
    robot, at = Robot(scene), instance_at(scene)
    for name in ("pregrasp", "grasp", "close"):
        robot.step(name, at)
    robot.step("affordance", at, "turnCW")
    # The plant is at rest and frozen: the bolt leaves its strike at 40 degrees.
    assert lever_rad(robot.body.plant) > math.radians(40.0)
    assert len(robot.state.torque) == len(robot.body.upper_names)
    robot.step("affordance", at, "push")
    assert opened_rad(robot.body.plant) > math.radians(12.0)
    robot.step("release", at)
    assert robot.state.torque == ()
    assert not robot.state.fallen


@pytest.mark.parametrize("off_m", [(0.0, 0.0, -0.015), (0.0, -0.015, 0.0), (0.01, 0.01, 0.01)])
def test_thormang3_stands_and_opens_with_a_template_that_is_off(off_m):
    scene = scene_of()
    robot, at = Robot(scene), instance_at(scene, off_m)
    for name in ("pregrasp", "grasp", "close"):
        robot.step(name, at)
    robot.step("affordance", at, "turnCW")
    robot.step("affordance", at, "push")
    assert opened_rad(robot.body.plant) > math.radians(12.0)
    assert robot.step("release", at).outcome == "released"
    assert not robot.state.fallen


def test_an_arm_without_room_before_the_door_gets_it_by_a_step_back():
    scene = scene_of()
    x, y, z = scene.place
    near = replace(scene, place=(x - 0.03, y - 0.03, z))
    robot, at = Robot(near), instance_at(near)
    end = robot.step("pregrasp", at)
    assert [type(e.command) for e in robot.done] == [PreGrasp, Stride, PreGrasp]
    assert "wall" in robot.done[0].cause
    assert end.outcome == "reached"
