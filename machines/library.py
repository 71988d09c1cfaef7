"""The published machines by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType

from teleop_sim.core.errors import UnknownName
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.drc import door_machine, valve_machine
from teleop_sim.machines.operator_only import operator_only
from teleop_sim.machines.src_dish import src_dish
from teleop_sim.machines.src_panel import src_panel
from teleop_sim.machines.vigir import read_behaviour

MACHINES: Mapping[str, Callable[[], Machine]] = MappingProxyType(
    {
        "src-dish": src_dish,
        "src-panel": src_panel,
        "drc-door-atlas": partial(door_machine, "atlas"),
        "drc-valve-thormang3": partial(valve_machine, "thormang3"),
        "operator-only": operator_only,
        "vigir-door-atlas": partial(read_behaviour, "open_door_atlas"),
        "vigir-door-thor": partial(read_behaviour, "open_door_thor"),
        "vigir-valve-atlas": partial(read_behaviour, "turn_valve_atlas"),
        "vigir-valve-thor": partial(read_behaviour, "turn_valve_thor"),
        "vigir-cut-hole-atlas": partial(read_behaviour, "cut_hole_in_wall_atlas"),
        "vigir-grasp-object": partial(read_behaviour, "grasp_object"),
        "vigir-pickup-object": partial(read_behaviour, "pickup_object"),
        "vigir-walk-to-template": partial(read_behaviour, "walk_to_template"),
    }
)
"""Each is read and checked when it is called. THORMANG3's door and Atlas' valve run as published (``drc.py``)."""


def machine(name: str) -> Machine:
    """The machine of that name.

    Raises:
        UnknownName: there is none.

    """
    if name not in MACHINES:
        raise UnknownName("machine", name, tuple(MACHINES))
    return MACHINES[name]()
