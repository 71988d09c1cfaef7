"""What a robot makes of a door and a valve whose place it believes in: where its hand goes, and how things move.

Pure geometry of the templates (``teleop_sim.world.door``, ``teleop_sim.world.valve``: shapes known beforehand, as a
template's are); where they stand is what the robot has seen or an operator has aligned. All in the odometry frame.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from teleop_sim.core.errors import UnknownName
from teleop_sim.robot.affordance import Affordance, moved, rotated
from teleop_sim.robot.commands import Handle, Vector
from teleop_sim.robot.hands import base_name
from teleop_sim.world import door, valve

RHO_LEVER_M = 0.085
"""From the lever's axis to where the hand takes it (assumed: 35 mm from its end)."""
DEEPER_M = 0.010
"""The hand's tool goes so far past the lever's middle: the bars end 18 mm short of the panel (assumed)."""
LEAD_RAD = math.radians(40.0)
"""The rod enters so far behind the spoke that it will push: a little ahead of the gap's middle, for a shorter way until
it touches (assumed)."""
SINK_M = 0.015
"""The tool's middle behind the wheel's plane: bars reach 4 cm past it, the flange stays 5 cm before it (assumed)."""


@dataclass(frozen=True)
class DrcStand:
    """Where a robot stands for one hand's work: ahead and left of the middle of its feet [m] is the thing.

    ``door``: the lever's axis. ``valve``: the wheel's centre. ``rho_m``: from that to where the rod turns it; a weak
    arm goes near the rim. ``start_rad``: angle from up, towards the left, near which the rod enters the wheel.
    """

    door: tuple[float, float]
    valve: tuple[float, float]
    rho_m: float
    start_rad: float = 0.0


DRC_STANDS: Mapping[str, DrcStand] = MappingProxyType(
    {
        "atlas": DrcStand((0.72, 0.30), (0.80, 0.30), 0.115),
        "thormang3": DrcStand((0.47, 0.25), (0.46, 0.22), 0.130, math.radians(60.0)),
    }
)
"""For the left hand, with lever and wheel 40 inches over the floor: found by asking the inverse kinematics, and so far
from the door that the idle hand keeps off it (6 cm nearer it was caught there, and Atlas fell: measured)."""


def drc_stand(robot: str) -> DrcStand:
    """The figures of a robot, whatever its hands.

    Raises:
        UnknownName: nobody has found any for it.

    """
    name = base_name(robot)
    if name not in DRC_STANDS:
        raise UnknownName("stand at door and valve", name, tuple(DRC_STANDS))
    return DRC_STANDS[name]


@dataclass(frozen=True)
class Template:
    """Where a thing is believed to be: ``place`` of its frame [m], turned by ``yaw_rad``; x goes into it."""

    place: Vector
    yaw_rad: float

    def point(self, local: Vector) -> Vector:
        """A point of the thing's frame in the odometry frame."""
        return _triple(np.array(self.place) + rotated(np.array([0.0, 0.0, 1.0]), self.yaw_rad, np.array(local)))

    def way(self, local: Vector) -> Vector:
        """A direction."""
        return _triple(rotated(np.array([0.0, 0.0, 1.0]), self.yaw_rad, np.array(local)))


def lever_turn(at: Template) -> Affordance:
    """The lever about its axis: positive is down."""
    # The lever's end is to the right: down is clockwise seen from the robot, which is anticlockwise about x.
    return Affordance("circular", at.way((1.0, 0.0, 0.0)), at.place)


def door_swing(at: Template) -> Affordance:
    """The door about its hinges: positive is open."""
    x, y, _ = door.HINGE
    return Affordance("circular", (0.0, 0.0, -1.0), at.point((x, y, 0.0)))


def lever_handle(at: Template) -> Handle:
    """The lever's bar, level, as a hand takes it from before the door."""
    centre = at.point((DEEPER_M - door.LEVER_STANDOFF_M, -RHO_LEVER_M, 0.0))
    return Handle(centre, at.way((1.0, 0.0, 0.0)), at.way((0.0, 1.0, 0.0)), 0.0)


def opened(at: Template, amount_rad: float) -> Template:
    """Where the lever's frame is on a door that is open by so much."""
    place = moved(door_swing(at), amount_rad, np.array(at.place))
    return Template(_triple(place), at.yaw_rad - amount_rad)


def wheel_turn(at: Template) -> Affordance:
    """The wheel about its axis: positive is anticlockwise as the robot sees it, which opens it."""
    return Affordance("circular", at.way((-1.0, 0.0, 0.0)), at.place)


def gap_handle(at: Template, spoke_rad: float, stand: DrcStand) -> Handle:
    """Where the rod goes in, in the gap between two spokes nearest the stand's start; ``spoke_rad``: of any spoke."""
    pitch = math.tau / valve.SPOKES
    first = spoke_rad - LEAD_RAD
    angle = first + pitch * round((stand.start_rad - first) / pitch)
    _, y, z = valve.on_wheel(angle, stand.rho_m)
    return Handle(at.point((SINK_M, y, z)), at.way((1.0, 0.0, 0.0)), None, 0.0)


def _triple(values: np.ndarray) -> Vector:
    x, y, z = (float(v) for v in values)
    return x, y, z
