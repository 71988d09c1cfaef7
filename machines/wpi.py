"""WPI's state machines of the Space Robotics Challenge, read from three tables each.

``<task>_edges.csv`` has one row an outcome, ``<task>_states.csv`` one a state, ``<task>_counters.csv`` one a failure
counter, inner first. Source of the facts: WPI-Humanoid-Robotics-Lab/SpaceRoboticsChallenge @ea36ad7, src_tasks. The
thresholds are ours, by the rule ``THRESHOLDS`` (docs/machine.md).
"""

from __future__ import annotations

import csv
from importlib.resources import files
from types import MappingProxyType
from typing import cast

from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import INHERIT, Autonomy, Counter, Edge, Group, Kind, RaisedBy, Row, State
from teleop_sim.machines.mending import Mending, mended

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

END = "STATE_END"
Table = list[dict[str, str]]


def read_machine(task: str, mendings: tuple[Mending, ...] = ()) -> Machine:
    """The machine of a task; it starts in STATE_PRE_INIT and ends in STATE_END.

    Args:
        task: first part of the tables' names, and the machine's name.
        mendings: what is changed before it is declared.

    Raises:
        BadInput: with every problem of the declaration.

    """
    states = _states(read_table(f"{task}_states.csv"), read_table(f"{task}_counters.csv"))
    edges = tuple(_edge(r) for r in read_table(f"{task}_edges.csv"))
    top = mended(Group("", "STATE_PRE_INIT", states, edges, ()), mendings)
    return Machine(task, top.start, top.states, top.edges, frozenset({END}))


def read_table(name: str) -> Table:
    """A CSV file that lies beside this one, as rows by column."""
    text = files("teleop_sim.machines").joinpath(name).read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))


def _edge(r: dict[str, str]) -> Edge:
    kind, raised_by = cast(Kind, r["kind"]), cast(RaisedBy, r["raised_by"])
    return Edge(r["state"], r["event"], r["next_state"], int(r["threshold"]), kind, raised_by, r["note"])


def _states(states: Table, counters: Table) -> tuple[State, ...]:
    return tuple(_state(r, [c for c in counters if c["state"] == r["state"]]) for r in states)


def _state(r: dict[str, str], counters: Table) -> State:
    manual, name = r["manual"] == "1", r["state"]
    idle = manual or name == END or not r["action"]
    signals = dict.fromkeys(c["signal"] for c in counters)
    rows = tuple(_row(signal, [c for c in counters if c["signal"] == signal]) for signal in signals)
    return State(name, "" if idle else name, rows, manual, r["action"])


def _row(signal: str, counters: Table) -> Row:
    made = tuple(Counter(int(c["limit"]), c["event"], c["clears"] == "1", c["kept"] == "1") for c in counters)
    return Row(signal, made, counters[0]["failed"])
