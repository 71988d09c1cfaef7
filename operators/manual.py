"""What a person can do by hand in lieu of a state, and the by-eye movements of a hand (move and wait).

A layer of control below the behaviour is a source of movements: ``template`` asks for what a template offers, such as
its grasp or its affordance; ``teleoperation`` moves the hand itself. Each movement is one message; after it the person
waits for a new view (``worker.py``) before deciding on the next.

Source: W. R. Ferrell, Remote manipulation with transmission delay, IEEE Trans. HFE 6 (1965), 24-32: with delay people
move open-loop and wait, so that T = T0 + N (delay + reaction), with N movements (remembered, not checked).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from teleop_sim.channel.messages import Chat, Message
from teleop_sim.channel.vocabulary import NudgeHand, Side, format_chat
from teleop_sim.operators.belief import Belief

Offset = tuple[float, float, float]
Eye = Callable[[Belief, str], Offset | None]
"""From what has arrived, and a state: where the hand should go from where it is, pelvis frame [m]; None: unseen."""

LAYERS = ("template", "teleoperation")
"""Below the behaviour, upper first."""


class Manual(Protocol):
    """What can be done by hand."""

    def layers(self, belief: Belief, state: str, /) -> tuple[str, ...]:
        """Layers that have something for a state, upper first."""
        ...

    def move(self, belief: Belief, state: str, layer: str, step: int, rng: np.random.Generator, /) -> Message | None:
        """The next movement; None: it is done, as far as can be seen."""
        ...


@dataclass(frozen=True)
class Nothing:
    """Nothing can be done by hand."""

    def layers(self, _belief: Belief, _state: str, /) -> tuple[str, ...]:
        """None."""
        return ()

    def move(
        self, _belief: Belief, _state: str, _layer: str, _step: int, _rng: np.random.Generator, /
    ) -> Message | None:
        """None."""
        return None


@dataclass(frozen=True)
class ByEye:
    """Cartesian teleoperation: open-loop movements towards where the goal is seen.

    Attributes:
        eye: where the goal is seen.
        side: which hand.
        tolerance_m: near enough (assumed: what a grasp bears).
        longest_m: of one movement (assumed: no more is risked unseen).
        error: standard deviation of what a movement is wrong by, in each direction, over its length (assumed).
        most: movements before the person gives up (assumed).

    Not modelled: turning the hand; judging one's own error.

    """

    eye: Eye
    side: Side = "right"
    tolerance_m: float = 0.01
    longest_m: float = 0.1
    error: float = 0.1
    most: int = 30

    def layers(self, belief: Belief, state: str, /) -> tuple[str, ...]:
        """Teleoperation, where the goal is seen."""
        return ("teleoperation",) if self.eye(belief, state) is not None else ()

    def move(self, belief: Belief, state: str, _layer: str, step: int, rng: np.random.Generator, /) -> Message | None:
        """A nudge towards the goal."""
        noise, offset = rng.standard_normal(3), self.eye(belief, state)
        if offset is None or math.hypot(*offset) <= self.tolerance_m or step >= self.most:
            return None
        wanted = np.array(offset) * min(1.0, self.longest_m / math.hypot(*offset))
        x, y, z = (round(float(v), 3) for v in wanted + self.error * np.linalg.norm(wanted) * noise)
        return Chat(format_chat(NudgeHand(self.side, "pelvis", x, y, z)))
