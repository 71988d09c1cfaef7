"""What the field site lets the control station see: pictures, marks in them, hands; commands in a line of the log."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import simpy

from teleop_sim.channel import messages as msg
from teleop_sim.core.records import Emit
from teleop_sim.field_claims import claimed_records, marks_message
from teleop_sim.onsite import RobotOnSite
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Look, Side
from teleop_sim.robot.perception.lidar import HandPoints
from teleop_sim.robot.programs.steps import Claim
from teleop_sim.robot.skills.sensing import camera_pose, hand_points, picture
from teleop_sim.robot.tool_poses import tool_pose
from teleop_sim.world.description import Vector

IMAGE_SIZE = (320, 170)
IMAGE_QUALITY = 50
"""JPEG quality of grey images (assumed: a few kB, legible)."""

Aim = Callable[[Look], Generator[simpy.Event, Any, Any]]
"""Turns the head, as a program does."""


class Pictures:
    """The robot's camera at the field site.

    Args:
        env: the clock. robot: on its site. tell: to the downlink. emit: to the log.
        claims: does the operator compare claims with pictures?
    """

    def __init__(
        self,
        env: simpy.Environment,
        robot: RobotOnSite,
        tell: Callable[[msg.Message, str], None],
        emit: Emit,
        claims: bool,
    ) -> None:
        self._env, self._robot, self._tell, self._emit, self._claims = env, robot, tell, emit, claims
        self._taken = 0

    def send(self) -> msg.Image:
        """A picture of now."""
        self._taken += 1
        image: msg.Image = self._robot.look(f"robot.show.{self._taken}", _camera_image, IMAGE_SIZE, IMAGE_QUALITY)
        self._tell(image, "camera image")
        return image

    def show(
        self, claim: Claim | None, path: str, edge: int, passes: bool, aim: Aim
    ) -> Generator[simpy.Event, Any, None]:
        """Process part: send a picture; with marks if the operator will be asked for what it shows, and compares.

        Args:
            claim: if one is about to be told. path: of the state. edge: of the claim's outcome in the machine's table.
            passes: does the outcome pass by itself? aim: turns the head.

        """
        if claim is None or not self._claims or passes:
            if claim is None or claim.otherwise:
                self.send()
            return
        turns = claim.aim != claim.back
        if turns:
            yield from aim(claim.aim)
        image, places = self.send(), self._robot.true_places()
        pose = camera_pose(self._robot.seen())
        self._tell(marks_message(claim, edge, image, pose, IMAGE_SIZE), f"marks {claim.event}")
        for record in claimed_records(float(self._env.now), path, claim, image, places):
            self._emit(record)
        if turns:
            yield from aim(claim.back)


def tool_of(robot: RobotOnSite, side: Side) -> tuple[Vector, Vector]:
    """Tool of a hand: position [m] and rotation vector [rad], odometry frame."""
    found: tuple[Vector, Vector] = robot.look("robot.hand", _left_tool if side == "left" else _right_tool)
    return found


def _left_tool(body: Body, _: np.random.Generator) -> tuple[Vector, Vector]:
    return tool_pose(body, "left")


def _right_tool(body: Body, _: np.random.Generator) -> tuple[Vector, Vector]:
    return tool_pose(body, "right")


def points_of(robot: RobotOnSite, side: Side, number: int) -> HandPoints:
    """What the LIDAR's last half turn has on a hand, and what it should have; ``number``: which look this is."""
    name = f"robot.hand_points.{number}"
    found: HandPoints = robot.look(name, _left_points if side == "left" else _right_points)
    return found


def _left_points(body: Body, rng: np.random.Generator) -> HandPoints:
    return hand_points(body, rng, "left")


def _right_points(body: Body, rng: np.random.Generator) -> HandPoints:
    return hand_points(body, rng, "right")


def _camera_image(body: Body, rng: np.random.Generator) -> msg.Image:
    return msg.encode_image(picture(body, rng), *IMAGE_SIZE, IMAGE_QUALITY)


_CLOUDS = ("cloud", "clouds")


def brief(command: object) -> str:
    """A command in a line of the log: clouds are left out, numbers have three decimals."""
    if isinstance(command, float):
        return f"{command:.3f}"
    if isinstance(command, tuple):
        return "(" + ", ".join(brief(x) for x in command) + ")"
    if is_dataclass(command) and not isinstance(command, type):
        shown = (f"{f.name}={brief(getattr(command, f.name))}" for f in fields(command) if f.name not in _CLOUDS)
        return f"{type(command).__name__}({', '.join(shown)})"
    return str(command)
