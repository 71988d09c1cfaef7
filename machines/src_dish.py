"""The dish task of the Space Robotics Challenge as WPI's 18 states, with retry limits and autonomy thresholds.

Facts: ``src_dish_edges.csv`` (63 outcomes), ``src_dish_states.csv`` and ``src_dish_counters.csv``, taken from
WPI-Humanoid-Robotics-Lab/SpaceRoboticsChallenge @ea36ad7, src_tasks/src_task1 (val_task1SM.cpp, val_task1.cpp). The
thresholds are ours, by the rule ``THRESHOLDS`` (docs/machine.md).
"""

from __future__ import annotations

import csv
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import cast

from teleop_sim.machines.declare import INHERIT, Autonomy, Counter, Edge, Kind, Machine, RaisedBy, Row, State

THRESHOLDS = MappingProxyType(
    {
        "at_work": INHERIT,
        "look": Autonomy.OFF,
        "motion": Autonomy.LOW,
        "contact": Autonomy.HIGH,
        "failure": Autonomy.HIGH,
        "person": Autonomy.FULL,
    }
)
"""Threshold by what follows the outcome (column ``follows`` of the edges)."""

_Table = list[dict[str, str]]


@cache
def src_dish() -> Machine:
    """The machine of the dish task."""
    return Machine(
        name="src_dish",
        start="STATE_PRE_INIT",
        states=_states(_table("src_dish_states.csv"), _table("src_dish_counters.csv")),
        edges=tuple(_edge(r) for r in _table("src_dish_edges.csv")),
        ends=frozenset({"STATE_END"}),
    )


def _table(name: str) -> _Table:
    text = files("teleop_sim.machines").joinpath(name).read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))


def _edge(r: dict[str, str]) -> Edge:
    kind, raised_by = cast(Kind, r["kind"]), cast(RaisedBy, r["raised_by"])
    return Edge(r["state"], r["event"], r["next_state"], int(r["threshold"]), kind, raised_by, r["note"])


def _states(states: _Table, counters: _Table) -> tuple[State, ...]:
    return tuple(_state(r, [c for c in counters if c["state"] == r["state"]]) for r in states)


def _state(r: dict[str, str], counters: _Table) -> State:
    manual, name = r["manual"] == "1", r["state"]
    idle = manual or name == "STATE_END"
    signals = dict.fromkeys(c["signal"] for c in counters)
    rows = tuple(_row(signal, [c for c in counters if c["signal"] == signal]) for signal in signals)
    return State(name, "" if idle else name, rows, manual, r["action"])


def _row(signal: str, counters: _Table) -> Row:
    made = tuple(Counter(int(c["limit"]), c["event"], c["clears"] == "1", c["kept"] == "1") for c in counters)
    return Row(signal, made, counters[0]["failed"])
