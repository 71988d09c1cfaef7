"""A robot's description as bodies, joints, shapes and servos of a MuJoCo model.

Who touches whom: ``teleop_sim.world.contact``.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from teleop_sim.world import contact
from teleop_sim.world.description import Description, Vector, rotation_rpy
from teleop_sim.world.hand_build import add_hand
from teleop_sim.world.hand_parts import Hand
from teleop_sim.world.mjcf import DARK, GREY, SOLID, position_actuator, quat_of, touch_sensor, weigh


@dataclass(frozen=True)
class Shape:
    """A collision shape on a link: a ``capsule`` (from, to, radius), ``box`` (centre, half sizes) or ``sphere``.

    ``part``: what else of the robot it can touch, see ``teleop_sim.world.contact``.
    """

    link: str
    kind: str
    a_m: Vector
    b_m: Vector = (0.0, 0.0, 0.0)
    radius_m: float = 0.0
    part: contact.Part = "trunk"


@dataclass(frozen=True)
class Servo:
    """A joint's position actuator: force = kp (ctrl - q) - kv qd, within the joint's effort.

    ``friction_nm``: Coulomb friction of the joint; what little there is in it by default is in ``damping``.
    """

    kp: float
    kv: float
    armature: float
    damping: float = 0.5
    friction_nm: float = 0.0


@dataclass(frozen=True)
class HandMount:
    """Where a hand sits: its side, the palm's link, and the tool frame in the palm's frame."""

    side: str
    palm: str
    position_m: np.ndarray
    rotation: np.ndarray
    hand: Hand


@dataclass(frozen=True)
class RobotModel:
    """All that the world needs to build a robot. ``trunk``: the link that pushes hit."""

    description: Description
    servos: dict[str, Servo]
    shapes: tuple[Shape, ...]
    hands: tuple[HandMount, ...]
    trunk: str


def add_robot(spec: mujoco.MjSpec, robot: RobotModel) -> None:
    """Add the robot, root free, before anything else, so that its degrees of freedom come first."""
    description = robot.description
    body = spec.worldbody.add_body(name=description.root, pos=[0.0, 0.0, 1.1])
    body.add_freejoint(name="root")
    weigh(body, description.link(description.root))
    mounts = {mount.palm: mount for mount in robot.hands}
    bodies = {description.root: body}
    # Depth first: actuators then stand in the order of the degrees of freedom, as the control law expects.
    for joint in description.depth_first():
        link = bodies[joint.parent].add_body(
            name=joint.child, pos=joint.xyz_m, quat=quat_of(rotation_rpy(joint.rpy_rad))
        )
        bodies[joint.child] = link
        weigh(link, description.link(joint.child))
        servo = robot.servos[joint.name]
        made = link.add_joint(name=joint.name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=joint.axis)
        made.range = [joint.lower_rad, joint.upper_rad]
        made.limited = True
        made.armature = servo.armature
        made.damping = np.array([servo.damping, 0.0, 0.0])
        made.frictionloss = servo.friction_nm
        position_actuator(spec, joint.name, servo.kp, servo.kv, joint.effort_nm)
        if joint.child in mounts:
            mount = mounts[joint.child]
            add_hand(spec, link, mount.side, mount.hand, mount.position_m, mount.rotation)
    for shape in robot.shapes:
        _add_shape(bodies[shape.link], shape)
    for foot in (description.sole.left, description.sole.right):
        _add_sole(spec, bodies[foot], foot, description)
    for frame in description.frames:
        bodies[frame.parent].add_site(name=frame.name, pos=frame.xyz_m, quat=quat_of(rotation_rpy(frame.rpy_rad)))


def _add_shape(body: mujoco.MjsBody, shape: Shape) -> None:
    name = f"{shape.link}_{shape.kind}"
    solid = {**SOLID, **contact.robot_part(shape.part)}
    if shape.kind == "capsule":
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=[*shape.a_m, *shape.b_m],
            size=[shape.radius_m, 0.0, 0.0],
            rgba=GREY,
            **solid,
        )
    elif shape.kind == "box":
        body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_BOX, pos=shape.a_m, size=shape.b_m, rgba=GREY, **solid)
    else:
        size = [shape.radius_m, 0.0, 0.0]
        body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=shape.a_m, size=size, rgba=GREY, **solid)


def _add_sole(spec: mujoco.MjSpec, body: mujoco.MjsBody, foot: str, description: Description) -> None:
    half = np.array(description.sole.size_m) / 2
    centre = np.array(description.sole.centre_of(foot))
    leg: contact.Part = "left_leg" if foot == description.sole.left else "right_leg"
    body.add_geom(
        name=f"{foot}_sole",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=centre,
        size=half,
        solref=contact.SOLE_SOLREF,
        rgba=DARK,
        **SOLID,
        **contact.robot_part(leg),
    )
    body.add_site(name=f"{foot}_sole", pos=centre - [0.0, 0.0, half[2]])
    body.add_site(name=f"{foot}_touch", type=mujoco.mjtGeom.mjGEOM_BOX, pos=centre, size=half + 0.004)
    touch_sensor(spec, f"{foot}_touch")
