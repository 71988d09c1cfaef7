"""An operator fed with independent requests is a queue with one server: closed form by Pollaczek and Khinchine."""

from dataclasses import dataclass, field
from math import exp, log1p

import numpy as np
import pytest
import simpy

from teleop_sim.channel.messages import Confirm, Request, Withdrawn, decode_payload, encode_message
from teleop_sim.core.records import OperatorActed, Record
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import PARKED, Concurrence, Edge, State
from teleop_sim.machines.mirror import Mirror
from teleop_sim.operators.acts import Briefing
from teleop_sim.operators.crew import Crew
from teleop_sim.operators.timing import load_timing, words_in

# A state asks one thing at a time, so many ask side by side: never are so many waiting at these loads.
ASKERS = tuple(f"s{n}" for n in range(80))
CROWD = Machine(
    "crowd",
    "all",
    (
        Concurrence(
            "all",
            tuple(State(name, "work") for name in ASKERS),
            tuple(Edge(name, "go", PARKED, 0) for name in ASKERS),
            ("done",),
            "all",
            default="done",
        ),
        State("end"),
    ),
    (Edge("all", "done", "end", 0),),
    ends=frozenset({"end"}),
)
WORDS = words_in("all/s1 go")


@dataclass
class Office:
    """Requests come at random times, whatever was answered; an answered one is over at once."""

    rate_hz: float
    requests: int
    seed: int
    env: simpy.Environment = field(default_factory=simpy.Environment)
    acts: list[OperatorActed] = field(default_factory=list)
    came_s: dict[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        rng = np.random.default_rng(self.seed)
        self.crew = Crew(self.env, Mirror(CROWD, 0), self._sent, load_timing(), rng, self._note, Briefing(0.0, 1e6))
        self.env.process(self.crew.run())
        self.env.process(self._ask(rng))

    def _note(self, record: Record) -> None:
        if isinstance(record, OperatorActed):
            self.acts.append(record)

    def _ask(self, rng: np.random.Generator):
        for number in range(1, self.requests + 1):
            yield self.env.timeout(rng.exponential(1.0 / self.rate_hz))
            self.came_s[number] = float(self.env.now)
            path = f"all/{ASKERS[number % len(ASKERS)]}"
            asked = Request(number, "confirm", CROWD.net.by_path[path], CROWD.edge_index(path, "go"))
            self.crew.receive(encode_message(asked)[1])

    def _sent(self, _topic: str, payload: bytes, _text: str) -> None:
        message = decode_payload(payload)
        assert isinstance(message, Confirm)
        # Not before the act is over: the person is still at the key.
        self.env.process(self._withdraw(message.request))

    def _withdraw(self, number: int):
        yield self.env.timeout(0.0)
        self.crew.receive(encode_message(Withdrawn(number))[1])

    def waits_s(self) -> list[float]:
        """From arrival to the beginning of deciding."""
        self.env.run()
        return [act.start_s - self.came_s[act.request] for act in self.acts if act.kind == "decide"]


def service_moments() -> tuple[float, float]:
    """Mean and mean square of one answer: deciding and pressing, two independent lognormals. The floor is far below."""
    timing = load_timing()
    means = timing.judge_s(WORDS), timing.press_s()
    # What the floor adds to pressing: E[max(floor, X)] and its square, of a lognormal, by its distribution function.
    deciding, pressing = (lognormal_above(mean, timing.spread, timing.floor_s) for mean in means)
    mean = deciding[0] + pressing[0]
    variance = sum(second - first**2 for first, second in (deciding, pressing))
    return mean, variance + mean**2


def lognormal_above(mean: float, spread: float, floor: float) -> tuple[float, float]:
    """First two moments of max(floor, X), by a fine sum over the quantiles of the standard normal."""
    z = np.linspace(-8.0, 8.0, 160_001)
    weight = np.exp(-(z**2) / 2.0)
    s2 = log1p(spread**2)
    x = np.maximum(floor, mean * exp(-s2 / 2.0) * np.exp(np.sqrt(s2) * z))
    return float(np.average(x, weights=weight)), float(np.average(x**2, weights=weight))


def waits_by_lindley_s(gaps_s: np.ndarray, services_s: np.ndarray) -> np.ndarray:
    """D. V. Lindley (1952): W' = max(0, W + S - A), as a running sum above its running minimum."""
    walk_s = np.concatenate([[0.0], np.cumsum(services_s[:-1] - gaps_s[1:])])
    return walk_s - np.minimum.accumulate(walk_s)


@pytest.mark.parametrize("load", [0.3, 0.6])
def test_waits_are_those_of_one_server_first_come_first_served(load):
    mean_s, _ = service_moments()
    office = Office(load / mean_s, 600, 1)
    waits_s = office.waits_s()
    came_s = np.array(list(office.came_s.values()))
    first = {act.request: act.start_s for act in reversed(office.acts)}
    last = {act.request: act.t_s for act in office.acts}
    services_s = np.array([last[n] - first[n] for n in office.came_s])
    # Sums of some thousand times below 1e5 s.
    assert waits_s == pytest.approx(waits_by_lindley_s(np.diff(came_s, prepend=0.0), services_s), abs=1e-6)
    # 600 answers whose spread is a quarter of their mean: one standard error is 1 %.
    assert services_s.mean() == pytest.approx(mean_s, rel=0.04)


@pytest.mark.parametrize("load", [0.3, 0.6, 0.8])
def test_mean_waits_are_those_of_pollaczek_and_khinchine(load):
    """The operator's own times, many of them; that his waits follow from them so is the test above."""
    timing, rng, count = load_timing(), np.random.default_rng(1), 4_000_000
    parts = (lognormals(rng, mean, timing.spread, count) for mean in (timing.judge_s(WORDS), timing.press_s()))
    services_s = sum(np.maximum(timing.floor_s, part) for part in parts)
    mean_s, square_s2 = service_moments()
    closed_s = load / mean_s * square_s2 / (2.0 * (1.0 - load))
    waits_s = waits_by_lindley_s(rng.exponential(mean_s / load, count), services_s)
    # The bound; four standard errors are 2.5 % at the highest load.
    assert waits_s.mean() == pytest.approx(closed_s, rel=0.03)


def lognormals(rng: np.random.Generator, mean: float, spread: float, count: int) -> np.ndarray:
    s2 = log1p(spread**2)
    return mean * np.exp(np.sqrt(s2) * rng.standard_normal(count) - s2 / 2.0)
