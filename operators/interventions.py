"""Which commands help by hand: a table by failed state, and the machine's own edges where the table is silent."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources

from teleop_sim.machines.declare import Machine


@dataclass(frozen=True)
class Rule:
    """One row of the table. ``after`` empty: any. ``ladder``: commands of the first, second, ... intervention."""

    failed: tuple[str, ...]
    after: tuple[str, ...]
    ladder: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Interventions:
    """The table and when to stop.

    Attributes:
        give_up: command that ends the machine.
        give_up_after: interventions in all.
        give_up_after_same: interventions for the same failed state.
        rules: tried in order; the first that fits holds.

    """

    give_up: str
    give_up_after: int
    give_up_after_same: int
    rules: tuple[Rule, ...]


@cache
def load_interventions() -> Interventions:
    """The table of ``interventions.toml``."""
    text = resources.files("teleop_sim.operators").joinpath("interventions.toml").read_text(encoding="utf-8")
    table = tomllib.loads(text)
    rules = tuple(
        Rule(tuple(r["failed"]), tuple(r.get("after", ())), tuple(tuple(row) for row in r["ladder"]))
        for r in table.pop("rule")
    )
    return Interventions(rules=rules, **table)


def failed_state(machine: Machine, visited: tuple[str, ...]) -> str:
    """The state that gave up: the last one seen in which the machine does not wait for a person; empty if none was.

    Args:
        machine: says which states wait.
        visited: states seen in the mirror, oldest first, the present one last.

    """
    return next((name for name in reversed(visited) if not machine.leaf(name).manual), "")


def commands(
    table: Interventions, machine: Machine, visited: tuple[str, ...], helped: tuple[str, ...], waiting: str
) -> tuple[str, ...]:
    """What to type now.

    Args:
        table: rules and limits.
        machine: whose edges say what is accepted.
        visited: states seen in the mirror, oldest first.
        helped: failed state of every earlier intervention, oldest first.
        waiting: the state in which the machine waits for help.

    """
    failed = failed_state(machine, visited)
    tries = helped.count(failed)
    if len(helped) >= table.give_up_after or tries >= table.give_up_after_same:
        return (table.give_up,)
    earlier = failed_state(machine, tuple(name for name in visited if name != failed))
    for rule in table.rules:
        if failed in rule.failed and (not rule.after or earlier in rule.after):
            row = rule.ladder[min(tries, len(rule.ladder) - 1)]
            if all(machine.has_edge(waiting, c) for c in row if c.startswith("/")):
                return row
    return (shortest_way_back(machine, waiting, failed) or table.give_up,)


def shortest_way_back(machine: Machine, waiting: str, goal: str) -> str:
    """The event of ``waiting`` with the fewest transitions to ``goal``; declaration order breaks ties.

    Empty if no event leads there without passing ``waiting`` again.
    """
    front = [(edge.event, edge.next_state) for edge in machine.outcomes_of(waiting)]
    seen = {waiting}
    while front:
        grown: list[tuple[str, str]] = []
        for first, state in front:
            if state == goal:
                return first
            if state not in seen:
                seen.add(state)
                grown += [(first, edge.next_state) for edge in machine.outcomes_of(state)]
        front = grown
    return ""
