"""Jitter: what a packet's delay has more or less than the fixed one. See docs/link.md.

Draws are independent from packet to packet. Whether packets may overtake each other is the direction's ``reorder``.
A new model is one class and one line in ``JITTERS``; the contract tests build it from its ``example``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from statistics import NormalDist
from types import MappingProxyType
from typing import ClassVar, Protocol

import numpy as np

from teleop_sim.core.errors import BadInput, Problem

_NORMAL = NormalDist()
_LEAST_CHANCE = 2.0**-54
"""Half the least uniform draw above zero: the inverse of the normal distribution has no value at zero."""


class Jitter(Protocol):
    """A random part of the delay [s]. It may be negative: a direction cuts delay and jitter together at zero."""

    @property
    def mean_s(self) -> float:
        """Mean in the long run [s]."""

    @property
    def least_s(self) -> float:
        """No draw is below this [s]. With a ``delay_s`` below ``-least_s`` the cut shifts the mean."""

    def scaled(self, factor: float) -> Jitter:
        """The same with every draw times ``factor``, above zero: from one clock to another."""

    def draw_s(self, rng: np.random.Generator) -> float:
        """The jitter of the next packet [s]. Always one uniform draw, so that a sweep does not shift the stream."""


@dataclass(frozen=True, slots=True)
class NoJitter:
    """Every packet takes the fixed delay."""

    example: ClassVar[Mapping[str, object]] = MappingProxyType({})

    @property
    def mean_s(self) -> float:
        """Zero."""
        return 0.0

    @property
    def least_s(self) -> float:
        """Zero."""
        return 0.0

    def scaled(self, factor: float) -> NoJitter:
        """The same."""
        return self

    def draw_s(self, rng: np.random.Generator) -> float:
        """Zero."""
        rng.random()
        return 0.0


@dataclass(frozen=True, slots=True)
class UniformJitter:
    """Anything from ``low_s`` to ``high_s`` alike.

    Raises:
        BadInput: a bound that is not finite, or bounds the wrong way round.

    """

    example: ClassVar[Mapping[str, object]] = MappingProxyType({"low_s": -0.02, "high_s": 0.1})

    low_s: float
    high_s: float

    def __post_init__(self) -> None:
        found = [
            Problem(name, f"a jitter of {value_s} s", "Give a finite time.")
            for name, value_s in (("low_s", self.low_s), ("high_s", self.high_s))
            if not math.isfinite(value_s)
        ]
        if not found and self.low_s > self.high_s:
            found.append(Problem("high_s", f"{self.high_s} s is below low_s = {self.low_s} s", "Swap the bounds."))
        if found:
            raise BadInput(tuple(found))

    @property
    def mean_s(self) -> float:
        """Half way between the bounds [s]."""
        return 0.5 * (self.low_s + self.high_s)

    @property
    def least_s(self) -> float:
        """``low_s``."""
        return self.low_s

    def scaled(self, factor: float) -> UniformJitter:
        """The same with every draw times ``factor``."""
        return UniformJitter(self.low_s * factor, self.high_s * factor)

    def draw_s(self, rng: np.random.Generator) -> float:
        """Uniform between the bounds [s]."""
        # Rounding must not pass the upper bound.
        return min(self.high_s, self.low_s + (self.high_s - self.low_s) * float(rng.random()))


@dataclass(frozen=True, slots=True)
class NormalJitter:
    """Normal about zero; what would lie beyond ``±clip_s`` is put there.

    Attributes:
        sd_s: standard deviation before clipping [s], zero or more.
        clip_s: greatest size [s], zero or more. Clipping at both ends keeps the mean at zero.

    Raises:
        BadInput: with all that is not a finite time of zero or more.

    """

    example: ClassVar[Mapping[str, object]] = MappingProxyType({"sd_s": 0.05, "clip_s": 0.1})

    sd_s: float
    clip_s: float

    def __post_init__(self) -> None:
        found = tuple(
            Problem(name, f"{value_s} s", "Give a finite time, zero or more.")
            for name, value_s in (("sd_s", self.sd_s), ("clip_s", self.clip_s))
            if not (math.isfinite(value_s) and value_s >= 0.0)
        )
        if found:
            raise BadInput(found)

    @property
    def mean_s(self) -> float:
        """Zero."""
        return 0.0

    @property
    def least_s(self) -> float:
        """``-clip_s``."""
        return -self.clip_s

    def scaled(self, factor: float) -> NormalJitter:
        """The same with every draw times ``factor``."""
        return NormalJitter(self.sd_s * factor, self.clip_s * factor)

    def draw_s(self, rng: np.random.Generator) -> float:
        """Normal by inversion, clipped [s]."""
        z = _NORMAL.inv_cdf(max(_LEAST_CHANCE, float(rng.random())))
        return max(-self.clip_s, min(self.clip_s, self.sd_s * z))


@dataclass(frozen=True, slots=True)
class EmpiricalJitter:
    """One of the measured values, each alike, independent of the one before.

    Attributes:
        samples_s: measured delays less the fixed delay [s], at least one.

    Not modelled: the order in which they were measured.

    Raises:
        BadInput: no sample, or with every sample that is not finite.

    """

    example: ClassVar[Mapping[str, object]] = MappingProxyType({"samples_s": (0.0, 0.01, 0.01, 0.5)})

    samples_s: tuple[float, ...]

    def __post_init__(self) -> None:
        found = [
            Problem(f"samples_s[{i}]", f"a jitter of {value_s} s", "Give a finite time.")
            for i, value_s in enumerate(self.samples_s)
            if not math.isfinite(value_s)
        ]
        if not self.samples_s:
            found.append(Problem("samples_s", "no sample", "Give at least one."))
        if found:
            raise BadInput(tuple(found))

    @property
    def mean_s(self) -> float:
        """Mean of the samples [s]."""
        return math.fsum(self.samples_s) / len(self.samples_s)

    @property
    def least_s(self) -> float:
        """The least sample [s]."""
        return min(self.samples_s)

    def scaled(self, factor: float) -> EmpiricalJitter:
        """The same with every draw times ``factor``."""
        return EmpiricalJitter(tuple(value_s * factor for value_s in self.samples_s))

    def draw_s(self, rng: np.random.Generator) -> float:
        """A sample [s]."""
        return self.samples_s[int(rng.random() * len(self.samples_s))]


JITTERS: dict[str, type[Jitter]] = {
    "none": NoJitter,
    "uniform": UniformJitter,
    "normal": NormalJitter,
    "empirical": EmpiricalJitter,
}
