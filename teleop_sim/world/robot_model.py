"""A robot's description as bodies, joints, shapes and servos of a MuJoCo model.

Who touches whom: ``teleop_sim.world.contact``.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from teleop_sim.world import contact
from teleop_sim.world.cage import CageHand
from teleop_sim.world.description import Description, Link, Vector, rotation_rpy


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
    """Where a cage hand sits: its side, the palm's link, and the tool frame in the palm's frame."""

    side: str
    palm: str
    position_m: np.ndarray
    rotation: np.ndarray
    cage: CageHand


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
    _fill(body, description.link(description.root))
    mounts = {mount.palm: mount for mount in robot.hands}
    bodies = {description.root: body}
    # Depth first: actuators then stand in the order of the degrees of freedom, as the control law expects.
    for joint in description.depth_first():
        link = bodies[joint.parent].add_body(name=joint.child, pos=joint.xyz_m, quat=_quat(rotation_rpy(joint.rpy_rad)))
        bodies[joint.child] = link
        _fill(link, description.link(joint.child))
        servo = robot.servos[joint.name]
        made = link.add_joint(name=joint.name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=joint.axis)
        made.range = [joint.lower_rad, joint.upper_rad]
        made.limited = True
        made.armature = servo.armature
        made.damping = np.array([servo.damping, 0.0, 0.0])
        made.frictionloss = servo.friction_nm
        _position_actuator(spec, joint.name, servo.kp, servo.kv, joint.effort_nm)
        if joint.child in mounts:
            _add_hand(spec, link, mounts[joint.child])
    for shape in robot.shapes:
        _add_shape(bodies[shape.link], shape)
    for foot in (description.sole.left, description.sole.right):
        _add_sole(spec, bodies[foot], foot, description)
    for frame in description.frames:
        bodies[frame.parent].add_site(name=frame.name, pos=frame.xyz_m, quat=_quat(rotation_rpy(frame.rpy_rad)))


def _fill(body: mujoco.MjsBody, link: Link) -> None:
    body.explicitinertial = True
    body.mass = link.mass_kg
    body.ipos = list(link.com_m)
    xx, xy, xz, yy, yz, zz = link.inertia
    body.fullinertia = [xx, yy, zz, xy, xz, yz]


def _quat(rotation: np.ndarray) -> np.ndarray:
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(rotation).ravel())
    return quat


def _position_actuator(spec: mujoco.MjSpec, joint: str, kp: float, kv: float, limit: float) -> None:
    actuator = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    actuator.set_to_position(kp=kp, kv=kv)
    actuator.forcelimited = True
    actuator.forcerange = [-limit, limit]


_SOLID = {"condim": 3, "friction": contact.rough(contact.OWN_FRICTION), "mass": 0.0}
_GREY = [0.72, 0.76, 0.8, 1.0]
_DARK = [0.2, 0.2, 0.22, 1.0]


def _add_shape(body: mujoco.MjsBody, shape: Shape) -> None:
    name = f"{shape.link}_{shape.kind}"
    solid = {**_SOLID, **contact.robot_part(shape.part)}
    if shape.kind == "capsule":
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=[*shape.a_m, *shape.b_m],
            size=[shape.radius_m, 0.0, 0.0],
            rgba=_GREY,
            **solid,
        )
    elif shape.kind == "box":
        body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_BOX, pos=shape.a_m, size=shape.b_m, rgba=_GREY, **solid)
    else:
        size = [shape.radius_m, 0.0, 0.0]
        body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=shape.a_m, size=size, rgba=_GREY, **solid)


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
        rgba=_DARK,
        **_SOLID,
        **contact.robot_part(leg),
    )
    body.add_site(name=f"{foot}_sole", pos=centre - [0.0, 0.0, half[2]])
    body.add_site(name=f"{foot}_touch", type=mujoco.mjtGeom.mjGEOM_BOX, pos=centre, size=half + 0.004)
    _touch_sensor(spec, f"{foot}_touch")


def _touch_sensor(spec: mujoco.MjSpec, site: str) -> None:
    spec.add_sensor(name=site, type=mujoco.mjtSensor.mjSENS_TOUCH, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=site)


def _add_hand(spec: mujoco.MjSpec, palm: mujoco.MjsBody, mount: HandMount) -> None:
    cage, side = mount.cage, mount.side
    solid = {**_SOLID, **contact.hand_of(side), "condim": 4, "solref": contact.GRIP_SOLREF, "rgba": _DARK}
    hand = palm.add_body(name=f"{side}Hand", pos=mount.position_m, quat=_quat(mount.rotation))
    hand.add_site(name=f"{side}Tcp")
    hand.add_geom(
        name=f"{side}Flange",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        pos=[0.0, 0.0, cage.body_z_m],
        size=[cage.body_radius_m, cage.body_half_m, 0.0],
        **{**solid, "mass": cage.body_mass_kg},
    )
    x, y = cage.bar_offset_m
    for i, sign in enumerate((1.0, -1.0)):
        name = f"{side}Jaw{i}"
        jaw = hand.add_body(name=name)
        slide = jaw.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[-sign, 0.0, 0.0])
        slide.range = [0.0, cage.stroke_m]
        slide.limited = True
        slide.armature = cage.armature_kg
        slide.damping = np.array([cage.damping_ns_m, 0.0, 0.0])
        for j, yj in enumerate((y, -y)):
            ends = [sign * x, yj, cage.bar_top_m, sign * x, yj, cage.bar_bottom_m]
            jaw.add_geom(
                name=f"{side}Bar{i}{j}",
                type=mujoco.mjtGeom.mjGEOM_CAPSULE,
                fromto=ends,
                size=[cage.bar_radius_m, 0.0, 0.0],
                **{**solid, "mass": cage.bar_mass_kg},
            )
        jaw.add_site(name=f"{name}_touch", type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.1, 0.1, 0.12])
        _touch_sensor(spec, f"{name}_touch")
        _position_actuator(spec, name, cage.kp_n_m, cage.kv_ns_m, cage.force_n)
