"""What a posture would touch: the robot's shapes against each other and against things, through Pinocchio and coal.

Shapes and who may touch whom are those of the physics (``teleop_sim.world.contact``); hands are open. Two geoms that
physics lets pass through each other are not asked about here either.

Not modelled: jaws in other places than open; what the hands hold.
"""

from __future__ import annotations

import functools
import itertools
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from teleop_sim.robot.crank_scene import HANDLE, Thing
from teleop_sim.robot.hands import robot_of
from teleop_sim.robot.kinematics import Kinematics, kinematics_of
from teleop_sim.world import contact
from teleop_sim.world.hand_parts import opened
from teleop_sim.world.robot_model import HandMount, Shape

ROW_RAD = 0.06
"""Between two postures that are looked at: 4 cm of a hand at 0.6 m (assumed: nothing here is thinner)."""


@dataclass(frozen=True)
class Nearest:
    """The two geoms nearest each other and the gap between them [m], negative if they overlap."""

    gap_m: float
    first: str
    second: str


@dataclass(frozen=True)
class _Geom:
    """A solid on the robot: joint that moves it, placement there, shape, MuJoCo's bits of contact."""

    name: str
    joint: int
    placement: Any
    shape: Any
    bits: tuple[int, int]


class Collisions:
    """One robot among things. Scratch inside: not to be shared by threads."""

    def __init__(self, robot: str, things: tuple[Thing, ...]) -> None:
        self.kinematics = kinematics_of(robot)
        self.model = pin.GeometryModel()
        geoms = _robot_geoms(robot)
        own = [self._add(geom.name, geom.joint, geom.placement, geom.shape) for geom in geoms]
        others = [self._add(thing.name, 0, thing.placement, thing.shape) for thing in things]
        for i, a in enumerate(geoms):
            for k in range(i + 1, len(geoms)):
                b = geoms[k]
                if a.joint != b.joint and _may_touch(a.bits, b.bits):
                    self.model.addCollisionPair(pin.CollisionPair(own[i], own[k]))
            for place, thing in zip(others, things, strict=True):
                if "sole" not in a.name and not ("Bar" in a.name and thing.name == HANDLE):
                    self.model.addCollisionPair(pin.CollisionPair(own[i], place))
        self.data = pin.GeometryData(self.model)
        _forget_guesses(self.data)

    def _add(self, name: str, joint: int, placement: Any, shape: Any) -> int:
        return int(self.model.addGeometryObject(pin.GeometryObject(name, joint, placement, shape)))

    def nearest(self, q: np.ndarray) -> Nearest:
        """The smallest gap of a configuration."""
        model = self.kinematics.model
        pin.computeDistances(model, self.kinematics.data, self.model, self.data, q)
        gaps = [result.min_distance for result in self.data.distanceResults]
        least = int(np.argmin(gaps))
        return Nearest(float(gaps[least]), *self._names(least))

    def touching(self, q: np.ndarray, margin_m: float) -> tuple[str, str] | None:
        """The first pair found nearer than the margin, or none."""
        for request in self.data.collisionRequests:
            request.security_margin = margin_m
        model = self.kinematics.model
        if not pin.computeCollisions(model, self.kinematics.data, self.model, self.data, q, True):
            return None
        hit = next(i for i, result in enumerate(self.data.collisionResults) if result.isCollision())
        return self._names(hit)

    def along(self, path: Sequence[np.ndarray], margin_m: float) -> tuple[str, str] | None:
        """The first pair nearer than the margin on the way through configurations, straight from each to the next."""
        for a, b in itertools.pairwise(path):
            count = max(1, int(np.ceil(np.abs(b[7:] - a[7:]).max() / ROW_RAD)))
            for k in range(1, count + 1):
                found = self.touching(pin.interpolate(self.kinematics.model, a, b, k / count), margin_m)
                if found is not None:
                    return found
        return None

    def _names(self, pair: int) -> tuple[str, str]:
        at = self.model.collisionPairs[pair]
        return self.model.geometryObjects[at.first].name, self.model.geometryObjects[at.second].name


def _forget_guesses(data: pin.GeometryData) -> None:
    """Begin every search for the nearest points anew. Pinocchio has it begin where the last one ended, so that an
    answer depends in its last bits on what was asked before (``pinocchio/multibody/geometry.hxx``).
    """
    with warnings.catch_warnings():
        # Its successor is set aright, but the old switch overrules it.
        warnings.simplefilter("ignore", DeprecationWarning)
        for request in (*data.collisionRequests, *data.distanceRequests):
            request.enable_cached_gjk_guess = False


def _may_touch(a: tuple[int, int], b: tuple[int, int]) -> bool:
    return bool(a[0] & b[1] or b[0] & a[1])


def _bits(settings: dict[str, Any]) -> tuple[int, int]:
    return int(settings["contype"]), int(settings["conaffinity"])


@functools.cache
def _robot_geoms(robot: str) -> tuple[_Geom, ...]:
    kinematics, model = kinematics_of(robot), robot_of(robot).model
    geoms = [_shape_geom(kinematics, shape) for shape in model.shapes]
    for mount in model.hands:
        geoms += _hand_geoms(kinematics, mount)
    return tuple(geoms)


def _shape_geom(kinematics: Kinematics, shape: Shape) -> _Geom:
    joint, a, b = kinematics.carriers[shape.link], np.array(shape.a_m), np.array(shape.b_m)
    name, bits = f"{shape.link}_{shape.kind}", _bits(contact.robot_part(shape.part))
    if shape.kind == "capsule":
        return _Geom(name, joint, _between(a, b), coal.Capsule(shape.radius_m, float(np.linalg.norm(b - a))), bits)
    if shape.kind == "box":
        return _Geom(name, joint, pin.SE3(np.eye(3), a), coal.Box(*(2 * b)), bits)
    return _Geom(name, joint, pin.SE3(np.eye(3), a), coal.Sphere(shape.radius_m), bits)


def _hand_geoms(kinematics: Kinematics, mount: HandMount) -> list[_Geom]:
    joint, side = kinematics.carriers[mount.palm], mount.side
    tool, bits = pin.SE3(mount.rotation, mount.position_m), _bits(contact.hand_of(side))
    geoms = []
    for placed in opened(mount.hand):
        at, solid = tool * pin.SE3(placed.rotation, placed.position_m), placed.solid
        a, b = np.array(solid.a_m), np.array(solid.b_m)
        if solid.kind == "capsule":
            at, shape = at * _between(a, b), coal.Capsule(solid.radius_m, float(np.linalg.norm(b - a)))
        elif solid.kind == "box":
            at, shape = at * pin.SE3(np.eye(3), a), coal.Box(*(2 * b))
        else:
            at, shape = at * pin.SE3(np.eye(3), a), coal.Cylinder(solid.radius_m, 2 * float(b[2]))
        geoms.append(_Geom(f"{side}{solid.name}", joint, at, shape, bits))
    return geoms


def _between(a: np.ndarray, b: np.ndarray) -> Any:
    """Placement of a shape along z whose ends are a and b."""
    way = (b - a) / np.linalg.norm(b - a)
    return pin.SE3(pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), way).toRotationMatrix(), (a + b) / 2)
