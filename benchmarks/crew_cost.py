"""What a crew costs beside the physics: a run's downlink, written down and played to it on a clock of its own.

    python benchmarks/crew_cost.py [--scenario NAME] [--repeats N]

Prints milliseconds of processor time a run (the best of the repeats) for each size of crew and policy.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np
import simpy

from teleop_sim import load_scenario
from teleop_sim.core.records import Record
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.mirror import Mirror
from teleop_sim.operators.acts import Briefing
from teleop_sim.operators.crew import Crew
from teleop_sim.operators.human import Human
from teleop_sim.operators.registry import POLICIES
from teleop_sim.operators.station import Station
from teleop_sim.operators.timing import load_timing
from teleop_sim.operators.workload import Curve
from teleop_sim.run import _Bench, _Watch
from teleop_sim.scenarios.objects import machine_of


class Overheard(_Bench):
    """A run whose downlink is written down."""

    def __init__(self, *given: Any) -> None:
        self.heard: list[tuple[float, bytes]] = []
        super().__init__(*given)

    def _to_station(self, payload: bytes) -> None:
        self.heard.append((float(self.env.now), payload))
        super()._to_station(payload)


def overheard(name: str) -> list[tuple[float, bytes]]:
    """What arrived at the control station in a run at level off."""
    scenario = load_scenario(name, {"autonomy": "off"})
    bench = Overheard(scenario, scenario.seed, 0, _Watch(scenario, lambda _: None, None), time.perf_counter)
    bench.run()
    return bench.heard


def played_s(machine: Machine, arrivals: list[tuple[float, bytes]], team: int, policy: str) -> float:
    """Processor time of a crew that hears all this."""
    env, records = simpy.Environment(), list[Record]()
    rng, human, told = np.random.default_rng(1), Human(0.02, 0.16, Curve()), Briefing(20.0, 380.0, 10.0)

    def send(_topic: str, _payload: bytes, _text: str) -> None:
        pass

    begun_s = time.process_time()
    chosen = POLICIES[policy](), team, human
    crew = Crew(env, Mirror(machine, 0), send, load_timing(), rng, records.append, told, *chosen)

    def play():
        for t_s, payload in arrivals:
            yield env.timeout(t_s - env.now)
            crew.receive(payload)

    env.process(crew.run())
    env.run(env.process(play()))
    return time.process_time() - begun_s


def station_s(machine: Machine, arrivals: list[tuple[float, bytes]]) -> float:
    """Processor time of the station's software alone: decoding, and keeping the mirror in step."""
    begun_s = time.process_time()
    station = Station(simpy.Environment(), Mirror(machine, 0), lambda *_: None, 0.0)
    for _, payload in arrivals:
        station.receive(payload)
    return time.process_time() - begun_s


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenario", default="src-dish")
    parser.add_argument("--repeats", type=int, default=20)
    given = parser.parse_args()
    arrivals, machine = overheard(given.scenario), machine_of(load_scenario(given.scenario))
    print(f"{given.scenario}: {len(arrivals)} messages in {arrivals[-1][0]:.0f} s")
    best_s = min(station_s(machine, arrivals) for _ in range(given.repeats))
    print(f"the station's software alone: {1e3 * best_s:6.2f} ms; with people:")
    for team in (1, 2, 3, 4):
        for policy in sorted(POLICIES):
            best_s = min(played_s(machine, arrivals, team, policy) for _ in range(given.repeats))
            print(f"team {team}, {policy:10}: {1e3 * best_s:6.2f} ms")


if __name__ == "__main__":
    main()
