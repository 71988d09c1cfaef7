"""What goes otherwise than the robot's controller believes: a value, an input of a run like its seed.

Everything here is physics: plates lie on the floor, pushes pull at the trunk, masses are really other. The controller
knows none of it but a payload that it was told of. Nothing is disturbed by default.

Not modelled: slopes, soft ground, wind, motors that fail for good, odometry errors.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace

import mujoco
import numpy as np

from teleop_sim.world import contact
from teleop_sim.world.description import Description, Link, Vector, inertia_matrix
from teleop_sim.world.robot_model import RobotModel
from teleop_sim.world.sense_errors import EXACT, SenseErrors

PATCH_HEIGHT_M = 0.003
"""Thickness of a plate that is only slippery: more than a sole sinks in (0.6 mm), less than a step (assumed)."""


@dataclass(frozen=True, slots=True)
class Plate:
    """Something flat on the floor with its own friction: a bump, or with ``PATCH_HEIGHT_M`` a slippery patch.

    ``x_m``, ``y_m``, ``yaw_rad``: of its middle. ``half_length_m``, ``half_width_m``: along and across the yaw.
    """

    x_m: float
    y_m: float
    yaw_rad: float
    half_length_m: float
    half_width_m: float
    height_m: float
    friction: float


@dataclass(frozen=True, slots=True)
class Push:
    """A steady force (3,) [N, world axes] at the trunk's centre of mass.

    ``start_s`` counts the time that the robot has been moving: while it stands frozen nothing pushes.
    """

    start_s: float
    duration_s: float
    force_n: Vector


@dataclass(frozen=True, slots=True)
class Payload:
    """A solid ball fixed to a link. ``at_m``: its centre in the link's frame. ``known``: the controller was told."""

    link: str
    mass_kg: float
    at_m: Vector = (0.0, 0.0, 0.0)
    radius_m: float = 0.1
    known: bool = False


@dataclass(frozen=True)
class Disturbances:
    """All that is otherwise than believed.

    Attributes:
        floor_friction: of everything fixed to the ground; None leaves the scenery's own.
        plates, pushes, payload: see there.
        mass_factor: true over believed mass, of every link alike.
        com_error_m: how far the trunk's centre of mass is from where it is believed, trunk axes.
        joint_friction: Coulomb friction of every joint as a share of its effort limit.
        strength: share of its effort limit that a joint has, by joint name; others have all.
        delay_s: age of what the controller feels, rounded to control ticks.
        senses: what is wrong with cameras and LIDAR.
    """

    floor_friction: float | None = None
    plates: tuple[Plate, ...] = ()
    pushes: tuple[Push, ...] = ()
    payload: Payload | None = None
    mass_factor: float = 1.0
    com_error_m: Vector = (0.0, 0.0, 0.0)
    joint_friction: float = 0.0
    strength: Mapping[str, float] = field(default_factory=dict)
    delay_s: float = 0.0
    senses: SenseErrors = EXACT

    @property
    def deceives(self) -> bool:
        """Whether the controller's model, or what its joints feel, is other than there is. Not the senses."""
        unknown = self.payload is not None and not self.payload.known
        return unknown or self.mass_factor != 1.0 or any(self.com_error_m) or self.delay_s > 0


CALM = Disturbances()
"""Nothing is disturbed."""


def figures(what: Disturbances) -> Iterator[tuple[str, tuple[float, ...], str]]:
    """All that is not as in the calm: its name, such as ``plates[0].height_m``; its numbers; or else its text."""
    return _figures("", what, CALM)


def _figures(name: str, value: object, calm: object) -> Iterator[tuple[str, tuple[float, ...], str]]:
    if is_dataclass(value):
        for part in fields(value):
            inner = f"{name}.{part.name}" if name else part.name
            yield from _figures(inner, getattr(value, part.name), getattr(calm, part.name, None))
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _figures(f"{name}.{key}", inner, None)
    elif isinstance(value, tuple) and any(map(is_dataclass, value)):
        for number, inner in enumerate(value):
            yield from _figures(f"{name}[{number}]", inner, None)
    elif isinstance(value, str):
        yield name, (), value
    elif value != calm:
        numbers = value if isinstance(value, tuple) else (value,)
        yield name, tuple(map(float, numbers)), ""


