"""Where a robot's feet were, from the log's samples: forward kinematics of the legs, and the prints they left.

The chain from the pelvis to a foot is that of the robot's description (``teleop_sim/robot/<name>.json``), as Pinocchio
and MuJoCo have it (a test compares). Vectorised over the samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import as_file, files

import numpy as np

from teleop_sim.world.description import Description, Joint, load_description, rotation_rpy

SIDES = ("left", "right")
STILL_M, FLAT, LIFTED_M = 0.01, 0.97, 0.03
"""A foot stands that moves less than this from one sample to the next, whose normal is so much up (cosine), and which
is no more than so much above the lower one of the two. Samples come five times a second (assumed)."""
SAME_M = 0.02
"""Prints of one foot no further apart than this are one (assumed)."""


@dataclass(frozen=True)
class Track:
    """One sole over time: middle of its underside (n, 3) [m], heading (n,) [rad], cosine of its tilt (n,)."""

    place: np.ndarray
    yaw_rad: np.ndarray
    upright: np.ndarray


@dataclass(frozen=True)
class Print:
    """Where a foot stood: side, middle x, y [m], heading [rad], and from when [s]."""

    side: str
    x_m: float
    y_m: float
    yaw_rad: float
    since_s: float


def description_of(robot: str) -> Description | None:
    """The description of a robot by its name; None: there is none."""
    resource = files("teleop_sim.robot").joinpath(f"{robot}.json")
    if not robot.isidentifier() or not resource.is_file():
        return None
    with as_file(resource) as path:
        return load_description(path)


def soles(body: Description, pelvis: np.ndarray, joints: Mapping[str, np.ndarray]) -> dict[str, Track]:
    """Both soles over all samples.

    Args:
        body: whose legs.
        pelvis: (n, 7): position [m] and quaternion w, x, y, z.
        joints: angle (n,) [rad] by name; those that are not given are at zero.

    """
    feet = dict(zip(SIDES, (body.sole.left, body.sole.right), strict=True))
    return {side: _sole(body, pelvis, joints, foot) for side, foot in feet.items()}


def _sole(body: Description, pelvis: np.ndarray, joints: Mapping[str, np.ndarray], foot: str) -> Track:
    R, p = _rotations(pelvis[:, 3:7]), pelvis[:, :3].copy()
    for joint in _chain(body, foot):
        p = p + R @ np.array(joint.xyz_m)
        R = R @ rotation_rpy(joint.rpy_rad) @ _about(joint.axis, joints.get(joint.name, np.zeros(len(p))))
    below = np.array(body.sole.centre_of(foot)) - np.array([0.0, 0.0, 0.5 * body.sole.size_m[2]])
    return Track(p + R @ below, np.arctan2(R[:, 1, 0], R[:, 0, 0]), R[:, 2, 2])


def _chain(body: Description, link: str) -> list[Joint]:
    """Joints from the root to a link."""
    above = {joint.child: joint for joint in body.joints}
    found: list[Joint] = []
    while link != body.root:
        found.append(above[link])
        link = found[-1].parent
    return found[::-1]


def _rotations(quaternions: np.ndarray) -> np.ndarray:
    """Rotation matrices (n, 3, 3) of quaternions w, x, y, z (n, 4)."""
    w, x, y, z = (quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _about(axis: Sequence[float], angle_rad: np.ndarray) -> np.ndarray:
    """Rotations (n, 3, 3) by angles (n,) about one axis: Rodrigues' formula."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    s, c = np.sin(angle_rad)[:, None, None], np.cos(angle_rad)[:, None, None]
    turned: np.ndarray = np.eye(3) + s * K + (1.0 - c) * (K @ K)
    return turned


def prints(t_s: np.ndarray, tracks: Mapping[str, Track]) -> list[Print]:
    """Where the feet stood, in the order in which they came there.

    Args:
        t_s: (n,) times of the samples [s].
        tracks: of both soles, as ``soles`` gives them.

    """
    if not len(t_s):
        return []
    lowest = np.minimum(*(track.place[:, 2] for track in tracks.values()))
    found = [p for side, track in tracks.items() for p in _of_foot(side, t_s, track, lowest)]
    return sorted(found, key=lambda p: (p.since_s, p.side))


def _of_foot(side: str, t_s: np.ndarray, track: Track, lowest: np.ndarray) -> list[Print]:
    moved = np.linalg.norm(np.diff(track.place, axis=0), axis=1)
    still = np.concatenate([[False], moved < STILL_M]) | np.concatenate([moved < STILL_M, [False]])
    stands = still & (track.upright > FLAT) & (track.place[:, 2] < lowest + LIFTED_M)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], stands, [False]]).astype(int)))
    made: list[Print] = []
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        # The last of a stance is where it settled.
        x, y, _ = track.place[end - 1]
        if not made or np.hypot(x - made[-1].x_m, y - made[-1].y_m) > SAME_M:
            made.append(Print(side, float(x), float(y), float(track.yaw_rad[end - 1]), float(t_s[first])))
    return made
