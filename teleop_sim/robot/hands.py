"""Hands by kind, for any robot: ``robot_of("valkyrie+fingers")`` is Valkyrie with its own fingers.

A robot's name alone has the hand of its own file, a cage. The kind is part of the name of what is built, so that
whatever is made by a robot's name (planning model, tables, shapes) is made for that hand.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType

from teleop_sim.core.errors import UnknownName
from teleop_sim.robot.fingers import with_fingers
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.spec import RobotSpec
from teleop_sim.world.cage import CageHand
from teleop_sim.world.hand_pads import PadHand

DEFAULT = "cage"
SEPARATOR = "+"
CLAW_M = 0.012
"""Inner radius of a closed claw (assumed: a lever's 10 mm and some)."""


def with_pads(spec: RobotSpec) -> RobotSpec:
    """Two flat pads where the cage sits."""
    mounts = tuple(replace(mount, hand=PadHand()) for mount in spec.model.hands)
    return replace(spec, model=replace(spec.model, hands=mounts))


def with_claws(spec: RobotSpec) -> RobotSpec:
    """Cages that close to 12 mm: round a door's lever they squeeze it, and shut they are a rod of 5 cm at most.

    Sizes assumed. Jaws of a light hand get the usual cage's inertia: with less they sink through a lever at 60 N.
    """
    mounts = []
    for mount in spec.model.hands:
        if not isinstance(mount.hand, CageHand):
            raise UnknownName("robot with claws", spec.model.description.name, tuple(ROBOTS))
        mounts.append(replace(mount, hand=replace(mount.hand, closed_m=CLAW_M, armature_kg=CageHand.armature_kg)))
    return replace(spec, model=replace(spec.model, hands=tuple(mounts)))


HANDS: Mapping[str, Callable[[RobotSpec], RobotSpec]] = MappingProxyType(
    {"cage": lambda spec: spec, "claw": with_claws, "fingers": with_fingers, "pads": with_pads}
)
"""By kind: what makes a robot of one with cages."""


def robot_of(name: str, hand: str = "") -> RobotSpec:
    """Build a robot by name; ``hand`` or what follows ``+`` in the name says with which hands.

    Raises:
        UnknownName: there is no such robot, no such hand, or the robot has none of that kind.

    """
    base, _, kind = name.partition(SEPARATOR)
    kind = hand or kind or DEFAULT
    if base not in ROBOTS:
        raise UnknownName("robot", base, tuple(ROBOTS))
    if kind not in HANDS:
        raise UnknownName(f"hand of {base}", kind, tuple(HANDS))
    spec = HANDS[kind](ROBOTS[base]())
    if kind == DEFAULT:
        return spec
    named = replace(spec.model.description, name=base + SEPARATOR + kind)
    return replace(spec, model=replace(spec.model, description=named))


def base_name(name: str) -> str:
    """The robot's name without its hand."""
    return name.partition(SEPARATOR)[0]
