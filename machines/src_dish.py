"""The dish task of the Space Robotics Challenge as WPI's 18 states, with retry limits and autonomy thresholds.

Facts: ``src_dish_edges.csv`` (63 outcomes), ``src_dish_states.csv`` and ``src_dish_counters.csv``, taken from
WPI-Humanoid-Robotics-Lab/SpaceRoboticsChallenge @ea36ad7, src_tasks/src_task1 (val_task1SM.cpp, val_task1.cpp).
"""

from __future__ import annotations

from functools import cache

from teleop_sim.machines.declare import Machine
from teleop_sim.machines.wpi import THRESHOLDS, read_machine

__all__ = ["THRESHOLDS", "src_dish"]


@cache
def src_dish() -> Machine:
    """The machine of the dish task."""
    return read_machine("src_dish")
