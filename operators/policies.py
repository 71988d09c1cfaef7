"""What a supervisor decides, given a belief and a request. One class and one registry line a policy.

A policy is a pure function of what has arrived: it knows no clock and no link.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from teleop_sim.channel.messages import Chat, Confirm, Message, Request
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.interventions import Interventions, commands, load_interventions


class Policy(Protocol):
    """Decides what to send."""

    def answer(self, belief: Belief, request: Request) -> tuple[Message, ...]:
        """Messages that answer ``request``, sent in this order; empty to let it wait."""
        ...


@dataclass(frozen=True)
class Supervise:
    """Fixed level. Confirms whatever is suggested after looking at it; helps by hand by the table of interventions.

    Not modelled: seeing that a suggestion is wrong (a later policy), changing the level, teleoperation, deciding where
    nothing is suggested, giving data.
    """

    table: Interventions = field(default_factory=load_interventions)

    def answer(self, belief: Belief, request: Request) -> tuple[Message, ...]:
        """``Confirm``, or the commands of the table as ``Chat``."""
        if request.edge >= 0:
            return (Confirm(request.request),)
        if request.kind != "manual":
            return ()
        waiting = belief.waiting_state(request)
        texts = commands(self.table, belief.machine, belief.visited, belief.helped, waiting)
        return tuple(Chat(text) for text in texts)


POLICIES: dict[str, Callable[[], Policy]] = {
    "supervise": Supervise,
}
"""Name in a scenario to policy."""
