"""A robot's own fingers as a hand: its published links and joints with a capsule and a servo each.

A robot folds them into its palms by default, because they cost half as much again as the rest of it. Here they are
cut off its description and made parts of a hand in the tool frame.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from teleop_sim.world import contact
from teleop_sim.world.description import Description, Joint, Vector, rotation_rpy
from teleop_sim.world.hand_parts import ORIGIN, Drive, HandPart, Lump, Placed, Solid, opened


@dataclass(frozen=True)
class Closing:
    """How joints whose names match ``pattern`` close: reference when open and when shut [rad]."""

    pattern: str
    open_rad: float
    shut_rad: float


@dataclass(frozen=True)
class FingerData:
    """What a description leaves out of fingers.

    Attributes:
        radius_m: of all phalanges. tips_m: ends of links that carry none, by pattern of the link's name.
        tip_force_n: with which a stretched finger presses; each joint's torque limit is that times its way to the tip.
        kp_per_nm, kv_per_nm, damping, armature: servo gains by a joint's torque limit [1/rad, s/rad], the joint's own
            damping [N m s/rad] and its rotor's inertia [kg m^2].
        friction: of the skin; the larger of it and the handle's counts.
        closing: the first that matches counts.

    """

    radius_m: float
    tips_m: tuple[tuple[str, Vector], ...]
    tip_force_n: float
    closing: tuple[Closing, ...]
    kp_per_nm: float = 8.0
    kv_per_nm: float = 0.2
    damping: float = 0.02
    armature: float = 0.002
    friction: float = contact.OWN_FRICTION


@dataclass(frozen=True)
class FingerHand:
    """Fingers on a palm. ``fixed``: the palm's solids, massless: its link has its mass.

    Not modelled: tendons and the coupling of joints by them (each joint has a servo), skin, contact of one finger with
    another or with its own palm.
    """

    fixed: tuple[Solid, ...]
    parts: tuple[HandPart, ...]

    @cached_property
    def mass_kg(self) -> float:
        """Of the fingers."""
        return sum(part.link.mass_kg for part in self.parts if part.link is not None)

    @cached_property
    def lumps(self) -> tuple[Lump, ...]:
        """Every phalanx of the open hand as a small cylinder."""
        by_part = dict(zip((p.name for p in self.parts), _frames(self), strict=True))
        found = []
        for part in self.parts:
            if part.link is not None:
                placed = by_part[part.name]
                x, y, z = placed.position_m + placed.rotation @ np.array(part.link.com_m)
                found.append(Lump(part.link.mass_kg, (float(x), float(y), float(z)), 0.01, 0.02))
        return tuple(found)


def _frames(hand: FingerHand) -> tuple[Placed, ...]:
    """Where the bodies of the open hand are: one solid a part stands for it."""
    mark = Solid("", "box", ORIGIN, ORIGIN)
    return opened(FingerHand((), tuple(replace(part, solids=(mark,)) for part in hand.parts)))


def cut_off(description: Description, pattern: str) -> Description:
    """The description without the links whose names match and all that they carry; their mass goes with them."""
    gone = re.compile(pattern)
    links = tuple(link for link in description.links if not gone.search(link.name))
    left = {link.name for link in links}
    return replace(
        description,
        links=links,
        joints=tuple(j for j in description.joints if j.child in left),
        frames=tuple(f for f in description.frames if f.parent in left),
    )


def finger_parts(
    description: Description,
    palm: str,
    pattern: str,
    prefix: str,
    tool: tuple[np.ndarray, np.ndarray],
    data: FingerData,
) -> tuple[HandPart, ...]:
    """Parts of the hand on ``palm`` from links that match ``pattern``, in the tool frame at (3,), (3, 3) on the palm.

    ``prefix``: what names of this side begin with; it is dropped.
    """
    gone = re.compile(pattern)
    joints = [j for j in _below(description, palm) if gone.search(j.child)]
    names = {j.child: j.name.removeprefix(prefix) for j in joints}
    position, rotation = tool
    parts = []
    for joint in joints:
        at, turn = np.array(joint.xyz_m), rotation_rpy(joint.rpy_rad)
        if joint.parent == palm:
            at, turn = rotation.T @ (at - position), rotation.T @ turn
        x, y, z = at
        parts.append(
            HandPart(
                name=names[joint.child],
                parent=names.get(joint.parent, ""),
                position_m=(float(x), float(y), float(z)),
                rotation=turn,
                drive=_drive(description, joint, data),
                solids=_phalanx(description, joint, names[joint.child], data),
                link=description.link(joint.child),
            )
        )
    return tuple(parts)


def _below(description: Description, link: str) -> Iterable[Joint]:
    """Joints beyond a link, depth first."""
    for joint in description.children(link):
        yield joint
        yield from _below(description, joint.child)


def _end(description: Description, link: str, data: FingerData) -> np.ndarray:
    """Where a link ends: at the next joint, or where its tip is told to be."""
    onward = description.children(link)
    if onward:
        return np.array(onward[0].xyz_m)
    return np.array(next(tip for pattern, tip in data.tips_m if re.search(pattern, link)))


def _phalanx(description: Description, joint: Joint, name: str, data: FingerData) -> tuple[Solid, ...]:
    """Its capsule; none for a link whose next joint is in the same place."""
    x, y, z = (float(v) for v in _end(description, joint.child, data))
    if (x, y, z) == ORIGIN:
        return ()
    return (Solid(f"Bar{name}", "capsule", ORIGIN, (x, y, z), data.radius_m, friction=data.friction),)


def _drive(description: Description, joint: Joint, data: FingerData) -> Drive:
    reach_m, link = 0.0, joint.child
    while True:
        reach_m += float(np.linalg.norm(_end(description, link, data)))
        onward = description.children(link)
        if not onward:
            break
        link = onward[0].child
    limit = data.tip_force_n * reach_m
    closing = next(c for c in data.closing if re.search(c.pattern, joint.name))
    # Left and right fingers bend about the same axes: they close towards the farther of their limits.
    way = 1.0 if joint.upper_rad >= -joint.lower_rad else -1.0
    return Drive(
        rotary=True,
        axis=joint.axis,
        lower=joint.lower_rad,
        upper=joint.upper_rad,
        open_q=way * closing.open_rad,
        shut_q=way * closing.shut_rad,
        kp=data.kp_per_nm * limit,
        kv=data.kv_per_nm * limit,
        limit=limit,
        damping=data.damping,
        armature=data.armature,
    )
