"""What a crew costs beside the physics: a run's downlink, written down and played to it on a clock of its own.

    python benchmarks/crew_cost.py [--scenario NAME] [--repeats N]

Prints milliseconds of processor time a run (the best of the repeats) for each size of crew and policy, less what the
clock takes to play the messages to nobody: for people who make no mistakes and whom load does not slow, and for people
with rates of mistakes and load. The run is one of the same policy, begun at level off, so that a level asked for is
set; where the task takes no such policy, it is one of the scenario's own. "Not obeyed": ``adaptive``, to which a run is
played that stays at level off whatever is asked for. Eyes remember what they have judged.

Then what it takes to judge a claim by a picture and to lay a template over a cloud, anew and remembered.
"""

from __future__ import annotations

import argparse
import time
from functools import partial
from typing import Any

import numpy as np
import simpy
from align_study import EYE_M, arrived, see

from teleop_sim import load_scenario
from teleop_sim.channel.messages import Image, PixelMark, VoxelCloud, encode_image
from teleop_sim.channel.pictures import sample_picture
from teleop_sim.core.errors import BadInput
from teleop_sim.core.records import Record
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.mirror import Mirror
from teleop_sim.operators.acts import Briefing
from teleop_sim.operators.crew import Crew
from teleop_sim.operators.human import Human
from teleop_sim.operators.memo import EyeMemo, FreshEyes
from teleop_sim.operators.registry import POLICIES
from teleop_sim.operators.station import Station
from teleop_sim.operators.timing import load_timing
from teleop_sim.operators.workload import Curve
from teleop_sim.run import _Bench, _Watch
from teleop_sim.scenarios.objects import machine_of
from teleop_sim.templates.elements import Template
from teleop_sim.templates.library import library


class Overheard(_Bench):
    """A run whose downlink is written down."""

    def __init__(self, *given: Any) -> None:
        self.heard: list[tuple[float, bytes]] = []
        super().__init__(*given)

    def _to_station(self, payload: bytes) -> None:
        self.heard.append((float(self.env.now), payload))
        super()._to_station(payload)


def overheard(name: str, policy: str) -> list[tuple[float, bytes]]:
    """What arrived at the control station in a run that began at level off."""
    try:
        scenario = load_scenario(name, {"autonomy": "off", "operator.policy": policy})
    except BadInput:
        scenario = load_scenario(name, {"autonomy": "off"})
    bench = Overheard(scenario, scenario.seed, 0, _Watch(scenario, lambda _: None, None), time.perf_counter)
    bench.run()
    return bench.heard


def played_s(
    machine: Machine, arrivals: list[tuple[float, bytes]], team: int, policy: str, human: Human, eyes: EyeMemo
) -> float:
    """Processor time of a crew that hears all this."""
    env, records = simpy.Environment(), list[Record]()
    rng, told = np.random.default_rng(1), Briefing(20.0, 380.0, 10.0)

    def send(_topic: str, _payload: bytes, _text: str) -> None:
        pass

    begun_s = time.process_time()
    chosen = POLICIES[policy](), team, human
    crew = Crew(env, Mirror(machine, 0), send, load_timing(), rng, records.append, told, *chosen, eyes=eyes)

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


def clock_s(arrivals: list[tuple[float, bytes]]) -> float:
    """Processor time of the clock alone."""
    begun_s, env = time.process_time(), simpy.Environment()

    def play():
        for t_s, _ in arrivals:
            yield env.timeout(t_s - env.now)

    env.run(env.process(play()))
    return time.process_time() - begun_s


def people(name: str, machine: Machine, arrivals: list[tuple[float, bytes]], policy: str, repeats: int) -> None:
    """Print what crews of one policy cost to which a run is played."""
    alone_s, eyes = min(clock_s(arrivals) for _ in range(repeats)), EyeMemo()
    best_s = min(station_s(machine, arrivals) for _ in range(repeats))
    print(f"{name}: {len(arrivals)} messages in {arrivals[-1][0]:.0f} s")
    print(f"  the station's software alone: {1e3 * best_s:6.2f} ms")
    for team in (1, 2, 3, 4):
        best_ms = [
            1e3 * (min(played_s(machine, arrivals, team, policy, human, eyes) for _ in range(repeats)) - alone_s)
            for human in (Human(), Human(0.02, 0.16, Curve()))
        ]
        print(f"  team {team}: {best_ms[0]:6.2f} ms; {best_ms[1]:6.2f} ms with mistakes and load")


def looks(repeats: int) -> None:
    """What it takes to judge a claim and to lay a template."""
    places = {"yaw": 120.0, "pitch": 190.0}
    marks = tuple(PixelMark(f"{axis}_wheel", across, 85.0, 26.0, 26.0) for axis, across in places.items())
    knobs = tuple(PixelMark(f"{axis}_handle", across - 10.0, 95.0, 6.0, 6.0) for axis, across in places.items())
    image = encode_image(sample_picture(320, 170), 320, 170, 50)
    for name, claim in (("one knob", knobs[:1]), ("two wheels", marks), ("two wheels, two knobs", marks + knobs)):
        show(f"judge {name}", repeats, partial(judged, image, claim))
    for name in ("DRC_valve", "door", "dish_console"):
        for voxel_m in (0.01, 0.05):
            template = library().named(name)
            cloud = arrived(see(template, np.random.default_rng(1), 0.01), 0.7, voxel_m)
            show(f"lay {name}, {100 * voxel_m:g} cm", repeats, partial(lay, template, cloud))


def lay(template: Template, cloud: VoxelCloud, eyes: FreshEyes, rng: np.random.Generator) -> object:
    """Lay a template over a cloud."""
    return eyes.align(template, cloud, EYE_M, rng)


def judged(image: Image, claim: tuple[PixelMark, ...], eyes: FreshEyes, rng: np.random.Generator) -> object:
    """Judge a claim by a picture."""
    return eyes.judge(image, claim, 6.0, rng)


def show(name: str, repeats: int, ask: Any) -> None:
    """Print what an answer costs anew, and remembered."""
    best_s = []
    for eyes in (FreshEyes(), EyeMemo()):
        ask(eyes, np.random.default_rng(1))
        spent_s = []
        for _ in range(repeats):
            rng, begun_s = np.random.default_rng(1), time.process_time()
            ask(eyes, rng)
            spent_s.append(time.process_time() - begun_s)
        best_s.append(1e3 * min(spent_s))
    print(f"{name:30}: {best_s[0]:6.2f} ms, remembered {best_s[1]:5.2f} ms")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenario", default="src-dish")
    parser.add_argument("--repeats", type=int, default=20)
    given = parser.parse_args()
    machine = machine_of(load_scenario(given.scenario))
    runs = {policy: overheard(given.scenario, policy) for policy in sorted(POLICIES)}
    for policy, arrivals in runs.items():
        people(f"{given.scenario}, {policy}", machine, arrivals, policy, given.repeats)
    people(f"{given.scenario}, adaptive, not obeyed", machine, runs["supervise"], "adaptive", given.repeats)
    looks(given.repeats)


if __name__ == "__main__":
    main()
