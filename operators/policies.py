"""What a crew has agreed to do, given a belief and a request. The list is in ``registry.py``.

A policy is a pure function of what has arrived and been sent: it knows no link, and of the clock only what it is told.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from teleop_sim.channel.messages import Chat, Confirm, Force, Message, Preempt, Reject, Request
from teleop_sim.operators.acts import Briefing
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.interventions import Interventions, commands, load_interventions
from teleop_sim.operators.manual import Manual, Nothing


class Policy(Protocol):
    """Decides what to send."""

    @property
    def verifies(self) -> bool:
        """Does the operator compare claims with pictures? The field site is told beforehand."""
        ...

    def answer(self, belief: Belief, request: Request, /) -> tuple[Message, ...]:
        """Messages that answer ``request``, sent in this order; empty to let it wait."""
        ...

    def advise(self, belief: Belief, now_s: float, briefing: Briefing, /) -> tuple[Message, ...]:
        """What the supervisor sends although nobody asked; empty: nothing."""
        ...

    def wake_s(self, belief: Belief, now_s: float, briefing: Briefing, /) -> float:
        """When ``advise`` may change although nothing arrives: later than ``now_s``, or never (infinite)."""
        ...

    def move(self, belief: Belief, request: Request, step: int, rng: np.random.Generator, /) -> Message | None:
        """The next movement by hand of who acts in lieu of a state, by what he sees; None: enough, or nothing to do."""
        ...

    def stale_s(self, request: Request, /) -> float:
        """Age from which what is on the screen is too old to decide on this request."""
        ...


@dataclass(frozen=True)
class Supervise:
    """Fixed level. Confirms whatever is suggested after looking at it; helps by hand by the table of interventions.

    Not modelled: seeing that a suggestion is wrong (``Verify``), changing the level, teleoperation, deciding where
    nothing is suggested.

    Attributes:
        table: which commands help.
        manual: what can be done by hand; policies that step down use it.

    """

    table: Interventions = field(default_factory=load_interventions)
    manual: Manual = field(default_factory=Nothing)

    @property
    def verifies(self) -> bool:
        """Pictures change no decision."""
        return False

    def answer(self, belief: Belief, request: Request) -> tuple[Message, ...]:
        """``Confirm``, or the commands of the table as ``Chat``."""
        if request.edge >= 0:
            return (Confirm(request.request),)
        if request.kind != "manual":
            return ()
        waiting = belief.waiting_state(request)
        texts = commands(self.table, belief.machine, belief.visited, belief.helped, waiting)
        return tuple(_command(belief, waiting, text) for text in texts)

    def advise(self, _belief: Belief, _now_s: float, _briefing: Briefing, /) -> tuple[Message, ...]:
        """Nothing."""
        return ()

    def wake_s(self, _belief: Belief, _now_s: float, _briefing: Briefing, /) -> float:
        """Never."""
        return math.inf

    def move(self, _belief: Belief, _request: Request, _step: int, _rng: np.random.Generator, /) -> Message | None:
        """Nothing is done by hand."""
        return None

    def stale_s(self, _request: Request, /) -> float:
        """Nothing is too old."""
        return math.inf


GIVE_IN_AFTER = 2
"""A claim that was refused so often in a row is confirmed: another look would show the same (assumed)."""


@dataclass(frozen=True)
class Verify(Supervise):
    """As ``Supervise``, but a claim that the picture does not bear out is rejected: the robot looks again.

    A claim of which no picture has arrived is confirmed, and so is one refused ``GIVE_IN_AFTER`` times in a row.
    """

    @property
    def verifies(self) -> bool:
        """Claims are judged by the pictures that come with them."""
        return True

    def answer(self, belief: Belief, request: Request) -> tuple[Message, ...]:
        """``Reject``, or as ``Supervise``."""
        judgement = belief.judged.get(request.request)
        if judgement is not None and judgement.rejected and belief.refused.get(request.edge, 0) < GIVE_IN_AFTER:
            return (Reject(request.request),)
        return super().answer(belief, request)


def _command(belief: Belief, waiting: str, text: str) -> Message:
    """A command as it is given: typed where the vocabulary is WPI's, else clicked; giving up ends the machine."""
    if text.startswith(("/", "&")) and (text.startswith("&") or belief.machine.has_edge(waiting, text)):
        return Chat(text)
    if belief.machine.has_edge(waiting, text):
        return Force(belief.machine.edge_index(waiting, text), belief.mirror.seen)
    return Preempt()
