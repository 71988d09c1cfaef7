"""Packet loss: models as frozen parameters, their state (good or bad) passed through. See docs/link.md.

A new model is one class and one line in ``LOSS_MODELS``; the contract tests build it from its ``example``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, Protocol

import numpy as np

from teleop_sim.core.errors import BadInput, Problem


class Loss(Protocol):
    """Whether a packet (or a fragment) is lost on its way. Lost bits have still been sent and paid for."""

    @property
    def mean_loss(self) -> float:
        """Share of packets lost in the long run, 0 to 1."""

    def step(self, bad: bool, rng: np.random.Generator) -> tuple[bool, bool]:
        """Return ``(bad, lost)`` for the next packet; ``bad`` starts as False. Always two uniform draws."""


@dataclass(frozen=True, slots=True)
class NoLoss:
    """Everything arrives."""

    example: ClassVar[Mapping[str, float]] = MappingProxyType({})

    @property
    def mean_loss(self) -> float:
        """Zero."""
        return 0.0

    def step(self, bad: bool, rng: np.random.Generator) -> tuple[bool, bool]:
        """Return ``(bad, False)``."""
        rng.random(2)
        return bad, False


@dataclass(frozen=True, slots=True)
class Bernoulli:
    """Every packet is lost with the same chance, whatever happened before.

    Attributes:
        p: P(loss), in [0, 1).

    Not modelled: bursts; loss that depends on packet size.

    Raises:
        BadInput: ``p`` out of range.

    """

    example: ClassVar[Mapping[str, float]] = MappingProxyType({"p": 0.1})

    p: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.p < 1.0:
            raise BadInput((Problem("p", f"a loss of {self.p}", "Give 0 or more and less than 1."),))

    @property
    def mean_loss(self) -> float:
        """``p``."""
        return self.p

    def step(self, bad: bool, rng: np.random.Generator) -> tuple[bool, bool]:
        """Return ``(bad, lost)`` for the next packet; ``bad`` means nothing here."""
        # Two draws, as the burst model: a sweep over models must not shift the stream.
        _, u_loss = rng.random(2)
        return bad, bool(u_loss < self.p)


@dataclass(frozen=True, slots=True)
class GilbertElliott:
    """Two-state burst loss: packets are lost only in the bad state.

    Attributes:
        p_enter: P(good -> bad) before each packet, in (0, 1].
        p_leave: P(bad -> good), in (0, 1]. Mean stay in the bad state: 1/p_leave [packets].
        p_lose: P(loss | bad), in [0, 1].

    Not modelled: loss in the good state (Elliott's extension), loss that depends on packet size or idle time: the
    state moves with packets, not with time.

    Source: Gilbert, Bell Syst. Tech. J. 39 (1960), 1253-1265. His h, the chance of a correct digit when bad, is
    ``1 - p_lose``; his P and p are ``p_enter`` and ``p_leave``.

    Raises:
        BadInput: with all probabilities that are out of range.

    """

    example: ClassVar[Mapping[str, float]] = MappingProxyType({"p_enter": 0.02, "p_leave": 0.25, "p_lose": 0.9})

    p_enter: float
    p_leave: float
    p_lose: float = 1.0

    def __post_init__(self) -> None:
        found = [
            Problem(name, f"a probability of {p}", "Give above 0, at most 1.")
            for name, p in (("p_enter", self.p_enter), ("p_leave", self.p_leave))
            if not 0.0 < p <= 1.0
        ]
        if not 0.0 <= self.p_lose <= 1.0:
            found.append(Problem("p_lose", f"a probability of {self.p_lose}", "Give 0 to 1."))
        if found:
            raise BadInput(tuple(found))

    @property
    def mean_loss(self) -> float:
        """``p_enter / (p_enter + p_leave) * p_lose``: the chain's stationary share of bad, times the loss there."""
        return self.p_enter / (self.p_enter + self.p_leave) * self.p_lose

    def step(self, bad: bool, rng: np.random.Generator) -> tuple[bool, bool]:
        """Return ``(bad, lost)`` for the next packet."""
        # Two draws always: a sweep over p_lose must not shift the stream.
        u_state, u_loss = rng.random(2)
        bad = bool(u_state >= self.p_leave if bad else u_state < self.p_enter)
        return bad, bool(bad and u_loss < self.p_lose)


LOSS_MODELS: dict[str, type[Loss]] = {
    "none": NoLoss,
    "bernoulli": Bernoulli,
    "gilbert_elliott": GilbertElliott,
}
