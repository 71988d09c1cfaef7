"""Fall back a layer when a behaviour fails, and hand control back to it afterwards."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from teleop_sim.channel.messages import Force, HandBack, Message, Request, TakeOver
from teleop_sim.operators.acts import Briefing
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.policies import Supervise

AGAIN_S = 30.0
"""Beyond the round trip, before the crew asks again to take a state over (assumed: a person's patience)."""


@dataclass(frozen=True)
class StepDown(Supervise):
    """As ``Supervise``, until a state fails repeatedly: then a person does it instead, a layer lower each time.

    The first time by the upper layer that has something for the state (``manual.LAYERS``), then by the next; when it is
    done the state's outcome is forced and the behaviour goes on. If nothing can be done the state is handed back, to
    begin anew. A state for which no layer is left is left to the behaviour.

    Attributes:
        after: failures in a row, that which is suggested included (assumed).
        stale_after_s: an older view is not acted on by hand (assumed).

    Source of the cascade: A. Romay et al., section 6.1.1 (ViGIR's door on day one).

    """

    after: int = 2
    stale_after_s: float = 10.0

    def answer(self, belief: Belief, request: Request) -> tuple[Message, ...]:
        """``TakeOver`` instead of confirming another failure; ``Force`` when it was done by hand, else ``HandBack``."""
        if request.kind == "act":
            return (self._outcome(belief, request) if belief.moves.get(request.request) else HandBack(request.request),)
        if request.kind == "confirm":
            edge = belief.machine.table[request.edge]
            fails = belief.failed.get(edge.state, 0) + 1
            if edge.kind in ("failed", "retry") and fails >= self.after and self._layer(belief, edge.state):
                return (TakeOver(request.node),)
        return super().answer(belief, request)

    def advise(self, belief: Belief, now_s: float, briefing: Briefing, /) -> tuple[Message, ...]:
        """``TakeOver`` of a state that has failed too often and is at work again."""
        if not belief.failed:
            return ()
        busy = {asked.node for asked in belief.mirror.asked}
        for state in belief.mirror.states:
            node = belief.machine.net.by_path[state]
            tired = belief.failed.get(state, 0) >= self.after and node not in busy
            if tired and self._layer(belief, state) and not self._lately(belief, TakeOver(node), now_s, briefing):
                return (TakeOver(node),)
        return ()

    def wake_s(self, belief: Belief, now_s: float, briefing: Briefing, /) -> float:
        """When taking over may be asked for again."""
        sent_s, _ = belief.sent.get(TakeOver.topic, (-math.inf, None))
        again_s = sent_s + briefing.round_trip_s + AGAIN_S
        return again_s if again_s > now_s else math.inf

    def move(self, belief: Belief, request: Request, step: int, rng: np.random.Generator, /) -> Message | None:
        """The next movement of the layer that has its turn."""
        state = belief.path_of(request)
        layer = self._layer(belief, state)
        return self.manual.move(belief, state, layer, step, rng) if layer else None

    def stale_s(self, request: Request, /) -> float:
        """What is done by hand needs a fresh view."""
        return self.stale_after_s if request.kind == "act" else math.inf

    def _layer(self, belief: Belief, state: str) -> str:
        """The layer that has its turn; empty: none is left."""
        left = self.manual.layers(belief, state)[belief.in_lieu.get(state, 0) :]
        return left[0] if left else ""

    def _outcome(self, belief: Belief, request: Request) -> Message:
        state = belief.path_of(request)
        done = next((e for e in belief.machine.outcomes_of(state) if e.kind == "done"), None)
        if done is None:
            return HandBack(request.request)
        return Force(belief.machine.edge_index(state, done.event), belief.mirror.seen)

    def _lately(self, belief: Belief, message: Message, now_s: float, briefing: Briefing) -> bool:
        sent_s, sent = belief.sent.get(message.topic, (-math.inf, None))
        return sent == message and now_s < sent_s + briefing.round_trip_s + AGAIN_S
