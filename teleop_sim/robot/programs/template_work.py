"""What the steps of the template workflow work on: a template that lies there, and what the hand has done to the thing.

Geometry is ``drc_plans``'s: the hands here are cages, not the published grasps' Robotiq and VT hands. Of a template's
turn the yaw counts, and of a valve's also the roll, which is its spokes' angle; things are taken to stand upright.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

from teleop_sim.core.errors import UnknownName
from teleop_sim.robot.commands import Command, Handle, PlanarPose, Side, Walk
from teleop_sim.robot.commands import Step as Stride
from teleop_sim.robot.drc_plans import Template, drc_stand, gap_handle, lever_handle, opened
from teleop_sim.robot.programs.places import move
from teleop_sim.robot.programs.steps import Memory, Reply, Step, StepResult
from teleop_sim.templates.elements import Affordance
from teleop_sim.templates.library import library
from teleop_sim.templates.poses import Pose
from teleop_sim.templates.server import Entry
from teleop_sim.world import valve

DOOR, VALVE = "door", "DRC_valve"
"""Templates that a robot knows how to work on."""
GAPS = 3
"""Gaps of a wheel that a rod tries before it gives up, as in ``benchmarks/valve_study.py``."""

THERE_M, THERE_RAD = 0.10, 0.12
"""A robot that stands so near its goal stands well. The rates at door and valve were measured with things that lay 2 cm
and 3 degrees off, which is a goal 5 cm off: twice that, and WPI's for a walk's goal (``doing.GOAL_M``)."""
STEPS_M, STEPS_RAD = 0.6, 0.8
"""So far it steps sideways and backwards, and turns at the end (assumed: three strides)."""

HandPlace = Literal["home", "before", "at", "led", "astray"]
"""Where the hand is: at home, 10 cm before a handle, at it, where a person has led it, or somewhere else."""
RESULTS: tuple[StepResult, ...] = get_args(StepResult)


@dataclass(frozen=True)
class Instance:
    """A template that lies in the odometry frame, and who is to work on the thing.

    Attributes:
        template: name in the library.
        pose: of the template.
        robot: name, with or without its hand. side: of the hand.

    """

    template: str
    pose: Pose
    robot: str
    side: Side = "left"

    @property
    def place(self) -> Template:
        """Where the thing is, as ``drc_plans`` wants it."""
        x_axis = self.pose.matrix[:, 0]
        return Template(self.pose.position_m, math.atan2(x_axis[1], x_axis[0]))

    @property
    def spoke_rad(self) -> float:
        """Angle of a valve's spoke, anticlockwise from up as the robot sees it."""
        x, y, z = (float(v) for v in self.pose.matrix[:, 2])
        yaw_rad = self.place.yaw_rad
        return math.atan2(y * math.cos(yaw_rad) - x * math.sin(yaw_rad), z)

    @property
    def rod(self) -> bool:
        """Does the hand come shut, as a rod?"""
        return self.template == VALVE

    @property
    def stand(self) -> PlanarPose:
        """Where the middle of the feet goes: measured for the left hand (``drc_plans.DRC_STANDS``)."""
        figures = drc_stand(self.robot)
        ahead_m, left_m = figures.door if self.template == DOOR else figures.valve
        (x, y, _), yaw_rad = self.place.place, self.place.yaw_rad
        c, s = math.cos(yaw_rad), math.sin(yaw_rad)
        return (x - c * ahead_m + s * left_m, y - s * ahead_m - c * left_m, yaw_rad)

    def refusal(self) -> str:
        """Why nothing can be done here, or nothing."""
        if self.template not in (DOOR, VALVE):
            return f"how to work on a {self.template} is not known"
        return "" if self.side == "left" else f"nobody has found out where to stand for the {self.side} hand"

    def affordance(self, which: int) -> Affordance | None:
        """By its id in the library."""
        return next((a for a in library().named(self.template).affordances if a.id == which), None)

    def preferred(self, which: int) -> int:
        """Place of a grasp, from 0, of an id in the library; a smaller number is the place itself."""
        ids = [g.id for g in library().named(self.template).grasps if g.side == self.side]
        same = sorted(set(ids))
        return same.index(which) if which in same else which


