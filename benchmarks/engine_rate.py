"""How fast machines run: ``make bench`` or ``python benchmarks/engine_rate.py``.

Two figures, each on one core, best of some rounds because other work on the machine can only slow a round down:

- transitions a second of the bare engine, which is δ, F, U and the guard, without clock and programs;
- event-only runs of the dish task through the executive on the SimPy clock, with a robot that answers from the table of
  the paper's ten runs. ``--runs 100000`` makes as many; else few are made and the time of 100,000 is reckoned.
"""

from __future__ import annotations

import argparse
import gc
import os
import sys
import time
from collections.abc import Callable, Generator
from typing import Any

import numpy as np
import simpy

from teleop_sim.core.records import Record
from teleop_sim.machines.chances import Chances, draw
from teleop_sim.machines.engine import Engine
from teleop_sim.machines.executive import Executive, Signal, Start
from teleop_sim.machines.src_dish import src_dish
from teleop_sim.machines.src_dish_table2 import table2_chances

TRANSITIONS = 200_000
ROUNDS = 5
BOUND_PER_S = 200_000
RUNS, ALL_RUNS = 2_000, 100_000
BOUND_S = 300.0


class Deaf:
    """An operator who hears nothing; at level full nothing is asked."""

    def transition(self, edge: int) -> None: ...
    def mode(self, mode: str) -> None: ...
    def level(self, level: int) -> None: ...
    def request(self, request: int, kind: str, node: int, edge: int) -> None: ...
    def withdrawn(self, request: int) -> None: ...
    def paused(self, paused: bool) -> None: ...
    def locked(self, node: int, locked: bool) -> None: ...
    def snapshot(self) -> None: ...
    def line(self, text: str) -> None: ...


def through_engine() -> float:
    """Transitions a second: the dish task again and again, with a retry where a state can try again itself."""
    machine, scripts = src_dish(), {}
    for state in (s for s in machine.states if s.program):
        edges = [e for e in machine.outcomes_of(state.name) if e.raised_by == "code"]
        again = [e.event for e in edges if e.kind == "retry" and e.next_state == e.state][:1]
        scripts[state.name] = (*again, next(e.event for e in edges if e.kind == "done"))
    nodes, taken = machine.net.nodes, 0
    started_s = time.process_time()
    while taken < TRANSITIONS:
        engine = Engine(machine, 3)
        while not engine.over():
            path = nodes[engine.configuration.active[0]].path
            for signal in scripts[path]:
                taken += len(engine.signal(path, signal))
    return taken / (time.process_time() - started_s)


def robot(env: simpy.Environment, chances: Chances, rng: np.random.Generator) -> Callable[[Start], simpy.Process]:
    """Programs that answer from a table."""

    def program(path: str) -> Generator[simpy.Event, Any, Signal]:
        found = draw(chances.programs[path], rng)
        yield env.timeout(found.time_s(rng))
        return Signal(found.what)

    return lambda start: env.process(program(start.path))


def one_run(rng: np.random.Generator, emit: Callable[[Record], None]) -> float:
    """One event-only run of the dish task; its simulated time."""
    env = simpy.Environment()
    executive = Executive(env, src_dish(), 3, robot(env, table2_chances(), rng), Deaf(), emit)
    # Not until its process ends: with nobody who answers, a machine in manual mode waits for ever.
    env.process(executive.run())
    env.run()
    return float(env.now)


def through_executive(runs: int) -> tuple[float, float]:
    """Own time of so many runs, and the mean of their simulated times."""
    rng, simulated_s = np.random.default_rng(1), 0.0
    started_s = time.process_time()
    for _ in range(runs):
        simulated_s += one_run(rng, lambda _: None)
    return time.process_time() - started_s, simulated_s / runs


def main() -> None:
    """Print both figures; exit 1 if one misses its bound."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--runs", type=int, default=RUNS, help=f"event-only runs to make (default {RUNS:,})")
    runs = parser.parse_args().runs
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    gc.collect()
    rate = max(through_engine() for _ in range(ROUNDS))
    print(f"bare engine          {rate:10,.0f} transitions/s   bound {BOUND_PER_S:,}")
    took_s, mean_s = through_executive(runs)
    whole_s = took_s * ALL_RUNS / runs
    made = "made" if runs == ALL_RUNS else f"reckoned from {runs:,}"
    print(f"{ALL_RUNS:,} dish runs    {whole_s:10,.1f} s               bound {BOUND_S:,.0f} s   ({made})")
    print(f"  {1e3 * took_s / runs:.3f} ms a run of {mean_s:,.1f} simulated seconds in the mean")
    if rate < BOUND_PER_S or whole_s > BOUND_S:
        sys.exit("slower than the bound")


if __name__ == "__main__":
    main()
