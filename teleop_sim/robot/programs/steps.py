"""What a program may yield, and what it gets back."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from teleop_sim.robot.commands import Command, Look, Vector

MarkName = Literal["yaw_wheel", "pitch_wheel", "yaw_handle", "pitch_handle"]

StepName = Literal[
    "stand", "pregrasp", "grasp", "open", "close", "attach", "detach", "usability", "affordance", "release", "home"
]
"""Steps of the manipulation workflow of object templates: Romay et al., section 3.3."""

StepResult = Literal[
    "reached", "taken", "closed", "opened", "released", "blocked", "no_plan", "no_motion", "grip_lost", "force_limit",
    "timed_out", "fell", "stopped", "refused",
]  # fmt: skip
"""What can come of one."""


@dataclass(frozen=True)
class Wait:
    """Let time pass. The reply is None."""

    seconds: float
    why: str


@dataclass(frozen=True)
class AskStatus:
    """Read the task's status message: the reply is a mapping of names to numbers (empty before it is sent)."""


@dataclass(frozen=True)
class AskData:
    """Ask the operator for data and wait for it. The reply is the bytes of his answer."""

    what: str


@dataclass(frozen=True)
class Say:
    """Send the operator a line of the state log. The reply is None."""

    text: str


@dataclass(frozen=True)
class Mark:
    """Something that the robot believes to be somewhere: what, its middle in the odometry frame [m], and its radius."""

    what: MarkName
    place: Vector
    radius_m: float


@dataclass(frozen=True)
class Claim:
    """A sighting that a program is about to tell with an event.

    Attributes:
        event: of the program's state.
        marks: where everything was seen.
        aim: turns the head to where a picture shows it; ``back`` puts it where it was.
        otherwise: is a picture wanted even if nobody compares it with the claim? Then the head stays.

    """

    event: str
    marks: tuple[Mark, ...]
    aim: Look
    back: Look
    otherwise: bool = True


@dataclass(frozen=True)
class Show:
    """Send the operator a camera image; of a claim that he will be asked about with marks. The reply is None."""

    claim: Claim | None = None


@dataclass(frozen=True)
class Reply:
    """What came of a command: the episode's outcome and cause, what the sensors made of it, and how long it took."""

    outcome: str
    cause: str
    data: Any
    duration_s: float


@dataclass(frozen=True)
class Stepped:
    """A step of the workflow is over: the operator is told. The reply is None.

    Attributes:
        step: which.
        outcome: what came of it.
        amount: of an affordance, how far the thing was felt to go in its sense [m or rad].

    """

    step: StepName
    outcome: StepResult
    amount: float = 0.0


Step = Command | Wait | AskStatus | AskData | Say | Show | Stepped
Answer = Reply | Mapping[str, float] | bytes | None
Program = Generator[Step, Any, str]
"""Yields steps, receives their replies, returns the event of its state."""


@dataclass
class Memory:
    """What the field computer remembers between states: the keys of the machine's data flow.

    Attributes:
        facts: by name, for the whole run.
        reads: values of the keys that the state reads at this visit, by the state's own names.
        parameters: of the state at this visit.
        writes: values of the keys that the state writes, by its own names; the program puts them here.
        path: of the state.

    """

    facts: dict[str, Any] = field(default_factory=dict)
    reads: Mapping[str, object] = field(default_factory=dict)
    parameters: Mapping[str, object] = field(default_factory=dict)
    writes: dict[str, object] = field(default_factory=dict)
    path: str = ""


ProgramOf = Callable[[Memory], Program]
