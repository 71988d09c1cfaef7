"""ViGIR's door and valve behaviours with the settings that our robots run them with.

States, outcomes, thresholds and keys are as published (``vigir.py``). Settings are what a behaviour is started with:

- ``hand_side`` is left at both tasks: our robots' stands and rates were measured for the left hand. Published: right
  for Atlas' door and THORMANG's valve.
- The handle's affordance of Atlas' door is ``turnCW``; published: ``Up``, which is a straight line. ``turnCW`` presses
  the lever down, and is what the paper's runs used ("Turn Clockwise", Romay et al., section 6.1.4).

``hand_type`` stays: it says which of the library's grasps there are; a cage takes the thing in its own way.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType

from teleop_sim.core.errors import UnknownName
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.vigir import read_behaviour

NAMES: Mapping[str, str] = MappingProxyType({"atlas": "atlas", "thormang3": "thor"})
"""Robots to how the behaviours are called."""
HANDLE = "Open_Door/Unlock_Door/Turn_Handle/Get_Handle_Affordance"


def door_machine(robot: str) -> Machine:
    """Open a door.

    Args:
        robot: ``atlas`` or ``thormang3``, with or without its hand.

    Raises:
        UnknownName: nobody has published a behaviour for it.

    """
    return _set("open_door", _named(robot))


def valve_machine(robot: str) -> Machine:
    """Turn a valve; robot and errors as for ``door_machine``."""
    return _set("turn_valve", _named(robot))


def _named(robot: str) -> str:
    base = robot.partition("+")[0]
    if base not in NAMES:
        raise UnknownName("robot at door and valve", base, tuple(NAMES))
    return NAMES[base]


@cache
def _set(task: str, robot: str) -> Machine:
    # Late: the library is read by many who change nothing.
    from teleop_sim.machines.modify import Operation, Patch, SetDefault, SetParameter, apply

    published = read_behaviour(f"{task}_{robot}")
    operations: list[Operation] = [SetDefault("hand_side", "left")]
    if (task, robot) == ("open_door", "atlas"):
        operations.append(SetParameter(HANDLE, "identifier", "turnCW"))
    return apply(published, Patch(published.checksum, tuple(operations)))
