"""The chain against runs of the bare engine, and against mass that is pushed through copies of the engine."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.machines.chances import FELL, Alternative, Chances, draw
from teleop_sim.machines.counts import Variables
from teleop_sim.machines.declare import Counter, Edge, Group, Machine, Row, State
from teleop_sim.machines.engine import Engine
from teleop_sim.machines.markov import Figure, forecast
from teleop_sim.machines.remembered import NOTHING, Counted, Memory
from teleop_sim.machines.src_dish import src_dish
from teleop_sim.machines.src_dish_table2 import table2_chances

Z99 = 2.5758
"""Half width of the 99 % interval of a mean, in standard errors."""


@dataclass(frozen=True)
class Run:
    time_s: float
    visits: dict[str, int]
    manual: bool
    completed: bool


def run(machine: Machine, chances: Chances, level: int, rng: np.random.Generator) -> Run:
    """One event-only run on the engine; people confirm, or force what the table says. One state at a time."""
    engine, nodes = Engine(machine, level), machine.net.nodes
    time_s, visits, manual, command = 0.0, dict.fromkeys(machine.state_names, 0), False, False
    while not engine.over():
        path = nodes[engine.configuration.active[0]].path
        manual |= engine.mode() == "manual"
        helped = machine.leaf(path).manual
        alternatives = chances.answers_to("manual", path) if helped else chances.programs[path]
        if not alternatives:
            return Run(time_s, visits, manual, False)
        found = draw(alternatives, rng)
        time_s += found.time_s(rng)
        if found.what == FELL:
            return Run(time_s, visits, manual, False)
        signal = "" if helped else found.what
        edge = machine.edge_index(path, found.what) if helped else engine.trigger(path, signal)
        while edge >= 0:
            if not helped and not engine.passes(edge):
                time_s += draw(chances.answers_to("confirm", machine.table[edge].state), rng).time_s(rng)
            visits[machine.table[edge].state] += 1
            command = machine.table[edge].kind == "command"
            edge, signal = engine.take(edge, signal).raised, ""
    return Run(time_s, visits, manual, not command)


def within(figure: Figure, seen: list[float]) -> bool:
    """Does the figure lie in the 99 % interval of the mean?"""
    return abs(np.mean(seen) - figure.value) <= Z99 * np.std(seen) / math.sqrt(len(seen)) + figure.error


def within_counts(figure: Figure, seen: list[int] | list[bool]) -> bool:
    """As ``within`` for what is counted; what is seen too seldom for a deviation may be off by one count."""
    return within(Figure(figure.low - 1 / len(seen), figure.high + 1 / len(seen)), [float(n) for n in seen])


def harsh(p: float) -> Chances:
    """The dish task with everything that can fail failing often; each time somebody looks again, or gives up."""
    machine, programs = src_dish(), {}
    for state in (s for s in machine.states if s.program):
        edges = [e for e in machine.outcomes_of(state.name) if e.raised_by == "code"]
        good = [e.event for e in edges if e.kind == "done"]
        bad = list(dict.fromkeys((*(r.signal for r in state.rows), *(e.event for e in edges if e.kind == "retry"))))
        fails = p if bad else 0.0
        programs[state.name] = (
            *(Alternative(what, (1.0 - fails) / len(good), 5.0, 2.0) for what in good),
            *(Alternative(what, fails / len(bad), 4.0, 4.0) for what in bad),
        )
    answers = {
        ("manual", ""): (
            Alternative("/REDETECT_HANDLES_FROM_ERROR", 0.5, 20.0, 10.0),
            Alternative("/END_THE_STATE_MACHINE", 0.5, 20.0),
        ),
        ("confirm", ""): (Alternative("confirm", 1.0, 12.0, 3.0),),
    }
    return Chances(programs, answers)


def agree(chances: Chances, level: int, runs: int, seed: int) -> None:
    machine, rng = src_dish(), np.random.default_rng(seed)
    found = forecast(machine, chances, level)
    seen = [run(machine, chances, level, rng) for _ in range(runs)]
    assert within(found.time_s, [r.time_s for r in seen])
    spread = float(np.std([r.time_s for r in seen]))
    assert found.sd_s.low * (1 - 5.0 / math.sqrt(runs)) < spread < found.sd_s.high * (1 + 5.0 / math.sqrt(runs))
    assert within_counts(found.completed, [r.completed for r in seen])
    assert within_counts(found.manual, [r.manual for r in seen])
    # Of two dozen states, one may well lie just outside.
    outside = [p for p, figure in found.visits.items() if not within_counts(figure, [r.visits[p] for r in seen])]
    assert len(outside) <= 1, outside


def test_runs_of_the_dish_task_agree():
    """2,000 runs here; as many as the issue asks for below. A deviation's own is some 1/√n."""
    agree(table2_chances(), 3, 2_000, 1)
    agree(harsh(0.2), 1, 2_000, 2)


