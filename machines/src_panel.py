"""The solar panel and cable task of the Space Robotics Challenge as WPI's 30 states.

Facts: ``src_panel_edges.csv`` (135 outcomes), ``src_panel_states.csv`` and ``src_panel_counters.csv``, taken from
WPI-Humanoid-Robotics-Lab/SpaceRoboticsChallenge @ea36ad7, src_tasks/src_task2 (val_task2SM.cpp, val_task2.cpp).

The stored program is later than the paper's runs: it had three outcomes switched to manual mode. Here they have the
automatic targets: panel detected leads to GRASP_SOLAR_PANEL, socket detected to PLUGIN_POWER_CABLE, and the walk to the
finish is made and leads to END. Its limit is that of the code left in place there, more than 5 short walks.
"""

from __future__ import annotations

from functools import cache
from types import MappingProxyType

from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import Autonomy, Edge
from teleop_sim.machines.mending import Mending
from teleop_sim.machines.wpi import read_machine

IMAGES = MappingProxyType(
    {
        "STATE_FIND_CABLE_INTERMEDIATE": 6,
        "STATE_DETECT_DEPLOY_PANEL_BUTTON": 6,
        "STATE_DETECT_POWER_CABLE": 6,
        "STATE_DETECT_SOCKET": 6,
    }
)
"""Images looked at in vain before the state's program signals once; other programs signal each attempt."""

UNLIMITED = MappingProxyType(
    {
        "STATE_WALK_TO_ROVER": "its counter (6) is cleared on each retry: its way into manual mode is never taken",
        "STATE_PICK_SOLAR_PANEL": "an empty hand redetects the panel without limit",
    }
)
"""States whose failures nothing bounds in the original; declared so."""

DIFFERS = MappingProxyType(
    {
        "STATE_GRASP_SOLAR_PANEL": "the 20th attempt in vain gives up at once; WPI's program redetects first."
        " Its counter also counts attempts that succeed",
        "STATE_DEPLOY_SOLAR_PANEL": "five rounds of nine presses, 45; to the letter, the program has a sixth",
        "STATE_DETECT_ROVER": "a rover whose side is not known is retried uncounted; here it counts",
    }
)
"""Where the declared counters are not to the letter those of the program."""

MENDINGS = (
    Mending(
        "STATE_SKIP_TO_CP_1",
        "it has no program: whoever goes there stays",
        ("STATE_SKIP_TO_CP_1: nothing runs in it",),
        manual=True,
    ),
    Mending(
        "STATE_SKIP_TO_CP_1",
        "it has no transition; the states that work have this one",
        ("STATE_SKIP_TO_CP_1: no way out",),
        add=Edge(
            "STATE_SKIP_TO_CP_1",
            "/MANUAL_EXECUTION",
            "STATE_MANUAL_EXECUTION",
            Autonomy.FULL,
            "command",
            "operator",
            "operator: back to manual mode (mended)",
        ),
    ),
)


@cache
def src_panel() -> Machine:
    """The machine of the solar panel task, mended."""
    return read_machine("src_panel", MENDINGS)
