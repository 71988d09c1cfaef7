"""WPI's chat vocabulary for task 1: what an operator types to the field site, as data and as values.

Source of the commands and their sizes: WPI-Humanoid-Robotics-Lab/SpaceRoboticsChallenge @ea36ad7,
src_bringup/scripts/message_parser.py, src_tasks/src_task1/src/val_task1SM.cpp, src_task_common/utils/commands.txt;
kept in ``wpi_task1_commands.csv``. Sizes there include the line end.

Not modelled: topic echo, shell calls and the panel offset ``$`` of task 2 (a ``Chat`` carries them, ``parse_chat``
refuses them).
"""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Literal

from teleop_sim.channel.codec import BadMessage

Side = Literal["left", "right"]
Frame = Literal["hand", "pelvis"]

SIDES: tuple[Side, ...] = ("left", "right")
"""WPI's numbers 0 and 1 for a hand."""
FRAMES: tuple[Frame, ...] = ("hand", "pelvis")
"""WPI's numbers 0 and 1 for the frame of a nudge."""

_EVENT = re.compile(r"/[A-Z][A-Z0-9_]*")
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)


@dataclass(frozen=True)
class Word:
    """A row of the vocabulary: a command as typed, its size with the line end [bytes], what it does in task 1."""

    kind: str
    example: str
    size_bytes: int
    effect: str


@dataclass(frozen=True)
class Event:
    """Force an event of the machine. ``name`` keeps the slash, as in WPI's tables: ``/RESTART``."""

    name: str


@dataclass(frozen=True)
class NudgeHand:
    """Move one hand by x, y, z [m] in its own or the pelvis frame."""

    side: Side
    frame: Frame
    x_m: float
    y_m: float
    z_m: float


@dataclass(frozen=True)
class MoveHead:
    """Turn the head to these angles [degrees]."""

    roll_deg: float
    pitch_deg: float
    yaw_deg: float


@dataclass(frozen=True)
class AbortWalk:
    """Stop walking after the present step."""


@dataclass(frozen=True)
class StopEverything:
    """Stop all trajectories."""


ChatCommand = Event | NudgeHand | MoveHead | AbortWalk | StopEverything


@cache
def task1_vocabulary() -> tuple[Word, ...]:
    """The commands of task 1, in the order of the table."""
    text = files("teleop_sim.channel").joinpath("wpi_task1_commands.csv").read_text(encoding="utf-8")
    rows = csv.DictReader(text.splitlines())
    return tuple(Word(r["kind"], r["example"], int(r["bytes"]), r["effect"]) for r in rows)


def parse_chat(text: str) -> ChatCommand:
    """What a chat line without its end says.

    Args:
        text: such as ``/RESTART`` or ``*0 1 0.05 0.0 0.0``. Any well-formed event passes: an operator may also send
            those that the machine raises itself, and the machine knows its own.

    Raises:
        BadMessage: the line says nothing; ``args`` are where, what, hint.

    """
    where = f"chat line {text!r}"
    mark, rest = text[:1], text[1:]
    if mark == "/":
        return _event(text, where)
    if mark == "*":
        return _nudge(rest, where)
    if mark == "&":
        return MoveHead(*_numbers(rest.split(), 3, where, "A head command is like &0 30 0 (roll pitch yaw, degrees)."))
    if text == "|":
        return AbortWalk()
    if text == "_":
        return StopEverything()
    known = ", ".join(word.example for word in task1_vocabulary() if word.kind != "event")
    raise BadMessage(where, "not in the vocabulary", f"Give an event such as /RESTART, or one like: {known}")


def format_chat(command: ChatCommand) -> str:
    """The chat line without its end; ``parse_chat`` gives the command back."""
    match command:
        case Event(name):
            return name
        case NudgeHand(side, frame, x_m, y_m, z_m):
            return f"*{SIDES.index(side)} {FRAMES.index(frame)} {x_m!r} {y_m!r} {z_m!r}"
        case MoveHead(roll_deg, pitch_deg, yaw_deg):
            return "&" + " ".join(repr(float(a)).removesuffix(".0") for a in (roll_deg, pitch_deg, yaw_deg))
        case AbortWalk():
            return "|"
        case StopEverything():
            return "_"


def _event(text: str, where: str) -> Event:
    if _EVENT.fullmatch(text) is None:
        raise BadMessage(where, "no event name", "An event is like /RESTART: capitals, digits, underscores.")
    return Event(text)


def _nudge(rest: str, where: str) -> NudgeHand:
    hint = "A nudge is like *0 1 0.05 0.0 0.0 (side 0 left 1 right, frame 0 hand 1 pelvis, x y z in m)."
    words = rest.split()
    if len(words) != 5 or words[0] not in ("0", "1") or words[1] not in ("0", "1"):
        raise BadMessage(where, "no side, frame, x, y, z", hint)
    x_m, y_m, z_m = _numbers(words[2:], 3, where, hint)
    return NudgeHand(SIDES[int(words[0])], FRAMES[int(words[1])], x_m, y_m, z_m)


def _numbers(words: list[str], count: int, where: str, hint: str) -> tuple[float, ...]:
    if len(words) != count:
        raise BadMessage(where, f"{len(words)} numbers instead of {count}", hint)
    for word in words:
        if _NUMBER.fullmatch(word) is None or not math.isfinite(float(word)):
            raise BadMessage(where, f"{word!r} is no number", hint)
    return tuple(float(word) for word in words)