@dataclass(frozen=True)
class Work:
    """What the robot knows of its hand and the thing.

    Attributes:
        at: the template. hand: where it is. closed: is it shut? gap: of the wheel, from the preferred one on.
        lever_rad: how far the lever is held down. opened_rad, turned_rad: how far the door and the wheel were felt to
            go since the template was laid.

    """

    at: Instance
    hand: HandPlace = "home"
    closed: bool = False
    gap: int = 0
    lever_rad: float = 0.0
    opened_rad: float = 0.0
    turned_rad: float = 0.0

    @property
    def lever(self) -> Template:
        """Where the lever's frame is now."""
        return opened(self.at.place, self.opened_rad) if self.opened_rad else self.at.place

    @property
    def handle(self) -> Handle:
        """Where the hand goes."""
        if not self.at.rod:
            return lever_handle(self.lever)
        figures = drc_stand(self.at.robot)
        start_rad = figures.start_rad + self.gap * math.tau / valve.SPOKES
        return gap_handle(self.at.place, self.at.spoke_rad + self.turned_rad, replace(figures, start_rad=start_rad))


@dataclass(frozen=True)
class StepOutcome:
    """What came of a step.

    Attributes:
        outcome: of its last movement.
        amount: how far an affordance was felt to go, in its own sense [m or rad].
        cause: in words.

    """

    outcome: StepResult
    amount: float = 0.0
    cause: str = ""


class Down(Exception):
    """The robot fell: ends a step from any depth. It never leaves ``template_steps`` and ``vigir``."""


Part = Generator[Step, Any, Any]
StepProgram = Generator[Step, Any, StepOutcome]


def instance_of(entry: Entry, robot: str, side: Side = "left") -> Instance:
    """What lies there, by the template server.

    Raises:
        UnknownName: the library has no template of this type.

    """
    return Instance(library().of_type(entry.template).name, entry.pose, robot, side)


def work_of(memory: Memory, at: Instance) -> Work:
    """What is known of a thing. A template that was laid anew says where the thing is now."""
    known: Work | None = memory.facts.get("work")
    if known is None:
        return Work(at, "led" if memory.facts.get("led") else "home")
    if known.at == at:
        return known
    if known.at.template == at.template:
        return replace(known, at=at, opened_rad=0.0, turned_rad=0.0)
    return Work(at, "astray" if known.hand in ("before", "at") else known.hand, known.closed)


def remember(memory: Memory, work: Work) -> Work:
    """Keep it."""
    memory.facts["work"] = work
    return work


def hand_moved(memory: Memory) -> None:
    """A person has moved the arm itself: it is where he wants it. A hand that holds something goes on holding it."""
    known: Work | None = memory.facts.get("work")
    memory.facts["led"] = True
    if known is not None and known.hand != "at":
        memory.facts["work"] = replace(known, hand="led")


def do(command: Command) -> Generator[Step, Any, Reply]:
    """Carry out a command; a fall ends everything."""
    reply: Reply = yield command
    if reply.outcome == "fell":
        raise Down(reply.cause)
    return reply


def told(reply: Reply, amount: float = 0.0) -> StepOutcome:
    """A movement's reply as a step's outcome."""
    result = next((known for known in RESULTS if known == reply.outcome), None)
    return StepOutcome("stopped" if result is None else result, amount, reply.cause)


def amount_of(reply: Reply) -> float:
    """How far an ``Act`` was felt to go; zero if it never began."""
    return float(getattr(reply.data, "amount", 0.0))


def reach_of(reply: Reply) -> float:
    """How much of an ``Act`` that ended ``no_plan`` is in reach; zero if it is not known."""
    return float(getattr(reply.data, "reach", 0.0)) if reply.outcome == "no_plan" else 0.0


def obstacles(memory: Memory) -> tuple[tuple[float, float, float], ...]:
    """What the world model holds full, spurious or not."""
    return tuple(memory.facts.get("world", ()))


def here_of(memory: Memory) -> PlanarPose:
    """Where the robot stands, by odometry: middle of the feet."""
    pose: PlanarPose = memory.facts.get("pose", (0.0, 0.0, 0.0))
    return pose


def way_to(here: PlanarPose, goal: PlanarPose) -> Walk | Stride:
    """Steps to a goal: short ones as the robot stands, for beside a door it must not face along its way."""
    steps = move(here, goal)
    short = math.hypot(steps.forward_m, steps.left_m) <= STEPS_M and abs(steps.turn_rad) <= STEPS_RAD
    return steps if short else Walk((goal,))


def near(here: PlanarPose, goal: PlanarPose) -> bool:
    """Does a robot stand at a goal, well enough?"""
    steps = move(here, goal)
    return math.hypot(steps.forward_m, steps.left_m) <= THERE_M and abs(steps.turn_rad) <= THERE_RAD


def affordance_id(template: str, name: str) -> int | None:
    """Id of an affordance by name; None: the template has none of it."""
    try:
        return library().named(template).affordance(name).id
    except UnknownName:
        return None
