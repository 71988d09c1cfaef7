"""When a direction is dark: models that draw a schedule of blackouts for a run. See docs/link.md.

The sender knows the schedule, so it is drawn once, before the run. A longer run of the same stream sees the same dark
as a shorter one, and more of it. A new model is one class and one line in ``DARK_MODELS``; the contract tests build it
from its ``example``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, Protocol

import numpy as np

from teleop_sim.channel.blackouts import Schedule, schedule_problems
from teleop_sim.core.errors import BadInput, Problem


class DarkModel(Protocol):
    """Where the blackouts of a run come from."""

    def windows(self, until_s: float, rng: np.random.Generator) -> Schedule:
        """Blackouts within a run of ``until_s``: in order, none overlapping, none beyond 0 to ``until_s``.

        Raises:
            BadInput: ``until_s`` is no finite time of zero or more.

        """


@dataclass(frozen=True, slots=True)
class Scheduled:
    """Blackouts at given times.

    Attributes:
        blackouts: ``(start_s, end_s)``, in order and apart; the last end may be ``inf``.

    Raises:
        BadInput: with all problems of the schedule.

    """

    example: ClassVar[Mapping[str, object]] = MappingProxyType({"blackouts": ((10.0, 20.0), (400.0, math.inf))})

    blackouts: Schedule

    def __post_init__(self) -> None:
        _refuse(*schedule_problems(self.blackouts, "blackouts"))

    def windows(self, until_s: float, rng: np.random.Generator) -> Schedule:
        """The given blackouts, cut at ``until_s``. Draws nothing."""
        return _clipped(iter(self.blackouts), until_s)


@dataclass(frozen=True, slots=True)
class Periodic:
    """Dark for ``dark_s`` every ``period_s``.

    Attributes:
        period_s: from the start of a blackout to the start of the next.
        dark_s: length of each, above zero and below the period.
        first_s: start of the first, zero or more.

    Raises:
        BadInput: with all that is out of range.

    """

    example: ClassVar[Mapping[str, object]] = MappingProxyType({"period_s": 60.0, "dark_s": 20.0, "first_s": 30.0})

    period_s: float
    dark_s: float
    first_s: float

    def __post_init__(self) -> None:
        found = [*_positive(period_s=self.period_s, dark_s=self.dark_s)]
        if not found and self.dark_s >= self.period_s:
            what = f"{self.dark_s} s of dark in a period of {self.period_s} s leave no light"
            found.append(Problem("dark_s", what, "Give less than period_s."))
        if not (math.isfinite(self.first_s) and self.first_s >= 0.0):
            found.append(Problem("first_s", f"a first blackout at {self.first_s} s", "Give zero or later."))
        _refuse(*found)

    def windows(self, until_s: float, rng: np.random.Generator) -> Schedule:
        """Blackouts from ``first_s + k * period_s``. Draws nothing."""
        return _clipped(self._endless(), until_s)

    def _endless(self) -> Iterator[tuple[float, float]]:
        k = 0
        while True:
            # Multiplied, not added up: rounding does not grow with the run.
            start_s = self.first_s + k * self.period_s
            yield start_s, start_s + self.dark_s
            k += 1


@dataclass(frozen=True, slots=True)
class RandomGaps:
    """Light and dark in turn, each of a random length: exponential, light first.

    Attributes:
        mean_light_s: mean length of a time of light, above zero.
        mean_dark_s: mean length of a blackout, above zero.

    Share of light in the long run: ``mean_light_s / (mean_light_s + mean_dark_s)``. That lengths are exponential
    (a two-state Markov process) and that a run begins in the light is assumed.

    Raises:
        BadInput: with all that is not above zero.

    """

    example: ClassVar[Mapping[str, object]] = MappingProxyType({"mean_light_s": 50.0, "mean_dark_s": 5.0})

    mean_light_s: float
    mean_dark_s: float

    def __post_init__(self) -> None:
        _refuse(*_positive(mean_light_s=self.mean_light_s, mean_dark_s=self.mean_dark_s))

    def windows(self, until_s: float, rng: np.random.Generator) -> Schedule:
        """A drawn schedule. Two draws a blackout."""
        return _clipped(self._endless(rng), until_s)

    def _endless(self, rng: np.random.Generator) -> Iterator[tuple[float, float]]:
        t_s = 0.0
        while True:
            start_s = t_s + float(rng.exponential(self.mean_light_s))
            t_s = start_s + float(rng.exponential(self.mean_dark_s))
            yield start_s, t_s


@dataclass(frozen=True, slots=True)
class DrcFinals:
    """The DARPA Robotics Challenge Finals, indoors: bursts with random gaps, until the blackouts end for good.

    Attributes:
        on_s: length of a burst of light, above zero.
        off_s: least and greatest gap, whole seconds from 1 on, uniform, both included.
        ends_after_s: from here on it stays light; ``inf``: never.

    Source: JSK, mini_maxwell/drc_2015_environment.py and their network notes: 1 s on, 1 to 30 s off. That the gaps end
    after 2700 s is remembered, not checked; that a run begins with a burst is assumed.

    Raises:
        BadInput: with all that is out of range.

    """

    example: ClassVar[Mapping[str, object]] = MappingProxyType({"ends_after_s": 450.0})

    on_s: float = 1.0
    off_s: tuple[int, int] = (1, 30)
    ends_after_s: float = 2700.0

    def __post_init__(self) -> None:
        found = [*_positive(on_s=self.on_s)]
        least_s, most_s = self.off_s
        if not (all(float(off_s).is_integer() for off_s in self.off_s) and 1 <= least_s <= most_s):
            found.append(
                Problem("off_s", f"gaps of {least_s} to {most_s} s", "Give whole seconds from 1 on, in order.")
            )
        if not self.ends_after_s >= 0.0:
            found.append(Problem("ends_after_s", f"an end at {self.ends_after_s} s", "Give zero or later."))
        _refuse(*found)

    @property
    def duty(self) -> float:
        """Share of light while the gaps last: ``on / (on + mean gap)``; 1 / (1 + 15.5) = 2/33."""
        return self.on_s / self._cycle_s()

    @property
    def mean_wait_s(self) -> float:
        """Mean wait for light of an arrival at a random time, while the gaps last [s]; 9.55 s.

        An arrival falls into a given gap of length G with a chance proportional to G and then waits G/2 on average
        (the residual life of renewal theory); in a burst it waits nothing. Per cycle of mean ``on + E[G]`` that is
        ``E[G^2] / (2 (on + E[G]))``. For whole seconds from 1 to 30, E[G] = 15.5 and E[G^2] = 31 * 61 / 6 = 315.17:
        315.17 / 33 = 9.55 s. (Cox, Renewal Theory, 1962, section 5.)
        """
        least_s, most_s = self.off_s
        mean_s = 0.5 * (least_s + most_s)
        variance_s2 = ((most_s - least_s + 1) ** 2 - 1) / 12.0
        return (variance_s2 + mean_s**2) / (2.0 * self._cycle_s())

    def windows(self, until_s: float, rng: np.random.Generator) -> Schedule:
        """A drawn schedule, cut at ``ends_after_s``. One draw a gap."""
        return _clipped(self._endless(rng), until_s, self.ends_after_s)

    def _cycle_s(self) -> float:
        return self.on_s + 0.5 * (self.off_s[0] + self.off_s[1])

    def _endless(self, rng: np.random.Generator) -> Iterator[tuple[float, float]]:
        t_s = 0.0
        while True:
            start_s = t_s + self.on_s
            t_s = start_s + float(rng.integers(*self.off_s, endpoint=True))
            yield start_s, t_s


@dataclass(frozen=True, slots=True)
class Passes:
    """Light only in given contact windows, as when a relay passes overhead or a team gets its minutes.

    Attributes:
        contacts: ``(start_s, end_s)`` of light, at least one, in order and apart; the last end may be ``inf``.

    Not modelled: where contacts come from (orbits, elevation masks) and a rate that changes with the range.

    Raises:
        BadInput: with all problems of the contacts.

    """

    example: ClassVar[Mapping[str, object]] = MappingProxyType({"contacts": ((20.0, 60.0), (300.0, 330.0))})

    contacts: Schedule

    def __post_init__(self) -> None:
        found = [_as_contact(p) for p in schedule_problems(self.contacts, "contacts")]
        if not self.contacts:
            found.append(Problem("contacts", "no contact: nothing would ever arrive", "Give at least one."))
        _refuse(*found)

    def windows(self, until_s: float, rng: np.random.Generator) -> Schedule:
        """What lies between the contacts, before and after them, cut at ``until_s``. Draws nothing."""
        return _clipped(self._between(), until_s)

    def _between(self) -> Iterator[tuple[float, float]]:
        t_s = 0.0
        for start_s, end_s in self.contacts:
            yield t_s, start_s
            t_s = end_s
        yield t_s, math.inf


DARK_MODELS: dict[str, type[DarkModel]] = {
    "scheduled": Scheduled,
    "periodic": Periodic,
    "random_gaps": RandomGaps,
    "drc_finals": DrcFinals,
    "passes": Passes,
}


def _clipped(windows: Iterator[tuple[float, float]], until_s: float, ends_s: float = math.inf) -> Schedule:
    """What of ordered ``windows`` lies before ``until_s`` and ``ends_s``, without windows that have no length."""
    if not (math.isfinite(until_s) and until_s >= 0.0):
        _refuse(Problem("until_s", f"a run of {until_s} s", "Give a finite time, zero or more."))
    last_s = min(until_s, ends_s)
    kept: list[tuple[float, float]] = []
    for start_s, end_s in windows:
        if start_s >= last_s:
            break
        if end_s > start_s:
            kept.append((start_s, min(end_s, last_s)))
    return tuple(kept)


def _positive(**times_s: float) -> Iterator[Problem]:
    for name, value_s in times_s.items():
        if not (math.isfinite(value_s) and value_s > 0.0):
            yield Problem(name, f"{value_s} s", "Give a finite time above zero.")


def _as_contact(problem: Problem) -> Problem:
    reworded = (text.replace("blackout", "contact") for text in (problem.what, problem.hint))
    return Problem(problem.where, *reworded)


def _refuse(*found: Problem) -> None:
    if found:
        raise BadInput(tuple(found))
