"""The robot of a scenario; and why there is none like it."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from teleop_sim.core.errors import Problem, UnknownName

if TYPE_CHECKING:
    from teleop_sim.robot.spec import RobotSpec
    from teleop_sim.scenarios.schema import Scenario


def robot_spec(scenario: Scenario) -> RobotSpec:
    """The scenario's robot, with the hands that it asks for.

    Raises:
        UnknownName: the robot has no such hands.

    """
    return _built(scenario.robot, scenario.hand or "")


@cache
def _built(name: str, hand: str) -> RobotSpec:
    # Robots are loaded only where one is asked for: a file may be checked without them.
    from teleop_sim.robot.hands import robot_of

    return robot_of(name, hand)


def robot_problems(scenario: Scenario) -> tuple[Problem, ...]:
    """Why the scenario's robot cannot be."""
    if scenario.hand is None:
        return ()
    try:
        robot_spec(scenario)
    except UnknownName as error:
        _, _, known = error.args
        return (Problem("hand", f"{scenario.robot} has no {scenario.hand}", f"These have: {', '.join(known)}."),)
    return ()