@pytest.mark.slow
@pytest.mark.parametrize(("chances", "level"), [(table2_chances(), 3), (harsh(0.3), 3), (harsh(0.3), 0)])
def test_a_hundred_thousand_runs_of_the_dish_task_agree(chances, level):
    agree(chances, level, 100_000, 7)


def test_what_is_left_out_is_bounded():
    """Whatever is followed, the interval holds the figure, and following more never widens it."""
    machine, chances = src_dish(), harsh(0.1)
    best = forecast(machine, chances, 3, 8_000)
    before = math.inf
    for most in (20, 100, 500, 2_500):
        found = forecast(machine, chances, 3, most)
        for name in ("time_s", "sd_s", "waits_s", "completed", "completed_s", "manual"):
            now, then = getattr(found, name), getattr(best, name)
            assert now.low <= then.low * (1 + 1e-12)
            assert then.high <= now.high * (1 + 1e-12)
        for path, figure in found.visits.items():
            assert figure.low <= best.visits[path].low * (1 + 1e-12)
            assert best.visits[path].high <= figure.high * (1 + 1e-12)
        assert found.time_s.error < before
        before = found.time_s.error
    assert best.time_s.error < 1e-4
    assert best.cut < 1e-4


@st.composite
def machines(draw_: st.DrawFn) -> tuple[Machine, Chances]:
    """A few states in a ring with counted failures, some of them in a container, one person who sends back or stops."""
    n = draw_(st.integers(1, 3))
    counter = st.builds(Counter, st.integers(0, 2), st.just("bad"), st.booleans(), st.booleans())
    rows = [draw_(st.lists(counter, min_size=0, max_size=2)) for _ in range(n)]
    names = [f"s{k}" for k in range(n)]
    inside = tuple(
        State(name, "p", (Row("bad", tuple(r), "off"),) if r else ()) for name, r in zip(names, rows, strict=True)
    )
    targets = [draw_(st.sampled_from(names)) for _ in names]
    edges = tuple(
        edge
        for k, name in enumerate(names)
        for edge in (
            Edge(name, "good", names[k + 1] if k + 1 < n else "over", 0),
            Edge(name, "bad", targets[k], draw_(st.integers(0, 2)), "retry"),
            Edge(name, "off", "lost", 0, "failed"),
        )
    )
    box = Group("box", "s0", inside, edges, ("over", "lost"))
    person = State("person", manual=True)
    top = (
        Edge("box", "over", "end", draw_(st.integers(-1, 2))),
        Edge("box", "lost", "person", -1, "failed"),
        Edge("person", "again", "box", 3, "command"),
        Edge("person", "stop", "end", 3, "command"),
    )
    machine = Machine("m", "box", (box, person, State("end")), top, frozenset({"end"}))
    q = draw_(st.sampled_from([0.25, 0.5]))
    # What has no row may fail for ever, so the task must be likelier.
    programs = {
        f"box/{name}": (Alternative("good", 1 - q, 1.0), Alternative("bad", q, 2.0), Alternative("off", 0.0))
        for name in names
    }
    answers = {
        ("manual", ""): (Alternative("again", 0.5, 3.0), Alternative("stop", 0.5, 1.0)),
        ("confirm", ""): (Alternative("confirm", 1.0, 4.0),),
    }
    return machine, Chances(programs, answers)


