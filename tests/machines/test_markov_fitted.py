"""A table fitted to the records of runs is the table that they were made with."""

from __future__ import annotations

import math
from collections.abc import Generator
from typing import Any

import numpy as np
import pytest
import simpy

from teleop_sim.core.records import Record
from teleop_sim.machines.chances import CONFIRM, FELL, Alternative, Chances, draw
from teleop_sim.machines.declare import Counter, Edge, Machine, Row, State
from teleop_sim.machines.executive import Executive, Signal, Start
from teleop_sim.machines.fitted import fit, signals_of
from teleop_sim.machines.markov import forecast
from teleop_sim.machines.src_dish import src_dish

MACHINE = Machine(
    name="try",
    start="look",
    states=(
        State("look", "look"),
        State("grip", "grip", (Row("bad", (Counter(2, "bad"),), "off"),)),
        State("help", manual=True),
        State("end"),
    ),
    edges=(
        Edge("look", "seen", "grip", 2),
        Edge("look", "nothing", "look", 0, "retry"),
        Edge("grip", "held", "end", 0),
        Edge("grip", "bad", "look", 0, "retry"),
        Edge("grip", "off", "help", 0, "failed"),
        Edge("help", "again", "look", 3, "command", "operator"),
        Edge("help", "stop", "end", 3, "command", "operator"),
    ),
    ends=frozenset({"end"}),
)

TABLE = Chances(
    {
        "look": (Alternative("seen", 0.75, 4.0, 1.0), Alternative("nothing", 0.25, 6.0)),
        "grip": (Alternative("held", 0.4, 8.0, 2.0), Alternative("bad", 0.55, 5.0, 5.0), Alternative(FELL, 0.05, 3.0)),
    },
    {
        ("confirm", "look"): (Alternative(CONFIRM, 1.0, 12.0, 3.0),),
        ("manual", "help"): (Alternative("again", 0.7, 20.0, 4.0), Alternative("stop", 0.3, 9.0)),
    },
)


class Crew:
    """People who answer from the table."""

    def __init__(self, env: simpy.Environment, rng: np.random.Generator) -> None:
        self.env, self.rng, self.executive = env, rng, None

    def request(self, request: int, kind: str, node: int, _edge: int) -> None:
        self.env.process(self.answer(request, kind, MACHINE.net.nodes[node].path))

    def answer(self, request: int, kind: str, path: str) -> Generator[simpy.Event, Any, None]:
        found = draw(TABLE.answers_to(kind, path), self.rng)
        yield self.env.timeout(found.time_s(self.rng))
        if found.what == CONFIRM:
            self.executive.confirm(request)
        else:
            self.executive.force(found.what, path)

    def __getattr__(self, name: str) -> Any:
        return lambda *_: None


def records(runs: int, rng: np.random.Generator) -> tuple[list[Record], list[float]]:
    written: list[Record] = []
    times_s = []
    for _ in range(runs):
        env = simpy.Environment()
        crew = Crew(env, rng)

        def program(path: str, env: simpy.Environment = env) -> Generator[simpy.Event, Any, Signal]:
            found = draw(TABLE.programs[path], rng)
            yield env.timeout(found.time_s(rng))
            return Signal(found.what)

        def start(start: Start, env: simpy.Environment = env, program: Any = program) -> simpy.Process:
            return env.process(program(start.path))

        crew.executive = Executive(env, MACHINE, 2, start, crew, written.append)
        env.run(env.process(crew.executive.run()))
        times_s.append(float(env.now))
    return written, times_s


def test_what_is_fitted_is_the_table_within_its_standard_error():
    written, times_s = records(1_500, np.random.default_rng(3))
    fitted = fit(MACHINE, written)
    given = {("program", path): table for path, table in TABLE.programs.items()} | dict(TABLE.answers)
    found = {("program", path): table for path, table in fitted.chances.programs.items()} | dict(fitted.chances.answers)
    assert found.keys() == given.keys()
    for of, table in given.items():
        by_what = {a.what: a for a in found[of]}
        assert sum(a.chance for a in found[of]) == pytest.approx(1.0)
        for alternative in table:
            # Of sixteen figures, one or two lie outside two standard errors, and outside four one in a thousand times.
            n, seen = fitted.counts[of][alternative.what], by_what[alternative.what]
            assert abs(seen.chance - alternative.chance) <= 4 * fitted.error(of, alternative.what)
            assert abs(seen.mean_s - alternative.mean_s) <= 4 * alternative.sd_s / math.sqrt(n) + 1e-9
    assert fitted.shared == ()
    # And so the chain says of what was fitted nearly what the runs took: both are of the same draws.
    assert forecast(MACHINE, fitted.chances, 2).time_s.value == pytest.approx(
        np.mean(times_s), abs=4 * np.std(times_s) / math.sqrt(len(times_s))
    )


def test_signals_behind_an_event():
    machine = src_dish()
    assert signals_of(machine, "STATE_INIT", "/INIT_FAILED") == ("/INIT_RETRY",)
    assert signals_of(machine, "STATE_INIT", "/REGULAR") == ("/REGULAR",)
    both = signals_of(machine, "STATE_CORRECT_YAW", "/YAW_CORRECTION_RETRY")
    assert both == ("/YAW_CORRECTION_RETRY", "!timed_out", "!pitch_disturbed")
