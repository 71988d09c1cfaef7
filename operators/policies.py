"""What a supervisor decides, given a belief and a request. One class and one registry line a policy.

A policy is a pure function of what has arrived: it knows no clock and no link.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from teleop_sim.channel.messages import Chat, Confirm, Message, Reject, Request
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.interventions import Interventions, commands, load_interventions


class Policy(Protocol):
    """Decides what to send."""

    @property
    def verifies(self) -> bool:
        """Does the operator compare claims with pictures? The field site is told beforehand."""
        ...

    def answer(self, belief: Belief, request: Request) -> tuple[Message, ...]:
        """Messages that answer ``request``, sent in this order; empty to let it wait."""
        ...


@dataclass(frozen=True)
class Supervise:
    """Fixed level. Confirms whatever is suggested after looking at it; helps by hand by the table of interventions.

    Not modelled: seeing that a suggestion is wrong (``Verify``), changing the level, teleoperation, deciding where
    nothing is suggested, giving data.
    """

    table: Interventions = field(default_factory=load_interventions)

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
        return tuple(Chat(text) for text in texts)


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


POLICIES: dict[str, Callable[[], Policy]] = {
    "supervise": Supervise,
    "verify": Verify,
}
"""Name in a scenario to policy."""
