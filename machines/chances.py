"""What may happen in a machine, as a table: what programs return and people answer, how likely and after how long.

It stands in for robot and crew where nothing is simulated: in the absorbing Markov chain (``markov``) and in runs of a
robot that answers from a table. Every attempt is drawn anew: that an attempt fails more often after a failure, or the
later the hour, is not modelled.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from teleop_sim.core.errors import BadInput, Problem, unknown_name
from teleop_sim.machines.declare import FELL, Machine
from teleop_sim.machines.elements import State
from teleop_sim.machines.sync import REQUEST_KINDS

CONFIRM, REJECT = "confirm", "reject"
"""Answers to a suggestion. Any other answer is the event that is forced."""

_ROUNDING = 1e-9
"""How far chances may be from one: what adding a few dozen floats can lose, with room."""


@dataclass(frozen=True, slots=True)
class Alternative:
    """One thing that may come of an attempt or of a request.

    Attributes:
        what: a program's signal; of a person ``confirm``, ``reject`` or an event to be forced.
        chance: of it, 0 to 1.
        mean_s: mean time until it comes [s].
        sd_s: standard deviation of that time [s]; 0: it is fixed.

    """

    what: str
    chance: float
    mean_s: float = 0.0
    sd_s: float = 0.0

    @property
    def square_s2(self) -> float:
        """Mean of the squared time [s²]."""
        return self.mean_s**2 + self.sd_s**2

    def time_s(self, rng: np.random.Generator) -> float:
        """A time drawn from the gamma distribution with this mean and deviation: exponential where both are equal.

        The distribution is assumed; expectations do not depend on it.
        """
        if not self.sd_s:
            return self.mean_s
        shape = (self.mean_s / self.sd_s) ** 2
        return float(rng.gamma(shape, self.mean_s / shape))


Alternatives = tuple[Alternative, ...]


@dataclass(frozen=True)
class Chances:
    """What programs return and what people answer.

    Attributes:
        programs: by path of the state; ``!fell`` is a signal of every program.
        answers: by kind of request (``confirm``, ``manual``, ``decide``) and path of what asks; an empty path is
            for all that are not named. Where nothing is given, nobody answers.

    """

    programs: Mapping[str, Alternatives]
    answers: Mapping[tuple[str, str], Alternatives] = field(default_factory=dict)

    def answers_to(self, kind: str, path: str) -> Alternatives:
        """What people answer to a request; empty if nobody does."""
        return self.answers.get((kind, path), self.answers.get((kind, ""), ()))


ALWAYS_CONFIRMS: Mapping[tuple[str, str], Alternatives] = {("confirm", ""): (Alternative(CONFIRM, 1.0),)}
"""People who let every suggestion pass at once and give no other help."""


def draw(alternatives: Alternatives, rng: np.random.Generator) -> Alternative:
    """One of them, by one uniform number."""
    u, total = rng.random(), 0.0
    for alternative in alternatives:
        total += alternative.chance
        if u < total:
            return alternative
    return alternatives[-1]


def refuse_bad_chances(machine: Machine, chances: Chances) -> None:
    """Raise ``BadInput`` with everything in the table that does not fit the machine or is no chance."""
    found = tuple(chance_problems(machine, chances))
    if found:
        raise BadInput(found)


def chance_problems(machine: Machine, chances: Chances) -> Iterator[Problem]:
    """Unknown states, signals and kinds; chances that do not add up to one; times that are none."""
    at = f"chances of machine {machine.name}"
    programs = tuple(n.path for n in machine.net.nodes if isinstance(n.element, State) and n.element.program)
    for path, alternatives in chances.programs.items():
        if path not in programs:
            yield unknown_name(f"{at}: state with a program", path, programs)
            continue
        known = (*(e.event for e in machine.outcomes_of(path)), *(r.signal for r in machine.leaf(path).rows), FELL)
        yield from _alternatives(f"{at}: {path}", alternatives, known)
    for (kind, path), alternatives in chances.answers.items():
        where = f"{at}: answers to {kind} {path}".rstrip()
        if kind not in REQUEST_KINDS[:3]:
            yield unknown_name(f"{at}: kind of request", kind, REQUEST_KINDS[:3])
        elif path and path not in machine.state_names:
            yield unknown_name(f"{at}: answers to {kind}", path, machine.state_names)
        else:
            events = tuple(e.event for e in machine.outcomes_of(path)) if path else machine.events
            yield from _alternatives(where, alternatives, (*events, *((CONFIRM, REJECT) if kind != "manual" else ())))


def _alternatives(where: str, alternatives: Alternatives, known: tuple[str, ...]) -> Iterator[Problem]:
    for a in alternatives:
        if a.what not in known:
            yield unknown_name(f"{where}: outcome", a.what, known)
        if not 0.0 <= a.chance <= 1.0:
            yield Problem(f"{where}: {a.what}", f"chance {a.chance}", "Give 0 to 1.")
        # Not by ``<``: what is no number is refused too.
        if not (0.0 <= a.mean_s < math.inf and 0.0 <= a.sd_s < math.inf) or (a.sd_s and not a.mean_s):
            what = f"time {a.mean_s} s, deviation {a.sd_s} s"
            yield Problem(f"{where}: {a.what}", what, "Give finite times, zero or more; only a positive one can vary.")
    total = sum(a.chance for a in alternatives)
    if not abs(total - 1.0) < _ROUNDING:
        yield Problem(where, f"the chances add up to {total:.9g}", "They must add up to 1.")