def burdened(robot: RobotModel, what: Disturbances) -> RobotModel:
    """The robot as it truly is."""
    description = robot.description
    links = []
    for link in description.links:
        com = link.com_m
        if link.name == robot.trunk:
            com = _vector(np.array(com) + what.com_error_m)
        xx, xy, xz, yy, yz, zz = (x * what.mass_factor for x in link.inertia)
        inertia = (xx, xy, xz, yy, yz, zz)
        links.append(replace(link, mass_kg=link.mass_kg * what.mass_factor, com_m=com, inertia=inertia))
    joints = tuple(replace(j, effort_nm=j.effort_nm * what.strength.get(j.name, 1.0)) for j in description.joints)
    servos = {
        j.name: replace(robot.servos[j.name], friction_nm=what.joint_friction * j.effort_nm) for j in description.joints
    }
    changed = replace(description, links=tuple(links), joints=joints)
    return replace(robot, description=_loaded(changed, what.payload), servos=servos)


def believed(robot: RobotModel, what: Disturbances) -> RobotModel:
    """The robot as its controller takes it to be: as built, with the payload that it was told of."""
    known = what.payload if what.payload is not None and what.payload.known else None
    return replace(robot, description=_loaded(robot.description, known))


def _loaded(description: Description, payload: Payload | None) -> Description:
    if payload is None:
        return description
    links = tuple(_with_ball(x, payload) if x.name == payload.link else x for x in description.links)
    return replace(description, links=links)


def _with_ball(link: Link, ball: Payload) -> Link:
    """Parallel-axis theorem; a solid ball has 2/5 m r^2 about its centre."""
    mass_kg = link.mass_kg + ball.mass_kg
    com = (link.mass_kg * np.array(link.com_m) + ball.mass_kg * np.array(ball.at_m)) / mass_kg
    total = inertia_matrix(link) + 0.4 * ball.mass_kg * ball.radius_m**2 * np.eye(3)
    for part_kg, at in ((link.mass_kg, link.com_m), (ball.mass_kg, ball.at_m)):
        d = np.array(at) - com
        total = total + part_kg * (d @ d * np.eye(3) - np.outer(d, d))
    xx, xy, xz, yy, yz, zz = (float(total[i, j]) for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)))
    return Link(link.name, mass_kg, _vector(com), (xx, xy, xz, yy, yz, zz))


def _vector(values: np.ndarray) -> Vector:
    x, y, z = values
    return float(x), float(y), float(z)


def change_ground(spec: mujoco.MjSpec, what: Disturbances) -> None:
    """Lay the plates and set the floor's friction; after the scenery is built."""
    if what.floor_friction is not None:
        for geom in spec.worldbody.geoms:
            geom.friction = contact.rough(what.floor_friction)
    for number, plate in enumerate(what.plates):
        spec.worldbody.add_geom(
            name=f"plate{number}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[plate.x_m, plate.y_m, plate.height_m / 2],
            quat=[np.cos(plate.yaw_rad / 2), 0.0, 0.0, np.sin(plate.yaw_rad / 2)],
            size=[plate.half_length_m, plate.half_width_m, plate.height_m / 2],
            friction=contact.rough(plate.friction),
            condim=3,
            solref=contact.SOLE_SOLREF,
            rgba=[0.55, 0.45, 0.35, 1.0],
            **contact.WORLD,
        )


def push_now(pushes: tuple[Push, ...], moved_s: float) -> np.ndarray:
    """Sum of the forces (3,) [N] that act after so much time of motion, taken in the middle of a control tick."""
    force = np.zeros(3)
    for push in pushes:
        if push.start_s <= moved_s < push.start_s + push.duration_s:
            force += push.force_n
    return force
