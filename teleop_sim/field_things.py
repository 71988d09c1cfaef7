"""The field site's half of work with object templates: server, world model, orders by hand, clouds, hands.

A person's step of the workflow and a behaviour's are the same programs (``robot/programs/template_steps.py``). What
came of each is told in a few bytes, with where the hand then is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import simpy

from teleop_sim.channel import messages as msg
from teleop_sim.channel.template_ends import FieldTemplates
from teleop_sim.robot.commands import Cartesian, Cloud, Command, Joints, PlanarPose, Scan, Side, Walk
from teleop_sim.robot.footsteps import walk_bodies
from teleop_sim.robot.gait import Gait
from teleop_sim.robot.perception.lidar import HandPoints
from teleop_sim.robot.programs.steps import AskData, AskStatus, Memory, Reply, Say, Show, Stepped, Wait
from teleop_sim.robot.programs.template_steps import Instance, StepOutcome, hand_moved, instance_of, step_program
from teleop_sim.robot.route import plain_steps
from teleop_sim.world.description import Vector

Process = Generator[simpy.Event, Any, Any]


PLAN = "FOOTSTEP_PLAN_HEADER"
"""What ViGIR's states ask for when footsteps are to be looked at."""
SHOWN_STEPS = 10
"""Footsteps that the consoles could draw at once (Romay et al., section 6.1.2: plans of more could not be shown)."""


@dataclass(frozen=True)
class Onboard:
    """The way from the field computer to the robot's own.

    Attributes:
        request_loss: share of the behaviour's requests to plan a motion that are not answered.
        rng: decides which.
    """

    request_loss: float
    rng: np.random.Generator

    def answers(self) -> bool:
        """Whether the next request is answered."""
        return float(self.rng.random()) >= self.request_loss


@dataclass(frozen=True)
class Work:
    """What a task at a thing gives its field site.

    Attributes:
        robot: name. ghosts: spurious obstacles in the world model [m]. onboard: to the robot's computers.
        side: of the hand that works.
    """

    robot: str
    ghosts: tuple[Vector, ...]
    onboard: Onboard
    side: Side = "left"


class Site(Protocol):
    """What this needs of the field site."""

    @property
    def gait(self) -> Gait:
        """How the robot walks."""

    def tell(self, message: msg.Message, text: str) -> None:
        """To the downlink."""

    def note(self, effect: str, command: str, note: str) -> None:
        """Write down what became of a command."""

    def by_hand(self, text: str, work: Callable[[], Process]) -> bool:
        """Start what a person ordered; False, with a note, while the robot acts."""

    def act(self, command: Command) -> Generator[simpy.Event, Any, Reply]:
        """Carry out one command of a person's."""

    def wait(self, seconds: float, why: str) -> Process:
        """Let time pass for what a person ordered."""

    def between(self, work: Callable[[], Process]) -> None:
        """Start something short that may come between two movements of a program."""

    def hand(self, side: Side) -> tuple[Vector, Vector]:
        """Tool of a hand: position [m] and rotation vector [rad], odometry frame."""

    def hand_points(self, side: Side) -> HandPoints:
        """What the LIDAR's last half turn has on a hand, and what it should have."""


