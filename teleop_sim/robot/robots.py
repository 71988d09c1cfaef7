"""Every robot, by its name in a scenario, which is also its description's. A new robot is its own files and a line."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from teleop_sim.robot.atlas import atlas
from teleop_sim.robot.spec import RobotSpec
from teleop_sim.robot.thormang3 import thormang3
from teleop_sim.robot.valkyrie import valkyrie

ROBOTS: Mapping[str, Callable[[], RobotSpec]] = {
    "atlas": atlas,
    "thormang3": thormang3,
    "valkyrie": valkyrie,
}