def pushed(machine: Machine, chances: Chances, level: int) -> tuple[float, float]:
    """Mean time and chance of completing by pushing mass through copies of the engine until 1e-10 is left."""
    front: dict[object, tuple[Engine, float]] = {0: (Engine(machine, level), 1.0)}
    mean_s = completed = 0.0
    while sum(mass for _, mass in front.values()) > 1e-10:
        further: dict[object, tuple[Engine, float]] = {}
        for engine, mass in front.values():
            for after, chance, time_s, command in steps(machine, chances, engine):
                mean_s += mass * chance * time_s
                if after.over():
                    completed += mass * chance * (not command)
                    continue
                v = after.variables
                counts = {key: n for key, n in v.counts.items() if any(n)}
                key = (after.configuration, str(sorted(counts.items())), str(sorted(v.escalated)))
                further[key] = (after, further.get(key, (after, 0.0))[1] + mass * chance)
        front = further
    return mean_s, completed


def steps(machine: Machine, chances: Chances, engine: Engine) -> Iterator[tuple[Engine, float, float, bool]]:
    path = machine.net.nodes[engine.configuration.active[0]].path
    helped = machine.leaf(path).manual
    for a in chances.answers_to("manual", path) if helped else chances.programs[path]:
        if not a.chance:
            continue
        after, time_s, command = Engine(machine, engine.level), a.mean_s, False
        after.configuration, after.variables = (
            engine.configuration,
            copy.deepcopy(engine.variables, {id(machine): machine}),
        )
        signal = "" if helped else a.what
        edge = machine.edge_index(path, a.what) if helped else after.trigger(path, signal)
        while edge >= 0:
            time_s += 0.0 if helped or after.passes(edge) else 4.0
            command = machine.table[edge].kind == "command"
            edge, signal = after.take(edge, signal).raised, ""
        yield after, a.chance, time_s, command


@given(machines(), st.integers(0, 3))
@settings(max_examples=25, deadline=None)
def test_mass_pushed_through_the_engine_says_the_same(case, level):
    machine, chances = case
    found = forecast(machine, chances, level)
    mean_s, completed = pushed(machine, chances, level)
    assert not found.cut
    # 1e-10 of the mass is left, and would go on for some hundred seconds at most.
    assert found.time_s.value == pytest.approx(mean_s, rel=1e-7)
    assert found.completed.value == pytest.approx(completed, abs=1e-9)


SIGNALS = st.lists(st.tuples(st.integers(0, 17), st.integers(0, 9), st.booleans()), max_size=60)


@given(SIGNALS)
@settings(max_examples=50, deadline=None)
def test_what_is_remembered_counts_as_the_variables_do(choices):
    """Any string of signals of the dish machine's states: the same edges, modes and counters."""
    machine = src_dish()
    counted, variables, memory = Counted(machine), Variables(machine), NOTHING
    leaves = [s for s in machine.states if s.program]
    for which, what, forced in choices:
        state = leaves[which % len(leaves)]
        known = [*(r.signal for r in state.rows), *(e.event for e in machine.outcomes_of(state.name))]
        signal, node = known[what % len(known)], machine.net.by_path[state.name]
        edge = variables.trigger(state.name, signal)
        assert counted.edges(memory, node, signal) == (edge,)
        variables.update(machine.table[edge], "" if forced else signal)
        memory = counted.after(memory, edge, "" if forced else signal)
        assert counted.manual(memory, node) == (variables.mode(state.name) == "manual")
        assert memory == Memory(memory.filled, tuple(sorted(machine.net.by_path[p] for p in variables.escalated)))
        assert [n for _, n in memory.filled] == [
            tuple(variables.counts[s.name, r.signal])
            for s in machine.states
            for r in s.rows
            if any(variables.counts.get((s.name, r.signal), ()))
        ]