@dataclass
class Things:
    """The field computer's template server and world model.

    Args:
        site: the field site. work: what the task gives. memory: of the programs; this fills in what they ask for.
    """

    site: Site
    work: Work
    memory: Memory
    server: FieldTemplates = field(default_factory=FieldTemplates)

    def __post_init__(self) -> None:
        """Let programs ask for templates, obstacles and the planner."""
        facts = self.memory.facts
        facts["templates"] = lambda: self.server.server.placed
        facts["world"] = self.work.ghosts
        facts["onboard"] = self.work.onboard.answers
        facts["robot"] = self.work.robot

    def receive(self, message: msg.Message) -> bool:
        """Obey a message that has arrived; False: it is none of these."""
        match message:
            case (
                msg.TemplateInsert()
                | msg.TemplateMove()
                | msg.TemplateDetach()
                | msg.TemplateRemove()
                | msg.TemplateAttach()
                | msg.TemplateSync()
            ):
                reply = self.server.receive(message)
                if reply is not None:
                    self.site.tell(reply, "templates")
            case msg.TemplateStep():
                self._order(message)
            case msg.AskCloud():
                self.site.between(lambda: self._cloud(message))
            case msg.CartesianTarget(side=side, position_m=position, rotation_rad=rotation):
                self._move("cartesian", Cartesian(side, position, rotation), side)
            case msg.JointTargets(group=group, angles_rad=angles):
                self._move(f"joints {group}", Joints(group, angles), self.work.side)
            case msg.ResetWorld():
                self.site.note("world reset", "reset world", f"{len(self.memory.facts['world'])} obstacles forgotten")
                self.memory.facts["world"] = ()
            case _:
                return False
        return True

    def stepped(self, done: Stepped) -> None:
        """Tell what came of a step of the behaviour's, and where the hand is."""
        self._tell(done.step, done.outcome, done.amount, self.work.side)

    def asked(self, what: str) -> None:
        """Before an operator is asked for a look at footsteps: show them, in parts that a console can draw."""
        plan = self.memory.facts.get("plan")
        if what != PLAN or not isinstance(plan, Walk):
            return
        steps = planned_footsteps(self.memory.facts.get("pose", (0.0, 0.0, 0.0)), plan, self.site.gait)
        pieces = [steps[k : k + SHOWN_STEPS] for k in range(0, len(steps), SHOWN_STEPS)] or [()]
        for k, piece in enumerate(pieces):
            self.site.tell(msg.FootstepPlan(k, len(pieces), piece), f"footsteps, part {k + 1} of {len(pieces)}")

    def heartbeat(self) -> None:
        """Tell the hash of all templates, if there are any."""
        if self.server.server.entries:
            self.site.tell(self.server.heartbeat(), "templates")

    # Orders by hand ------------------------------------------------------------------------------------------------

    def _order(self, order: msg.TemplateStep) -> None:
        entries = {e.instance: e for e in self.server.server.placed}
        entry = entries.get(order.instance)
        text = f"{order.step} {order.which} of template {order.instance}"
        if entry is None:
            self.site.note("ignored", text, "no such template lies here")
            self._tell(order.step, "refused", 0.0, None)
            return
        instance = instance_of(entry, self.work.robot, order.side)
        if not self.site.by_hand(text, lambda: self._do_step(order, instance)):
            self._tell(order.step, "refused", 0.0, None)

    def _do_step(self, order: msg.TemplateStep, instance: Instance) -> Process:
        program = step_program(order.step, instance, order.which, order.amount, self.memory)
        answer: object = None
        while True:
            try:
                step = program.send(answer)
            except StopIteration as end:
                done: StepOutcome = end.value
                self._tell(order.step, done.outcome, done.amount, order.side)
                return
            match step:
                case Wait(seconds=seconds, why=why):
                    answer = yield from self.site.wait(seconds, why)
                case AskStatus() | AskData() | Say() | Show() | Stepped():
                    # A person who ordered it is told what came of the whole.
                    answer = None
                case command:
                    answer = yield from self.site.act(command)

    def _move(self, text: str, command: Command, side: Side) -> None:
        def work() -> Process:
            reply = yield from self.site.act(command)
            hand_moved(self.memory)
            self._tell_hand(side)
            self.site.note(reply.outcome, text, reply.cause)

        self.site.by_hand(text, work)

    # What is told --------------------------------------------------------------------------------------------------

    def _tell(self, step: msg.StepName, outcome: msg.OutcomeName, amount: float, side: Side | None) -> None:
        self.site.tell(msg.StepDone(step, outcome, _amount(amount)), f"{step} {outcome}")
        if side is not None:
            self._tell_hand(side)

    def _tell_hand(self, side: Side) -> None:
        position, rotation = self.site.hand(side)
        self.site.tell(msg.HandPose(side, position, rotation), f"{side} hand")

    def _cloud(self, asked: msg.AskCloud) -> Process:
        """Half a turn of the LIDAR, cropped to what was asked for; and its points on the hand, if that is in there."""
        reply = yield from self.site.act(Scan(asked.middle_m))
        if not isinstance(reply.data, Cloud):
            return
        away = np.linalg.norm(reply.data.points - np.array(asked.middle_m), axis=1)
        points = reply.data.points[away <= asked.radius_m]
        # Before the cloud: who waits for that then has both.
        self._hand_cloud(asked)
        self.site.tell(msg.encode_voxels(points, asked.voxel_mm / 1000), f"cloud of {len(points)} points")

    def _hand_cloud(self, asked: msg.AskCloud) -> None:
        side = self.work.side
        if math.dist(self.site.hand(side)[0], asked.middle_m) > asked.radius_m:
            return
        points = self.site.hand_points(side)
        told = msg.encode_hand(side, points.seen, points.model, asked.voxel_mm / 1000)
        if told is not None:
            self.site.tell(told, f"{len(points.seen)} points on the {side} hand")


def planned_footsteps(here: PlanarPose, walk: Walk, gait: Gait) -> tuple[PlanarPose, ...]:
    """Footsteps of a walk from where the middle of the feet is, round nothing."""
    return tuple((s.x, s.y, s.yaw) for s in plain_steps(here, walk_bodies(here, walk.path, gait), gait))


def _amount(amount: float) -> float:
    return float(np.clip(amount, -32.0, 32.0)) if math.isfinite(amount) else 0.0
