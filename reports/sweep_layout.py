"""Which factor a figure of a sweep puts where: lines, axis, panels, and what is held. Pure functions.

A figure shows at most an axis, panels along one more factor, and lines. All other factors are held at one value, so
that what is shown is cells as they were run and nothing is averaged over settings: the scenario's own value where the
sweep has it, else the middle one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from teleop_sim.reports.sweep_view import MOST_COMPARED, SweepRuns, bare, numeric

if TYPE_CHECKING:
    import pandas as pd

T = TypeVar("T")


@dataclass(frozen=True)
class Panel:
    """One panel: its title and its rows."""

    title: str
    rows: pd.DataFrame


def axes_of(sweep: SweepRuns, most: int = 3) -> tuple[str, ...]:
    """Factors to draw against: numbers first, at most ``most``; where none is one, the first in words."""
    numbers = [name for name in sweep.link if numeric(sweep.levels[name])]
    return tuple(numbers[:most] or sweep.link[:1])


def held(sweep: SweepRuns, shown: Sequence[str]) -> Mapping[str, Any]:
    """Varying factors that are not shown, and the value at which each is held."""
    return {name: middle(sweep, name) for name in sweep.varying if name not in shown}


def middle(sweep: SweepRuns, name: str) -> Any:
    """The scenario's own value of a factor where the sweep has it, else the middle one."""
    levels = sweep.levels[name]
    own = sweep.base.get(name)
    return own if own in levels else levels[(len(levels) - 1) // 2]


def at(rows: pd.DataFrame, setting: Mapping[str, Any]) -> pd.DataFrame:
    """The rows of a setting."""
    for name, value in setting.items():
        rows = rows[rows[name] == value]
    return rows


def spread(values: Sequence[T], most: int) -> tuple[T, ...]:
    """At most so many of some values, the first and the last among them, evenly between."""
    if len(values) <= most:
        return tuple(values)
    steps = max(most - 1, 1)
    return tuple(values[round(n * (len(values) - 1) / steps)] for n in range(most))


def shown_levels(sweep: SweepRuns) -> tuple[Any, ...]:
    """Levels of the compared factor that a figure tells apart; ``(None,)`` where nothing is compared."""
    return spread(sweep.levels[sweep.compared], MOST_COMPARED) if sweep.compared else (None,)


def of_level(sweep: SweepRuns, rows: pd.DataFrame, level: Any) -> pd.DataFrame:
    """The rows of a level of the compared factor; all where there is none."""
    return rows[rows[sweep.compared] == level] if sweep.compared else rows


def panels(sweep: SweepRuns, rows: pd.DataFrame, across: Sequence[str], most: Sequence[int]) -> list[Panel]:
    """A panel for each combination of values of some factors, the last fastest.

    Args:
        sweep: of the rows.
        rows: cells or runs.
        across: the factors.
        most: how many values of each.

    """
    made = [Panel("", rows)]
    for name, count in zip(across, most, strict=True):
        values = spread(sweep.levels[name], count)
        made = [
            Panel(", ".join(filter(None, (p.title, sweep.setting({name: v})))), at(p.rows, {name: v}))
            for p in made
            for v in values
        ]
    return [panel for panel in made if len(panel.rows)]


def left_out(sweep: SweepRuns, across: Sequence[str], most: Sequence[int]) -> str:
    """A sentence on values that ``panels`` leaves out; empty: none."""
    cut = [(name, n) for name, n in zip(across, most, strict=True) if len(sweep.levels[name]) > n]
    parts = [f"{n} of {len(sweep.levels[name])} values of {bare(name)}" for name, n in cut]
    return f"Shown are {' and '.join(parts)}, evenly chosen." if parts else ""


def held_note(sweep: SweepRuns, setting: Mapping[str, Any]) -> str:
    """A sentence on what is held; empty: nothing."""
    return f"Held: {sweep.setting(setting)}." if setting else ""
