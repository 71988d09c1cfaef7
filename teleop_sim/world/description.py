"""A robot's body as plain numbers: links, joints, frames, soles. No physics here.

The JSON files in ``teleop_sim/robot`` hold them with their sources; joints and links keep their published names, and
everything else finds them by name, because MuJoCo, Pinocchio and each robot order and sign joints differently.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

Vector = tuple[float, float, float]

MISSING_EFFORT_NM = 10.0
MISSING_VELOCITY_RAD_S = 1.0
"""Effort and speed limit of a joint whose source leaves them out, such as a finger's (assumed)."""


@dataclass(frozen=True)
class Link:
    """A rigid link. ``inertia``: ixx, ixy, ixz, iyy, iyz, izz about the centre of mass, link axes [kg m^2]."""

    name: str
    mass_kg: float
    com_m: Vector
    inertia: tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class Joint:
    """A hinge from ``parent`` to ``child``; origin in the parent's frame, roll-pitch-yaw about fixed axes [rad]."""

    name: str
    parent: str
    child: str
    xyz_m: Vector
    rpy_rad: Vector
    axis: Vector
    lower_rad: float
    upper_rad: float
    effort_nm: float
    velocity_rad_s: float


@dataclass(frozen=True)
class Frame:
    """A named place fixed to a link, such as a camera."""

    name: str
    parent: str
    xyz_m: Vector
    rpy_rad: Vector


@dataclass(frozen=True)
class Sole:
    """The box under each foot: size and centre in the left foot's frame [m]; the right one's mirrors y."""

    left: str
    right: str
    size_m: Vector
    centre_m: Vector

    def centre_of(self, foot: str) -> Vector:
        """Centre of a foot's box in its own frame [m]."""
        x, y, z = self.centre_m
        return (x, y if foot == self.left else -y, z)


@dataclass(frozen=True)
class Description:
    """A whole robot; joints are listed parents first."""

    name: str
    root: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    frames: tuple[Frame, ...]
    sole: Sole

    def link(self, name: str) -> Link:
        """The link of that name."""
        return next(link for link in self.links if link.name == name)

    def joint(self, name: str) -> Joint:
        """The joint of that name."""
        return next(joint for joint in self.joints if joint.name == name)

    def children(self, link: str) -> tuple[Joint, ...]:
        """Joints that hang from a link, in file order."""
        return tuple(joint for joint in self.joints if joint.parent == link)

    def beyond(self, link: str) -> frozenset[str]:
        """The link and all that it carries."""
        found, waiting = {link}, [link]
        while waiting:
            hung = [joint.child for joint in self.children(waiting.pop())]
            found.update(hung)
            waiting.extend(hung)
        return frozenset(found)

    def depth_first(self) -> Iterator[Joint]:
        """Joints in the order in which MuJoCo numbers them."""
        stack = list(reversed(self.children(self.root)))
        while stack:
            joint = stack.pop()
            yield joint
            stack.extend(reversed(self.children(joint.child)))


def load_description(path: Path) -> Description:
    """Read a robot's JSON file."""
    raw = json.loads(path.read_text(encoding="utf-8"))
    foot = raw["foot"]
    return Description(
        name=raw["name"],
        root=raw["root"],
        links=tuple(Link(x["name"], x["mass"], _vector(x["com"]), tuple(x["inertia"])) for x in raw["links"]),
        joints=tuple(_joint(x) for x in raw["joints"]),
        frames=tuple(Frame(x["name"], x["parent"], _vector(x["xyz"]), _vector(x["rpy"])) for x in raw["frames"]),
        sole=Sole(
            foot["left"], foot["right"], _vector(foot["sole_box_size"]), _vector(foot["sole_box_centre_in_foot"])
        ),
    )


def _joint(raw: dict[str, Any]) -> Joint:
    return Joint(
        name=str(raw["name"]),
        parent=str(raw["parent"]),
        child=str(raw["child"]),
        xyz_m=_vector(raw["xyz"]),
        rpy_rad=_vector(raw["rpy"]),
        axis=_vector(raw["axis"]),
        lower_rad=float(raw["lower"]),
        upper_rad=float(raw["upper"]),
        effort_nm=float(raw["effort"] or MISSING_EFFORT_NM),
        velocity_rad_s=float(raw["velocity"] or MISSING_VELOCITY_RAD_S),
    )


def _vector(raw: object) -> Vector:
    x, y, z = np.asarray(raw, float)
    return float(x), float(y), float(z)


def rotation_rpy(rpy_rad: Vector) -> np.ndarray:
    """Rotation matrix (3, 3) of roll, pitch, yaw about fixed x, y, z axes (URDF's convention)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy_rad), np.sin(rpy_rad)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def inertia_matrix(link: Link) -> np.ndarray:
    """The (3, 3) matrix of ``link.inertia``."""
    xx, xy, xz, yy, yz, zz = link.inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def without(description: Description, pattern: str) -> Description:
    """Fold every link whose name matches ``pattern`` into what carries it, at joint angle zero.

    Mass, centre of mass and inertia are kept (parallel-axis theorem); frames on folded links are dropped.
    """
    gone = re.compile(pattern)
    links = {link.name: link for link in description.links}
    for joint in reversed(list(description.depth_first())):
        if gone.search(joint.child):
            links[joint.parent] = _merged(links[joint.parent], links.pop(joint.child), joint)
    return replace(
        description,
        links=tuple(links.values()),
        joints=tuple(j for j in description.joints if j.child in links),
        frames=tuple(f for f in description.frames if f.parent in links),
    )


def _merged(parent: Link, child: Link, joint: Joint) -> Link:
    R = rotation_rpy(joint.rpy_rad)
    com_child = np.array(joint.xyz_m) + R @ np.array(child.com_m)
    mass = parent.mass_kg + child.mass_kg
    com = (parent.mass_kg * np.array(parent.com_m) + child.mass_kg * com_child) / mass

    def shifted(inertia: np.ndarray, mass_kg: float, at: np.ndarray) -> np.ndarray:
        d = at - com
        moved: np.ndarray = inertia + mass_kg * (d @ d * np.eye(3) - np.outer(d, d))
        return moved

    both = shifted(inertia_matrix(parent), parent.mass_kg, np.array(parent.com_m))
    both = both + shifted(R @ inertia_matrix(child) @ R.T, child.mass_kg, com_child)
    xx, xy, xz, yy, yz, zz = (float(both[i, j]) for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)))
    return Link(parent.name, mass, _vector(com), (xx, xy, xz, yy, yz, zz))
