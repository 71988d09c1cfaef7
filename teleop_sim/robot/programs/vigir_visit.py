"""What the programs of ViGIR's states share: a visit, what their keys hold, how long planning takes."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any, Literal

from teleop_sim.machines.declare import FELL
from teleop_sim.robot.commands import PlanarPose, Side
from teleop_sim.robot.programs.steps import Memory, Program, ProgramOf, Step, StepName, Stepped, Wait
from teleop_sim.robot.programs.template_work import Down, Instance, StepOutcome, here_of, instance_of
from teleop_sim.templates.server import Entry

PLANNING_S = 1.0
"""For a plan of arms or feet to come back (assumed)."""
NO_ANSWER_S = 5.0
"""After which a planner that does not answer is given up (assumed)."""


@dataclass(frozen=True)
class Goal:
    """Where a hand is to go: what the keys of grasp and pre-grasp poses, way-points and trajectories hold.

    Attributes:
        at: the template as it lay when the pose was asked for.
        kind: which pose. preference: place among the grasps, from 0.
        straight: along a line, as Cartesian plans are.

    """

    at: Instance
    kind: Literal["pregrasp", "grasp"]
    preference: int = 0
    straight: bool = False


@dataclass(frozen=True)
class Move:
    """An affordance to be carried out: what keys of affordances, and of their trajectories, hold.

    Attributes:
        at: the template as it lay when it was asked for.
        which: id in the library. amount: in the affordance's own sense [m or rad].

    """

    at: Instance
    which: int
    amount: float


@dataclass(frozen=True)
class Visit:
    """One visit of a state: its keys and parameters, and which robot it is."""

    memory: Memory
    robot: str

    @property
    def state(self) -> str:
        """Its name, without the containers."""
        return self.memory.path.rpartition("/")[2]

    def read(self, key: str) -> Any:
        """A key's value; None if it was never written."""
        return self.memory.reads.get(key)

    def write(self, key: str, value: object) -> None:
        """Give a key a value."""
        self.memory.writes[key] = value

    def parameter(self, name: str) -> str:
        """A parameter as text; of ``<by hand side: a | b>`` the left hand's is the first."""
        text = str(self.memory.parameters.get(name, ""))
        if not text.startswith("<by hand side: "):
            return text
        left, _, right = text.removeprefix("<by hand side: ").removesuffix(">").partition(" | ")
        return left if self.side == "left" else right

    @property
    def side(self) -> Side:
        """Of the hand: a key's, else the left."""
        side = self.read("hand_side") or self.read("hand") or self.read("side")
        return "right" if side == "right" else "left"

    @property
    def here(self) -> PlanarPose:
        """Where the robot stands, by odometry."""
        return here_of(self.memory)

    def entries(self) -> tuple[Entry, ...]:
        """The templates that lie at the field site."""
        ask: Callable[[], tuple[Entry, ...]] | None = self.memory.facts.get("templates")
        return () if ask is None else ask()

    def instance(self, number: object) -> Instance | None:
        """The template of that number, if it is there and in no hand."""
        lying = (e for e in self.entries() if (e.instance, e.frame) == (number, "odometry"))
        return next((instance_of(e, self.robot, self.side) for e in lying), None)


Body = Callable[[Visit], Program]


def program_of(body: Body, robot: str) -> ProgramOf:
    """A state's program; a fall ends it with ``!fell``."""

    def program(memory: Memory) -> Program:
        try:
            return (yield from body(Visit(memory, robot)))
        except Down:
            return FELL

    return program


def planned(visit: Visit) -> Generator[Step, Any, bool]:
    """Ask the robot's own computers for a plan. Do they answer?"""
    answers: Callable[[], bool] | None = visit.memory.facts.get("onboard")
    if answers is None or answers():
        yield Wait(PLANNING_S, "planning")
        return True
    yield Wait(NO_ANSWER_S, "the planner does not answer")
    return False


def stepped(name: StepName, end: StepOutcome) -> Generator[Step, Any, StepOutcome]:
    """Tell what came of a step."""
    yield Stepped(name, end.outcome, end.amount)
    return end
