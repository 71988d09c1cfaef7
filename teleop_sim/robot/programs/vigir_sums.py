"""The small functions of ViGIR's calculating and deciding states, by name of the state.

Source of the figures: team-vigir/vigir_behaviors @6696e7b, the behaviours' own functions and user data. Where one
was not published it says so.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from teleop_sim.core.errors import UnknownName
from teleop_sim.robot.programs.steps import Program
from teleop_sim.robot.programs.vigir_visit import Move, Visit

ATLAS_TURN_RAD = math.radians(400.0)
"""Of Atlas' valve in one affordance."""
THOR_TURN_RAD, THOR_TEST_RAD = math.radians(200.0), math.radians(25.0)
"""Of THORMANG's valve: a whole turning, and the test before."""
REPLAN_BELOW, UNLATCHED_ABOVE, AGAIN_ABOVE = 0.9, 0.6, 0.95
"""Planned fractions at which Atlas' grasp is planned anew, THORMANG's lever counts as turned, and its arm turns back
once more."""
FRAME = "odometry"


def _by(amount_rad: float) -> Callable[[Any], Any]:
    return lambda move: replace(move, amount=amount_rad) if isinstance(move, Move) else None


def _other(side: Any) -> str:
    return "left" if side == "right" else "right"


CALCULATIONS: Mapping[str, Callable[[Any], Any]] = MappingProxyType(
    {
        **dict.fromkeys(("Convert_Waypoints", "Create_Pose_List"), lambda pose: (pose,)),
        "Extract_Frame_Id": lambda _: FRAME,
        **dict.fromkeys(("Increase_Preference_Index", "Increment_Stand_Pose"), lambda place: int(place or 0) + 1),
        **dict.fromkeys(("Init_Grasp_Preference", "Init_Back_Rotation"), lambda _: 0),
        "Set_Template_Frame": lambda number: f"template {number}",
        "Set_Rotation": _by(ATLAS_TURN_RAD),
        **dict.fromkeys(("Set_Full_Rotation", "Set_Back_Rotation"), _by(THOR_TURN_RAD)),
        "Set_Test_Rotation": _by(THOR_TEST_RAD),
        # Of the sign with which the way of turning is kept nothing is published: here down is positive.
        "Store_Turn_Down": lambda fraction: float(fraction or 0.0),
        "Store_Turn_Up": lambda fraction: -float(fraction or 0.0),
        # Nor how sides are worked out: the torso turns away from the hand that pushes, the second hand is the other.
        **dict.fromkeys(("Calc_Torso_Side", "Calc_Pushing_Side"), _other),
        "Generate_Traversing_Waypoint": lambda distance: (float(distance or 0.0), 0.0, 0.0),
    }
)

DECISIONS: Mapping[str, Callable[[Any], str]] = MappingProxyType(
    {
        "Decide_Request_Template": lambda number: "request" if number is None else "continue",
        "Replan_if_Incomplete": lambda share: "replan" if float(share or 0.0) < REPLAN_BELOW else "continue",
        # The first grasp takes the lever; with others THORMANG's hand only pushes.
        "Place_Handle_Hand/Decide_If_Open": lambda place: "push" if place else "open",
        "Place_Handle_Hand/Decide_If_Grasp": lambda place: "push" if place else "grasp",
        "Release_Handle/Decide_If_Open": lambda place: "retract" if place else "open",
        "Decide_Execute_Incomplete": lambda share: "up" if float(share or 0.0) > UNLATCHED_ABOVE else "down",
        # A lever that was turned down goes back up.
        "Decide_Turn_Direction": lambda share: "up" if float(share or 0.0) > 0.0 else "down",
        "Decide_Turn_Further": lambda share: "turn_again" if float(share or 0.0) > AGAIN_ABOVE else "done",
        "Decide_If_Test": lambda back: "full" if back else "test",
    }
)
"""By the last part of the path, with its container where two states have one name."""


def calculate(visit: Visit) -> Program:
    """Work out a key's value from another's."""
    yield from ()
    visit.write("output_value", _function(CALCULATIONS, visit)(visit.read("input_value")))
    return "done"


def decide(visit: Visit) -> Program:
    """Choose an outcome by a key's value."""
    yield from ()
    return str(_function(DECISIONS, visit)(visit.read("input_value")))


def calculate_of_many(visit: Visit) -> Program:
    """Work out a key's value from several others'."""
    yield from ()
    visit.write("output_value", _of_many(visit))
    return "done"


def _of_many(visit: Visit) -> object:
    match visit.state:
        case "Reduce_Affordance_Displacement":
            return _scaled(visit.read("affordance"), abs(float(visit.read("fraction") or 0.0)))
        case "Set_Back_Rotation":
            share = float(visit.read("back_rotation") or 0.0)
            return _scaled(_by(THOR_TURN_RAD)(visit.read("turning_affordance")), share)
        case "Accumulate_Rotation":
            # Where the arm has stopped short of the plan, what it has turned counts.
            went = visit.memory.facts.get("went", visit.read("plan_fraction"))
            return float(visit.read("back_rotation") or 0.0) + float(went or 0.0)
    raise UnknownName("calculation", visit.state, ("Reduce_Affordance_Displacement", "Set_Back_Rotation"))


def _scaled(move: object, share: float) -> Move | None:
    return replace(move, amount=move.amount * share) if isinstance(move, Move) else None


def _function(table: Mapping[str, Callable[[Any], Any]], visit: Visit) -> Callable[[Any], Any]:
    """The state's function, by its name or by its container's and its own.

    Raises:
        UnknownName: the table has none.

    """
    container = visit.memory.path.rpartition("/")[0].rpartition("/")[2]
    for name in (visit.state, f"{container}/{visit.state}"):
        if name in table:
            return table[name]
    raise UnknownName("calculation", visit.memory.path, tuple(table))
