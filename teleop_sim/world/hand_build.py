"""A hand as bodies, joints, shapes, servos and touch sensors of a MuJoCo model."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from teleop_sim.world import contact
from teleop_sim.world.hand_parts import Hand, HandPart, Solid
from teleop_sim.world.mjcf import DARK, SOLID, position_actuator, quat_of, touch_sensor, weigh


def add_hand(
    spec: mujoco.MjSpec, palm: mujoco.MjsBody, side: str, hand: Hand, position_m: np.ndarray, rotation: np.ndarray
) -> None:
    """Hang a hand on a palm with its tool frame at a place (3,), (3, 3) in the palm's frame.

    Bodies, joints, actuators and sensors are named ``<side><part>``, the tool's site ``<side>Tcp``.
    """
    body = palm.add_body(name=f"{side}Hand", pos=position_m, quat=quat_of(rotation))
    body.add_site(name=f"{side}Tcp")
    for solid in hand.fixed:
        _add_solid(body, side, solid)
    bodies = {"": body}
    for part in hand.parts:
        bodies[part.name] = _add_part(spec, bodies[part.parent], side, part)


def _add_part(spec: mujoco.MjSpec, parent: mujoco.MjsBody, side: str, part: HandPart) -> mujoco.MjsBody:
    name, drive = f"{side}{part.name}", part.drive
    body = parent.add_body(name=name, pos=list(part.position_m), quat=quat_of(part.rotation))
    kind = mujoco.mjtJoint.mjJNT_HINGE if drive.rotary else mujoco.mjtJoint.mjJNT_SLIDE
    joint = body.add_joint(name=name, type=kind, axis=list(drive.axis))
    joint.range = [drive.lower, drive.upper]
    joint.limited = True
    joint.armature = drive.armature
    joint.damping = np.array([drive.damping, 0.0, 0.0])
    if part.link is not None:
        weigh(body, part.link)
    for solid in part.solids:
        _add_solid(body, side, solid)
    body.add_site(name=f"{name}_touch", type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.1, 0.1, 0.12])
    touch_sensor(spec, f"{name}_touch")
    position_actuator(spec, name, drive.kp, drive.kv, drive.limit)
    return body


def _add_solid(body: mujoco.MjsBody, side: str, solid: Solid) -> None:
    settings: dict[str, Any] = {
        **SOLID,
        **contact.hand_of(side),
        "friction": contact.rough(solid.friction),
        "condim": 4,
        "solref": contact.GRIP_SOLREF,
        "rgba": DARK,
        "mass": solid.mass_kg,
    }
    name = f"{side}{solid.name}"
    if solid.kind == "capsule":
        ends, size = [*solid.a_m, *solid.b_m], [solid.radius_m, 0.0, 0.0]
        body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=ends, size=size, **settings)
    elif solid.kind == "box":
        body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_BOX, pos=solid.a_m, size=list(solid.b_m), **settings)
    else:
        size = [solid.radius_m, solid.b_m[2], 0.0]
        body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=solid.a_m, size=size, **settings)
