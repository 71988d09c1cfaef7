"""The tasks at door and valve: what a scenario makes of them, and why one cannot be."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeVar

from teleop_sim.core.errors import Problem
from teleop_sim.robot.drc_plans import DRC_STANDS, drc_stand
from teleop_sim.world.drc_draw import DoorSettings, Placed, Streams, ThingSettings, ValveSettings, draw_door, draw_valve

if TYPE_CHECKING:
    from teleop_sim.scenarios.drc_schema import Thing
    from teleop_sim.scenarios.schema import Scenario
    from teleop_sim.world.door import Door
    from teleop_sim.world.valve import Valve

TABLES = {"src-dish": "world", "drc-door": "door", "drc-valve": "valve"}
"""Task to the table of its world; a task that is not here has none."""

_Settings = TypeVar("_Settings", bound=ThingSettings)


def drawn_door(scenario: Scenario, streams: Streams) -> tuple[Door, Placed]:
    """The scenario's door, drawn."""
    return draw_door(streams, _settings(DoorSettings, scenario.door), drc_stand(scenario.robot).door)


def drawn_valve(scenario: Scenario, streams: Streams) -> tuple[Valve, Placed]:
    """The scenario's valve, drawn."""
    return draw_valve(streams, _settings(ValveSettings, scenario.valve), drc_stand(scenario.robot).valve)


def _settings(made: type[_Settings], part: Thing | None) -> _Settings:
    """The table's keys under the same names; one that is not there has the defaults."""
    if part is None:
        return made()
    given: dict[str, Any] = {f.name: getattr(part, f.name) for f in fields(made)}
    return made(**given)


def task_problems(scenario: Scenario) -> tuple[Problem, ...]:
    """Tables and keys that belong to another task, and a robot that nobody has tried there."""
    found, drc = [], scenario.task.startswith("drc-")
    for task, table in TABLES.items():
        if task != scenario.task and getattr(scenario, table) is not None:
            has = f"[{TABLES[scenario.task]}]" if scenario.task in TABLES else "no table of its own"
            hint = f"It has {has}; [{table}] belongs to {task}."
            found.append(Problem(table, f"is no table of task {scenario.task}", hint))
    if not drc and scenario.onboard is not None:
        found.append(Problem("onboard", f"is no table of task {scenario.task}", "The drc tasks have it."))
    if not drc and scenario.layer not in (None, "behaviour"):
        found.append(Problem("layer", f"{scenario.task} has no templates to work with", 'Give "behaviour".'))
    if drc and scenario.robot not in DRC_STANDS:
        known = ", ".join(sorted(DRC_STANDS))
        found.append(
            Problem("robot", f"{scenario.robot} has no place to stand at {scenario.task}", f"These have: {known}.")
        )
    if drc and scenario.operator.policy != "collaborate":
        what = f"{scenario.operator.policy} has no answers to what is asked at {scenario.task}"
        found.append(Problem("operator.policy", what, 'Give policy = "collaborate".'))
    if drc and scenario.hand != "claw":
        found.append(Problem("hand", f"{scenario.task} is done with claws", 'Give hand = "claw".'))
    return tuple(found)
