"""Postures that Team ViGIR's behaviours name, for a side or for both, as angles of some joints.

Names, sides and Atlas's angles at a door: FlexBE's ``MoveitPredefinedPoseState`` (team-vigir/flexbe_behaviors,
``flexbe_atlas_states``), for Atlas v4 and the first THORMANG. Where their figures do not fit, they are ours:

- Arms at rest are as for walking. Walks were tried with these; THORMANG3 falls with its hands at its sides.
- The torso turns by ``FULL_RAD`` where they turn by 0.55 and 1.02 rad, less turns in their proportion: from where our
  robots stand more would swing the idle hand into the door.
- The first THORMANG's arm angles are beyond THORMANG3's limits: its arm is put ahead by inverse kinematics.

A posture's name is theirs, with the side behind a dot where it has one: ``TURN_TORSO_FULL.left``.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from teleop_sim.robot.commands import Posture
from teleop_sim.robot.hands import base_name
from teleop_sim.robot.spec import RobotSpec

FULL_RAD = 0.10
"""Of the torso, all that a turn gets (assumed: the idle hand comes 4 cm nearer to the door)."""
TURNS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "atlas": {"TURN_TORSO_SLIGHTLY": 0.20 / 0.55, "TURN_TORSO_MORE": 0.40 / 0.55, "TURN_TORSO_FULL": 1.0},
        "thormang3": {"TURN_TORSO_SLIGHTLY": 0.30 / 1.02, "TURN_TORSO_MORE": 0.60 / 1.02, "TURN_TORSO_FULL": 1.0},
    }
)
"""Shares of a full turn, from the published angles; towards the side named."""
HOMES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "STAND_POSE": ("left", "right"),
        "BOTH_ARMS_SIDES": ("left", "right"),
        "SINGLE_ARM_STAND.left": ("left",),
        "SINGLE_ARM_STAND.right": ("right",),
    }
)
"""Arms as for walking."""
ARMS: Mapping[str, Mapping[str, tuple[float, ...]]] = MappingProxyType(
    {
        "atlas": {
            "DOOR_READY_POSE": (-0.29, -0.22, 1.87, 2.17, -0.17, 0.81, 0.12),
            "DOOR_OPEN_POSE_TURNED": (-0.70, -0.09, 1.93, 0.66, -0.15, 1.52, 0.12),
            # Published for the right arm alone.
            "DOOR_OPEN_POSE_SIDE": (0.00, -0.54, 0.94, 1.04, 0.80, -0.50, 0.70),
        },
        "thormang3": {
            "DOOR_READY_POSE": (-0.10, 0.00, 0.00, 0.35, 0.00, 0.00, 0.00),
            "DOOR_OPEN_POSE_TURNED": (-0.69, 0.89, 0.47, 0.34, -0.06, -0.86, 0.04),
            "DOOR_OPEN_POSE_SIDE": (-0.24, 0.08, 0.00, -0.49, -0.19, 0.42, -0.33),
        },
    }
)
"""Of the left arm, from the shoulder out [rad]."""
MIRROR: Mapping[str, tuple[int, ...]] = MappingProxyType(
    {"atlas": (-1, -1, 1, -1, 1, -1, 1), "thormang3": (-1, -1, -1, -1, -1, -1, -1)}
)
"""Signs of the right arm's angles over the left's, as published."""
SIDES = ("left", "right")


def predefined(robot: str, name: str, side: str) -> Posture | None:
    """The command for a published posture: a side's own, or the one that is the same for all sides.

    None where the robot has no such posture for that side, as published: the state then fails.
    """
    names = _names(base_name(robot))
    return next((Posture(each) for each in (f"{name}.{side}", name) if each in names), None)


def angles_of(spec: RobotSpec, name: str, home: Mapping[str, float]) -> dict[str, float] | None:
    """Angles by joint [rad] of a published posture, or None where that is none of them. ``home``: as for walking."""
    robot = base_name(spec.model.description.name)
    kind, _, side = name.partition(".")
    if name not in _names(robot):
        return None
    if kind == "TURN_TORSO_CENTER_POSE":
        return {joint: home[joint] for joint in spec.torso}
    if kind in TURNS[robot]:
        sign = 1.0 if side == "left" else -1.0
        return {**dict.fromkeys(spec.torso, 0.0), spec.torso[0]: sign * FULL_RAD * TURNS[robot][kind]}
    if name in HOMES:
        return {joint: home[joint] for each in HOMES[name] for joint in spec.arms[each]}
    signs = MIRROR[robot] if side == "right" else (1,) * len(MIRROR[robot])
    angles = zip(spec.arms[side], signs, ARMS[robot][kind], strict=True)
    return {joint: sign * angle for joint, sign, angle in angles}


def _names(robot: str) -> tuple[str, ...]:
    if robot not in TURNS:
        return ()
    sided = (*TURNS[robot], *ARMS[robot])
    return ("TURN_TORSO_CENTER_POSE", *HOMES, *(f"{name}.{side}" for name in sided for side in SIDES))
