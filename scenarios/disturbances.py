"""The disturbances of a scenario as the world draws them; and why a robot cannot have them."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from teleop_sim.core.errors import Problem, unknown_name
from teleop_sim.scenarios.disturbance_schema import Bumps, Disturbances, Patches
from teleop_sim.scenarios.robots import robot_problems, robot_spec
from teleop_sim.world.disturbance_ranges import (
    DisturbanceRanges,
    PayloadRanges,
    PlateRanges,
    PushRanges,
    SenseRanges,
)

if TYPE_CHECKING:
    from teleop_sim.scenarios.schema import Scenario
    from teleop_sim.world.robot_model import RobotModel

_KINDS: dict[str, type[Any]] = {
    "bumps": PlateRanges,
    "patches": PlateRanges,
    "pushes": PushRanges,
    "payload": PayloadRanges,
    "senses": SenseRanges,
}


def disturbance_ranges(given: Disturbances) -> DisturbanceRanges:
    """What a run's disturbances are drawn from."""
    made = _given(DisturbanceRanges, given)
    return DisturbanceRanges(**{k: _KINDS[k](**_given(_KINDS[k], v)) if k in _KINDS else v for k, v in made.items()})


def _given(kind: type[Any], part: Any) -> dict[str, Any]:
    """The fields of a class of ranges that a table gives."""
    found = {field.name: getattr(part, field.name, None) for field in fields(kind)}
    return {name: value for name, value in found.items() if value is not None}


def disturbance_problems(scenario: Scenario) -> tuple[Problem, ...]:
    """Why the scenario's robot cannot be disturbed so; places as ``disturbances.payload.link``."""
    given, problems = scenario.disturbances, list[Problem]()
    for name, plates in (("bumps", given.bumps), ("patches", given.patches)):
        if plates is not None:
            problems += _both(f"disturbances.{name}", plates)
    if (given.payload is not None or given.strength is not None) and not robot_problems(scenario):
        problems += _unknown_parts(given, robot_spec(scenario).model)
    return tuple(problems)


def _both(where: str, plates: Bumps | Patches) -> list[Problem]:
    """A count beside the places."""
    if plates.at_m is None or plates.count is None:
        return []
    return [Problem(f"{where}.count", "stands beside at_m", "Give at_m or count: there is one at each place.")]


def _unknown_parts(given: Disturbances, robot: RobotModel) -> list[Problem]:
    from teleop_sim.world.disturbance_draw import carriers, joints_like

    problems = list[Problem]()
    if given.payload is not None and given.payload.link not in carriers(robot):
        hands = tuple(f"{mount.side}_hand" for mount in robot.hands)
        known = (*hands, *(link.name for link in robot.description.links))
        problems.append(unknown_name("disturbances.payload.link", given.payload.link, known))
    known = tuple(joint.name for joint in robot.description.joints)
    for pattern in given.strength or ():
        if not joints_like(robot, pattern):
            problems.append(unknown_name(f"disturbances.strength.{pattern}", pattern, known))
    return problems
