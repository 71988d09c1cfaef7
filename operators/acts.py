"""What people's work is made of: urgencies, keys of random streams, what was sent and not yet seen to work."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass
from enum import IntEnum

import simpy

from teleop_sim.channel.messages import (
    AskCloud,
    Chat,
    Confirm,
    Force,
    HandBack,
    Message,
    Reject,
    Request,
    ResetWorld,
    SetLevel,
    TakeOver,
    TemplateStep,
)
from teleop_sim.core.records import Judged
from teleop_sim.machines.declare import Machine
from teleop_sim.operators.verification import Judgement

Send = Callable[[str, bytes, str], None]
Process = Generator[simpy.Event, object, None]


@dataclass(frozen=True)
class Briefing:
    """What the control station is told about the link when the run starts.

    Attributes:
        round_trip_s: nominal.
        uplink_bps: nominal.
        heartbeat_s: silence after which the field site tells its hash; zero: it does not.
        in_reach: the thing to work at is within the hands' reach from the start.

    """

    round_trip_s: float
    uplink_bps: float
    heartbeat_s: float = 0.0
    in_reach: bool = False


@dataclass(frozen=True)
class Unanswered:
    """A command whose effect has not been seen. At ``due_s`` the operator sends it again."""

    request: Request
    messages: tuple[Message, ...]
    wait_s: float
    due_s: float
    repeats: int = 0


class Urgency(IntEnum):
    """What is served first; work ends at once for what is more urgent, if it can be ended at all."""

    HELP = 0
    ORDER = 1
    TALK = 2
    ANSWER = 3
    REPEAT = 4
    ADVISE = 5
    READ = 6


class Purpose(IntEnum):
    """First number of the key of a random stream."""

    ANSWER = 1
    REPEAT = 2
    READ = 3
    JUDGE = 4
    SLIP = 5
    MISJUDGE = 6
    ADVISE = 7
    MOVE = 8
    GIVE = 9
    ORDER = 10
    LOOK = 11
    ASK = 12
    CHECK = 13


def describe(message: Message, question: str, machine: Machine | None = None) -> str:
    """What a message sent by the operator says, for readers of the log."""
    match message:
        case Confirm():
            return f"confirm: {question}"
        case Reject():
            return f"reject: {question}"
        case Chat(text=text):
            return text
        case SetLevel(level=level):
            return f"level {level}"
        case HandBack():
            return f"hand back: {question}"
        case Force(edge=edge) if machine is not None:
            outcome = machine.table[edge]
            return f"force: {outcome.state} {outcome.event}"
        case TakeOver(node=node) if machine is not None:
            return f"take over: {machine.net.nodes[node].path}"
        case TemplateStep(step=step, side=side, which=which):
            return f"step: {step} {which} {side}"
        case AskCloud(voxel_mm=voxel_mm):
            return f"cloud at {voxel_mm} mm"
        case ResetWorld():
            return "reset the world model"
        case _:
            return str(message)


def judged_record(now_s: float, request: int, event: str, picture: int, judgement: Judgement | None) -> Judged:
    """What was made of a claim; None: the picture does not show it."""
    if judgement is None:
        nothing = math.nan
        return Judged(
            now_s, request, event, picture, "", nothing, nothing, nothing, nothing, nothing, verdict="unseen"
        )  # fmt: skip
    found, verdict = judgement.found, "rejected" if judgement.rejected else "accepted"
    return Judged(
        now_s, request, event, picture, found.what, found.offset_px, found.sigma_px, found.d_prime,
        judgement.evidence, judgement.criterion, verdict,
    )  # fmt: skip


def either(first: simpy.Event, second: simpy.Event) -> simpy.Event:
    """What happens as soon as one of two does, both still to come: ``first | second`` without a value, and cheaper."""
    over = simpy.Event(first.env)

    def pass_on(_event: simpy.Event) -> None:
        trigger(over)

    for event in (first, second):
        event.callbacks.append(pass_on)
    return over


def trigger(event: simpy.Event) -> None:
    """Let an event happen, once."""
    if not event.triggered:
        event.succeed()
