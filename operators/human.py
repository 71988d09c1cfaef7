"""What people do wrong: slips of the hand and misjudgements, as named inputs with rates."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from teleop_sim.channel.messages import Chat, Confirm, Message, Reject, SetLevel
from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.operators.workload import Curve

SLIP_RATE = 0.02
MISJUDGE_RATE = 0.16
"""J. C. Williams, HEART (1986): nominal unreliability of a routine, highly practised task and of a complex task that
requires a high level of comprehension. Remembered, not checked."""


@dataclass(frozen=True)
class Human:
    """How a person fails, and what load does to him.

    Attributes:
        slip_rate: chance that what is sent is not what was meant, 0 to 1. ``SLIP_RATE`` is HEART's.
        misjudge_rate: chance that a decision is the wrong one, 0 to 1. ``MISJUDGE_RATE`` is HEART's.
        curve: what workload does to times and rates; None: nothing.

    Not modelled: lapses (a thing forgotten), noticing one's own slip, learning from it.

    Raises:
        BadInput: a rate outside 0 to 1; both at once.

    """

    slip_rate: float = 0.0
    misjudge_rate: float = 0.0
    curve: Curve | None = field(default=None)

    def __post_init__(self) -> None:
        problems = tuple(
            Problem(f"operator: {name}", f"{rate!r} is no chance", "Give 0 to 1.")
            for name, rate in (("slip_rate", self.slip_rate), ("misjudge_rate", self.misjudge_rate))
            if not 0.0 <= rate <= 1.0
        )
        if problems:
            raise BadInput(problems)


def happens(rate: float, rng: np.random.Generator) -> bool:
    """Does it go wrong this time? Draws once, whatever the rate."""
    return bool(rng.random() < rate)


def slipped(message: Message) -> Message:
    """What leaves the hand in place of what was meant: the neighbouring key.

    Confirm and reject are taken for each other; of a line two letters change places, so that nobody understands it; a
    level is one too high, or too low at the top. Everything else is given by pointing and stays as it was (assumed).
    """
    match message:
        case Confirm(request=request):
            return Reject(request)
        case Reject(request=request):
            return Confirm(request)
        case SetLevel(level=level):
            return SetLevel(level + 1 if level < 3 else level - 1)
        case Chat(text=text) if len(text) > 2 and text[1] != text[2]:
            return replace(message, text=text[0] + text[2] + text[1] + text[3:])
        case _:
            return message


def misjudged(messages: tuple[Message, ...]) -> tuple[Message, ...]:
    """A wrong decision: a suggestion that should pass is refused, one that should not passes. Others stay (assumed)."""

    def other(message: Message) -> Message:
        return slipped(message) if isinstance(message, Confirm | Reject) else message

    return tuple(other(message) for message in messages)
