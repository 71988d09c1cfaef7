"""A robot that does the dish task as ten runs of WPI's did: chances and times out of the paper's Table II.

Facts: ``src_dish_table2.csv``, from Table II of Jagtap, Agarwal et al., "Extended State Machines for Robust Robot
Performance in Complex Tasks": ten runs, retries in each state and its mean simulated time in a run. What states of the
program stand for which row is ours. What the table does not say is marked assumed there.
"""

from __future__ import annotations

import csv
from functools import cache
from importlib.resources import files

from teleop_sim.machines.chances import Alternative, Chances

RUNS = 10
"""Runs in the table."""


@cache
def table2_chances() -> Chances:
    """Chance of a signal: its share of all attempts in its state. Time: the same for each attempt. Nobody helps."""
    text = files("teleop_sim.machines").joinpath("src_dish_table2.csv").read_text(encoding="utf-8")
    rows = list(csv.DictReader(text.splitlines()))
    programs = {
        state: tuple(_alternative(r, attempts) for r in rows if r["state"] == state)
        for state, attempts in _attempts(rows).items()
    }
    return Chances(programs)


def _attempts(rows: list[dict[str, str]]) -> dict[str, int]:
    return {r["state"]: sum(int(other["times"]) for other in rows if other["state"] == r["state"]) for r in rows}


def _alternative(row: dict[str, str], attempts: int) -> Alternative:
    return Alternative(row["signal"], int(row["times"]) / attempts, float(row["runs_s"]) * RUNS / attempts)
