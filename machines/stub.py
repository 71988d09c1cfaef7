"""Robots and crews that answer from a table: machines run where nothing is simulated.

``drive.drive`` runs them without a clock; ``starter`` gives a robot to the executive, as SimPy processes.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import simpy

from teleop_sim.machines.chances import CONFIRM, Chances, draw
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.running import StartProgram
from teleop_sim.machines.visits import Signal, Start
from teleop_sim.machines.ways import way


@dataclass(frozen=True, slots=True)
class Reply:
    """What comes of an attempt or of a request.

    Attributes:
        what: a program's signal; of a person ``confirm``, ``reject`` or an event to be forced.
        time_s: time until it comes [s].
        writes: values of keys, by the program's own names.

    """

    what: str
    time_s: float = 0.0
    writes: Mapping[str, object] = field(default_factory=dict)


Robot = Callable[[str, str], Reply]
"""(path of the state, its program) -> what the attempt gives."""

Crew = Callable[[str, str, str], Reply | None]
"""(kind of request, path, suggested event) -> the answer; None: nobody answers."""


class Scripted:
    """A robot that answers from fixed sequences; the last reply of one is given again and again.

    Args:
        script: by path of a state or, where its path is not named, by its program.
        otherwise: asked for everything else.

    """

    def __init__(self, script: Mapping[str, Sequence[Reply]], otherwise: Robot) -> None:
        self._script, self._otherwise = script, otherwise
        self._given: dict[str, int] = {}

    def __call__(self, path: str, program: str) -> Reply:
        """The next reply of the state."""
        replies = self._script.get(path) or self._script.get(program)
        if not replies:
            return self._otherwise(path, program)
        place = self._given.get(path, 0)
        self._given[path] = place + 1
        return replies[min(place, len(replies) - 1)]


def nominal_robot(machine: Machine, time_s: float = 0.0) -> Robot:
    """A robot all of whose attempts succeed: they take ``time_s`` each and go the shortest ``way``."""
    events = way(machine)
    return lambda path, _: Reply(events[path], time_s)


def drawn_robot(chances: Chances, rng: np.random.Generator) -> Robot:
    """A robot whose every attempt is drawn from a table by path."""

    def answer(path: str, _: str) -> Reply:
        drawn = draw(chances.programs[path], rng)
        return Reply(drawn.what, drawn.time_s(rng))

    return answer


def drawn_crew(chances: Chances, rng: np.random.Generator) -> Crew:
    """People whose every answer is drawn; they give none where the table has none."""

    def answer(kind: str, path: str, _: str) -> Reply | None:
        alternatives = chances.answers_to(kind, path)
        if not alternatives:
            return None
        drawn = draw(alternatives, rng)
        return Reply(drawn.what, drawn.time_s(rng))

    return answer


def confirming_crew(machine: Machine, choices: Mapping[str, str] | None = None, time_s: float = 0.0) -> Crew:
    """People who confirm every outcome and choose, where they are asked, the shortest ``way``.

    Args:
        machine: what runs.
        choices: other choices, by path of the state that asks.
        time_s: what each answer takes [s].

    """
    events = way(machine) | dict(choices or {})
    return lambda kind, path, _: Reply(CONFIRM if kind == "confirm" else events[path], time_s)


def absent_crew(kind: str, path: str, suggested: str) -> None:
    """Nobody answers."""


def starter(env: simpy.Environment, robot: Robot) -> StartProgram:
    """The robot for an ``Executive``: each attempt is a process that ends when the reply comes, or is interrupted.

    Operators are asked for no data: the reply says what they would have answered.
    """

    def work(reply: Reply) -> Generator[simpy.Event, Any, Signal]:
        try:
            yield env.timeout(reply.time_s)
        except simpy.Interrupt as stop:
            return Signal("", f"at rest: {stop.cause}")
        return Signal(reply.what, "", reply.writes)

    def start(program: Start) -> simpy.Process:
        return env.process(work(robot(program.path, program.program)))

    return start
