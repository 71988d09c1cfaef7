"""What a template says of a thing: values, in the template's frame.

Source of the terms: Romay et al., Collaborative Autonomy Between High-level Behaviors and Human Operators for Remote
Manipulation Tasks using Different Humanoid Robots, section 3.2: stand pose, grasp, pre-grasp, affordance, usability.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from teleop_sim.core.errors import UnknownName
from teleop_sim.templates.poses import Floats, Pose, Triple, pose_of
from teleop_sim.templates.shapes import Box, Shape, bounds, signed

Side = Literal["left", "right"]
Kind = Literal["linear", "circular", "screw"]

LEFT_FROM = 1000
"""Ids from here on are offered to the left hand, lower ones to the right. Source: vigir_object_template_manager."""

FACE_M = 0.1
"""A box with two half sizes above it shows a face that can be taken for a wall."""


@dataclass(frozen=True, slots=True)
class Affordance:
    """One way in which the thing can move, whoever holds it and however.

    Attributes:
        id: its number, of this template.
        name: such as ``turnCW``.
        kind: ``linear``, ``circular`` (about an axis) or ``screw`` (about and along it).
        axis: unit vector of the line or axis.
        origin: a point on the axis [m].
        amount: of one go, signed: metres of a line, radians of the others.
        pitch_m: of a screw: how far along the axis in one turn [m].
        keep_orientation: whether the hand keeps its own while the thing turns.

    """

    id: int
    name: str
    kind: Kind
    axis: Triple
    origin: Triple
    amount: float
    pitch_m: float = 0.0
    keep_orientation: bool = False

    @property
    def extent(self) -> tuple[float, float]:
        """Least and greatest amount from where the thing is."""
        return min(self.amount, 0.0), max(self.amount, 0.0)

    def at(self, pose: Pose) -> tuple[Triple, Triple]:
        """Axis and origin in the frame in which the template has this pose."""
        axis, origin = pose.matrix @ np.array(self.axis), pose.place(np.array(self.origin))
        return _triple(axis), _triple(origin)


@dataclass(frozen=True, slots=True)
class Usability:
    """A point of interest of the thing: when the thing is held, it can take the hand's place."""

    id: int
    name: str
    pose: Pose


@dataclass(frozen=True, slots=True)
class Grasp:
    """Where a hand takes the thing.

    Attributes:
        id: its number, of one hand and side.
        hand: kind of end-effector: ``robotiq``, ``vt_hand``, ``cage``.
        side: of the robot.
        pose: of the hand.
        approach: unit vector of the hand's frame along which it comes.
        far_m, near_m: length of the approach, wished for and least [m].

    """

    id: int
    hand: str
    side: Side
    pose: Pose
    approach: Triple
    far_m: float
    near_m: float

    def before(self, distance_m: float | None = None) -> Pose:
        """The pre-grasp: the hand ``distance_m`` (else ``far_m``) back along the approach."""
        back = -(self.far_m if distance_m is None else distance_m) * np.array(self.approach)
        return pose_of(self.pose.place(back), self.pose.matrix)


@dataclass(frozen=True, slots=True)
class Stand:
    """Where a robot stands to reach the thing: of its pelvis or, the source does not say, its feet."""

    id: int
    robot: str
    pose: Pose

    @property
    def side(self) -> Side:
        """Of the hand that it is offered to."""
        return "left" if self.id >= LEFT_FROM else "right"


@dataclass(frozen=True, slots=True)
class Template:
    """An object template.

    Attributes:
        name, type_id, group: as the library calls it.
        source: of affordances, usabilities, grasps and stands.
        mass_kg: what planning believes of a held one [kg].
        box_min_m, box_max_m: the published bounding box [m]; a placeholder in most.
        inertia_kgm2: about the axes through the centre of mass.
        geometry_source: of the shapes.
        shapes: the thing as solids, for looking at and aligning.

    """

    name: str
    type_id: int
    group: str
    source: str
    mass_kg: float
    box_min_m: Triple
    box_max_m: Triple
    inertia_kgm2: Triple
    geometry_source: str
    shapes: tuple[Shape, ...]
    affordances: tuple[Affordance, ...]
    usabilities: tuple[Usability, ...]
    stands: tuple[Stand, ...]
    grasps: tuple[Grasp, ...]

    @property
    def has_face(self) -> bool:
        """Whether part of it could be taken for a wall."""
        return any(_is_face(s) for s in self.shapes)

    @property
    def middle_m(self) -> Triple:
        """Middle of the solids' bounds [m]."""
        low, high = bounds(self.shapes)
        return _triple(0.5 * (low + high))

    @property
    def handle_m(self) -> Triple:
        """Middle of the bounds of what stands off its faces, if anything does [m]."""
        low, high = bounds(tuple(s for s in self.shapes if not _is_face(s)) or self.shapes)
        return _triple(0.5 * (low + high))

    def signed(self, points: Floats) -> tuple[Floats, Floats]:
        """Distance (n,) of points (n, 3) to its surface [m], positive outside, and outward normals (n, 3)."""
        return signed(self.shapes, points)

    def affordance(self, name: str) -> Affordance:
        """By name.

        Raises:
            UnknownName: it has no such one.

        """
        for one in self.affordances:
            if one.name == name:
                return one
        raise UnknownName(f"affordance of {self.name}", name, tuple(a.name for a in self.affordances))

    def grasps_of(self, hand: str, side: Side) -> tuple[Grasp, ...]:
        """For a kind of hand on a side, in the library's order: the first is preferred."""
        return tuple(g for g in self.grasps if (g.hand, g.side) == (hand, side))

    def stands_of(self, robot: str, side: Side) -> tuple[Stand, ...]:
        """For a robot that uses a hand, in the library's order: the first is preferred."""
        return tuple(s for s in self.stands if (s.robot, s.side) == (robot, side))


def box_inertia(mass_kg: float, low_m: Triple, high_m: Triple) -> Triple:
    """Principal moments of a box of even density about its middle [kg m^2]: m (b^2 + c^2) / 12."""
    a, b, c = ((high - low) ** 2 for low, high in zip(low_m, high_m, strict=True))
    return (mass_kg * (b + c) / 12.0, mass_kg * (a + c) / 12.0, mass_kg * (a + b) / 12.0)


def _is_face(shape: Shape) -> bool:
    return isinstance(shape, Box) and sum(h > FACE_M for h in shape.half) >= 2


def _triple(vector: Floats) -> Triple:
    x, y, z = (float(v) for v in vector)
    return (x, y, z)
