"""Which commands help by hand: a table by failed state, and the machine's own edges where the table is silent."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import resources

Edge = tuple[str, str, str]
"""State, event, next state."""


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
        manual_state: where the machine waits for help.
        give_up: command that ends the machine.
        give_up_after: interventions in all.
        give_up_after_same: interventions for the same failed state.
        rules: tried in order; the first that fits holds.

    """

    manual_state: str
    give_up: str
    give_up_after: int
    give_up_after_same: int
    rules: tuple[Rule, ...]


def load_interventions() -> Interventions:
    """The table of ``interventions.toml``."""
    text = resources.files("teleop_sim.operators").joinpath("interventions.toml").read_text(encoding="utf-8")
    table = tomllib.loads(text)
    rules = tuple(
        Rule(tuple(r["failed"]), tuple(r.get("after", ())), tuple(tuple(row) for row in r["ladder"]))
        for r in table.pop("rule")
    )
    return Interventions(rules=rules, **table)


def failed_state(visited: tuple[str, ...], manual_state: str) -> str:
    """The state that gave up: the last one seen that is not the manual state; empty if nothing was seen.

    Args:
        visited: states seen in the mirror, oldest first, the present one last.
        manual_state: where the machine waits for help.

    """
    return next((s for s in reversed(visited) if s != manual_state), "")


def commands(
    table: Interventions, edges: Iterable[Edge], visited: tuple[str, ...], before: tuple[str, ...]
) -> tuple[str, ...]:
    """What to type now.

    Args:
        table: rules and limits.
        edges: of the machine.
        visited: states seen in the mirror, oldest first.
        before: failed state of every earlier intervention, oldest first.

    """
    failed = failed_state(visited, table.manual_state)
    tries = before.count(failed)
    if len(before) >= table.give_up_after or tries >= table.give_up_after_same:
        return (table.give_up,)
    edges = tuple(edges)
    accepted = {event for state, event, _ in edges if state == table.manual_state}
    earlier = failed_state(tuple(s for s in visited if s != failed), table.manual_state)
    for rule in table.rules:
        if failed in rule.failed and (not rule.after or earlier in rule.after):
            row = rule.ladder[min(tries, len(rule.ladder) - 1)]
            if all(c in accepted for c in row if c.startswith("/")):
                return row
    return (shortest_way_back(edges, table.manual_state, failed) or table.give_up,)


def shortest_way_back(edges: tuple[Edge, ...], manual_state: str, goal: str) -> str:
    """The event of ``manual_state`` with the fewest transitions to ``goal``; declaration order breaks ties.

    Empty if no event leads there without passing the manual state again.
    """
    front = [(event, after) for state, event, after in edges if state == manual_state]
    seen = {manual_state}
    while front:
        for first, state in front:
            if state == goal:
                return first
        grown: list[tuple[str, str]] = []
        for first, state in front:
            if state not in seen:
                seen.add(state)
                grown += [(first, after) for origin, _, after in edges if origin == state]
        front = grown
    return ""
