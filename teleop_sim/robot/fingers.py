"""Valkyrie's and Atlas' own fingers as their hands: where a handle goes among them, how they open and close."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from teleop_sim.core.errors import UnknownName
from teleop_sim.robot.spec import RobotSpec
from teleop_sim.world.description import load_description
from teleop_sim.world.hand_fingers import Closing, FingerData, FingerHand, cut_off, finger_parts
from teleop_sim.world.hand_parts import Solid
from teleop_sim.world.robot_model import HandMount


@dataclass(frozen=True)
class Fitting:
    """A robot's fingers.

    Attributes:
        pattern: of the fingers' links. prefixes: of one side's joints, left and right.
        position_m: where the middle of a handle goes, in the right palm's frame. tilt_rad: of the approach direction,
            from the direction of the stretched fingers to the palm's side.
        mirrored: whether the left palm's y is turned round.
        palm: ends in the right palm's frame and radius [m] of the capsules that stand for it.
        data: phalanges and servos.

    """

    pattern: str
    prefixes: tuple[str, str]
    position_m: tuple[float, float, float]
    tilt_rad: float
    mirrored: bool
    palm: tuple[tuple[tuple[float, float, float], tuple[float, float, float], float], ...]
    data: FingerData


# Where the handle goes, how wide the fingers open and how far they close was found by eye and by trials at the dish
# task's knob; radii, tips, palms and the tips' forces are assumed: the published models have placeholders of 10 and
# 60 N m on every joint and no shapes for fingers.

VALKYRIE = Fitting(
    pattern=r"(Thumb|Finger|Pinky)",
    prefixes=("left", "right"),
    position_m=(0.055, -0.088, 0.0065),
    tilt_rad=np.pi / 4,
    mirrored=True,
    palm=tuple(((-0.008, -0.03, z), (-0.008, -0.09, z), 0.018) for z in (-0.03, 0.0, 0.03)),
    data=FingerData(
        radius_m=0.009,
        tips_m=(("ThumbPitch3", (0.0, -0.004, 0.022)), ("Pitch3", (0.0, -0.022, 0.0))),
        tip_force_n=22.0,
        closing=(
            Closing("ThumbRoll", 1.88, 1.88),
            Closing("ThumbPitch1", 0.0, 0.8),
            Closing("ThumbPitch2", 0.0, 0.9),
            Closing("ThumbPitch3", 0.0, 0.7),
            Closing("Pitch1", 0.0, 1.2),
            Closing("Pitch2", 0.0, 1.4),
            Closing("Pitch3", 0.0, 1.0),
        ),
    ),
)

ATLAS = Fitting(
    pattern=r"_finger_",
    prefixes=("l_", "r_"),
    position_m=(0.0, -0.275, 0.0),
    tilt_rad=0.0,
    mirrored=False,
    palm=(((-0.02, -0.2, 0.0), (0.02, -0.2, 0.0), 0.045),),
    data=FingerData(
        radius_m=0.011,
        tips_m=(("_link_3", (0.035, 0.0, 0.0)),),
        tip_force_n=30.0,
        closing=(
            # The two neighbours are drawn together, or a knob slips between them (measured: parallel they lose it).
            Closing("_palm_finger_1", -0.15, -0.15),
            Closing("_palm_finger_2", 0.15, 0.15),
            Closing("_joint_1", 0.0, 0.6),
            Closing("_joint_2", 0.0, 0.6),
            Closing("_joint_3", 0.0, 0.8),
        ),
    ),
)

FITTINGS: Mapping[str, Fitting] = MappingProxyType({"atlas": ATLAS, "valkyrie": VALKYRIE})
"""By robot. Valkyrie's hand has 13 joints (thumb 4, three fingers of 3), Atlas' Robotiq gripper 11 (three fingers of 3,
two that spread)."""


def with_fingers(spec: RobotSpec) -> RobotSpec:
    """A robot with its own fingers in place of its cages.

    Raises:
        UnknownName: nobody has fitted that robot's.

    """
    name = spec.model.description.name
    if name not in FITTINGS:
        raise UnknownName("robot with fingers", name, tuple(FITTINGS))
    fitting, whole = FITTINGS[name], load_description(Path(__file__).with_name(f"{name}.json"))
    mounts = []
    for old in spec.model.hands:
        y = 1.0 if old.side == "left" and fitting.mirrored else -1.0
        position, rotation = _tool(fitting, y)
        prefix, data = fitting.prefixes[old.side == "right"], _sided(fitting.data, -y)
        parts = finger_parts(whole, old.palm, fitting.pattern, prefix, (position, rotation), data)
        hand = FingerHand(_palm(fitting, -y, position, rotation), parts)
        mounts.append(HandMount(old.side, old.palm, position, rotation, hand))
    model = replace(spec.model, description=cut_off(whole, fitting.pattern), hands=tuple(mounts))
    return replace(spec, model=model)


def _tool(fitting: Fitting, y: float) -> tuple[np.ndarray, np.ndarray]:
    """Tool frame in a palm whose fingers point to ``y``: z between fingers and palm's side, x across the fingers."""
    z_axis = np.array([np.sin(fitting.tilt_rad), y * np.cos(fitting.tilt_rad), 0.0])
    x_axis = np.array([0.0, 0.0, 1.0])
    at_x, at_y, at_z = fitting.position_m
    return np.array([at_x, -y * at_y, at_z]), np.column_stack([x_axis, np.cross(z_axis, x_axis), z_axis])


def _sided(data: FingerData, sign: float) -> FingerData:
    tips = tuple((pattern, (x, sign * y, z)) for pattern, (x, y, z) in data.tips_m)
    return replace(data, tips_m=tips)


def _palm(fitting: Fitting, sign: float, position: np.ndarray, rotation: np.ndarray) -> tuple[Solid, ...]:
    """The palm's capsules in the tool frame."""
    solids = []
    for n, (a, b, radius_m) in enumerate(fitting.palm):
        ends = []
        for x, y, z in (a, b):
            u, v, w = rotation.T @ (np.array([x, sign * y, z]) - position)
            ends.append((float(u), float(v), float(w)))
        solids.append(Solid(f"Flange{n}", "capsule", ends[0], ends[1], radius_m))
    return tuple(solids)
