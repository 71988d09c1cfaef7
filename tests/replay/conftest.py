"""Runs to be looked at again, with the robot's states as physics had them."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import pytest

from teleop_sim.log.load import Log, load
from teleop_sim.log.writer import LogWriter
from teleop_sim.robot.body import Body
from teleop_sim.robot.episode import Episode
from teleop_sim.robot.memo import Fresh
from teleop_sim.run import simulate
from teleop_sim.scenarios.files import load_scenario

SEED = 12


@dataclass
class Watched(Fresh):
    """Computes everything anew and keeps the body and, with its start, each episode."""

    made: list[Body] = field(default_factory=list)
    episodes: list[tuple[float, Episode]] = field(default_factory=list)

    def body(self, *args: Any) -> Body:
        self.made.append(super().body(*args))
        return self.made[-1]

    def perform(self, *args: Any, **named: Any) -> Episode:
        episode = super().perform(*args, **named)
        self.episodes.append((named["start_s"], episode))
        return episode


@dataclass(frozen=True)
class Run:
    log: Log
    watched: Watched

    @property
    def body(self) -> Body:
        return self.watched.made[0]


Runs = Callable[..., Run]


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Runs:
    """A run of a scenario by name, up to a time limit [s]; the same one is made once."""
    folder = tmp_path_factory.mktemp("replayed")

    @cache
    def made(name: str, limit_s: float) -> Run:
        scenario, watched = load_scenario(name, {"time_limit_s": limit_s}), Watched()
        path = folder / f"{name}_{limit_s:g}.mcap"
        with LogWriter(path) as write:
            simulate(scenario, SEED, 0, write, memo=watched)
        return Run(load(path), watched)

    return made


@pytest.fixture(scope="session")
def dish(runs: Runs) -> Run:
    """Valkyrie looks at the console, walks to it, looks again."""
    return runs("src-dish", 42.0)


@pytest.fixture(scope="session")
def door(runs: Runs) -> Run:
    """Atlas opens the door; nearly all of the time it waits for people."""
    return runs("drc-door-lab-behaviour", 900.0)


@pytest.fixture(scope="session")
def valve(runs: Runs) -> Run:
    """THORMANG3 turns the valve."""
    return runs("drc-valve-thormang3-lab-behaviour", 900.0)
