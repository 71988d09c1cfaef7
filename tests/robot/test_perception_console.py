"""How often the detectors are right, in a scene of the console with clutter, light and look-alikes drawn at random.

The rates that they are held to are those of docs/perception.md; 250 cases each were measured there (``slow`` below).
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
import pytest

from teleop_sim.robot.perception import camera, coarse, console_model, fine, lidar
from teleop_sim.robot.perception.rays import Light, SensorPose
from teleop_sim.world import console

RIGHT_COARSE_M = 0.45  # level; fine detection looks 0.65 m around
RIGHT_KNOB_M = 0.04


def geom(kind, size, pos, rgb, euler=(0, 0, 0), material=""):
    def put(values):
        return " ".join(f"{v:.6f}" for v in values)

    kind = f'<geom type="{kind}" size="{put(size)}" pos="{put(pos)}" euler="{put(euler)}" rgba="{put(rgb)} 1"'
    return kind + (f' material="{material}"/>' if material else "/>")


def wheel(left, angle):
    x, y, z = (np.array(v) for v in console.wheel_axes())
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, np.stack([x, y, z], axis=1).ravel())
    at = " ".join(f"{v:.6f}" for v in console.wheel_centre(left))
    u, v = console.KNOB_ORBIT_M * np.cos(angle), console.KNOB_ORBIT_M * np.sin(angle)
    parts = geom(
        "cylinder",
        (console.WHEEL_RADIUS_M, console.WHEEL_HALF_THICKNESS_M),
        (0, 0, 0),
        console.RED if left else console.BLUE,
    )
    parts += geom("cylinder", (console.STEM_RADIUS_M, 0.03), (u, v, 0.04), console.GREY)
    parts += geom("sphere", (console.KNOB_RADIUS_M,), (u, v, console.KNOB_HEIGHT_M), console.GREY)
    return f'<body pos="{at}" quat="{" ".join(f"{q:.8f}" for q in quat)}">{parts}</body>'


def clutter(rng, lookalike):
    parts = geom("cylinder", (0.09, 0.75), (1.725, 0, 0.75), (0.7, 0.7, 0.7))
    parts += geom("cylinder", (1.1, 0.03), (1.475, 0, 2.1), (0.85, 0.85, 0.83), (0, -0.9, 0))
    browns = [(0.5, 0.42, 0.3), (0.3, 0.32, 0.3), (0.75, 0.72, 0.6), (0.6, 0.35, 0.12), (0.2, 0.35, 0.25)]
    for _ in range(8):
        bearing, far, half = rng.uniform(-1.3, 1.3), rng.uniform(1.3, 4.5), rng.uniform(0.1, 0.4, 3)
        at = (far * np.cos(bearing), far * np.sin(bearing), half[2])
        parts += geom("box", half, at, browns[rng.integers(len(browns))], (0, 0, rng.uniform(0, 3)))
    ahead, aside = rng.uniform(-0.3, 1.2), rng.choice([-1, 1]) * rng.uniform(0.8, 1.8)
    for i, rgb in enumerate({"none": (), "red": (console.RED,), "pair": (console.RED, console.BLUE)}[lookalike]):
        parts += geom("cylinder", (0.03, 0.42), (ahead, aside - 0.4 * i, 0.42), (0.5, 0.5, 0.5))
        lean = (0, -rng.uniform(0.3, 1.2), 0)
        parts += geom("cylinder", (0.16, 0.012), (ahead, aside - 0.4 * i, 0.86), rgb, lean)
    return parts


@dataclass
class Scene:
    """The console somewhere in the odometry frame, with two knobs at random angles. Implements ``Rays``."""

    pose: np.ndarray  # foot x, y, z, yaw
    angles: np.ndarray
    model: mujoco.MjModel
    data: mujoco.MjData

    def cast(self, origin, directions, cutoff_m):
        n = len(directions)
        geoms, distance, normal = np.empty(n, np.int32), np.empty(n), np.empty(3 * n)
        flat = np.ascontiguousarray(directions).ravel()
        mujoco.mj_multiRay(
            self.model, self.data, origin, flat, None, 1, -1, geoms, distance, normal, n, cutoff_m
        )
        return distance, geoms, normal.reshape(-1, 3)

    def colour(self, geoms):
        return self.model.geom_rgba[geoms, :3].astype(float)

    def textured(self, geoms):
        return self.model.geom_matid[geoms] >= 0

    def place(self, *local):
        """From the console's frame to the odometry frame."""
        c, s = np.cos(self.pose[3]), np.sin(self.pose[3])
        x, y, z = local
        return self.pose[:3] + np.array([c * x - s * y, s * x + c * y, z])

    def knobs(self):
        return [self.place(*console.knob_centre(left, a)) for left, a in zip((True, False), self.angles, strict=True)]


def build(rng, lookalike="none"):
    pose = np.array([*rng.uniform(-3, 3, 2), -console.WALKWAY_HEIGHT_M, rng.uniform(-np.pi, np.pi)])
    angles = rng.uniform(-np.pi, np.pi, 2)
    body = "".join(geom("box", b.half, b.centre, console.CONSOLE_GREY, (0, -b.lean_rad, 0)) for b in console.BLOCKS)
    body += wheel(True, angles[0]) + wheel(False, angles[1]) + clutter(rng, lookalike)
    for k in range(6):
        body += geom("box", (0.762, 0.762, 0.05), (-0.913 - 1.524 * k, 0, 0.05), (0.62, 0.62, 0.6), (0, 0, 0), "soil")
    at = " ".join(f"{v:.6f}" for v in pose[:3])
    xml = f"""<mujoco><compiler angle="radian"/><asset><material name="soil"/></asset><worldbody>
      {geom("plane", (30, 30, 0.1), (0, 0, pose[2]), (0.55, 0.36, 0.24), (0, 0, 0), "soil")}
      <body pos="{at}" euler="0 0 {pose[3]:.6f}">{body}</body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return Scene(pose, angles, model, data)


def turned(yaw, pitch):
    cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    return np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])


def head(scene, rng, level_m, bearing=0.5, aim=0.15):
    """A head ``level_m`` before the wheels, 1.6 to 1.7 m over the walkway, looking at the console up to ``aim`` wrong."""
    b = rng.uniform(-bearing, bearing)
    eye = scene.place(-level_m * np.cos(b), level_m * np.sin(b), rng.uniform(1.7, 1.8))
    way = scene.place(0, 0, console.WHEEL_HEIGHT_M) - eye
    yaw = np.arctan2(way[1], way[0]) + rng.uniform(-aim, aim)
    return SensorPose(turned(yaw, np.arctan2(-way[2], level_m) + rng.uniform(-aim, aim)), eye)


def any_light(rng):
    up, around, level = rng.uniform(0.35, 1.4), rng.uniform(-np.pi, np.pi), rng.uniform(0.35, 1.4)
    to_sun = np.array([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)])
    warm = rng.uniform(0, 0.35)
    return Light(to_sun, 0.9 * level * np.array([1, 1 - 0.4 * warm, 1 - warm]), level * rng.uniform(0.12, 0.4))


def see_coarse(seed, level_m, lookalike="none"):
    """-> right, wrong or the reason of nothing."""
    rng = np.random.default_rng(seed)
    scene = build(rng, lookalike)
    level_m = rng.uniform(*level_m)
    found, why = coarse.detect(scene, head(scene, rng, level_m), any_light(rng), rng)
    if found is None:
        return why
    middle = (np.array(found.yaw_wheel) + np.array(found.pitch_wheel)) / 2
    return "right" if np.linalg.norm((middle - scene.pose[:3])[:2]) < RIGHT_COARSE_M else "wrong"


def see_fine(seed, level_m, lookalike="red", off_m=0.07):
    """-> right, wrong or the reason of nothing; and the worse knob's error [m], yaw error [rad], foot's error [m]."""
    rng = np.random.default_rng(seed)
    scene = build(rng, lookalike)
    pose = head(scene, rng, level_m)
    region = scene.place(*rng.normal(0, off_m, 2), console.WHEEL_HEIGHT_M)
    points = lidar.half_turn(scene, pose, rng, tuple(region))
    fix, why = fine.detect(points, tuple(region), tuple(pose.position), rng)
    if fix is None:
        return why, np.nan, np.nan, np.nan
    knob = max(
        np.linalg.norm(knob_of(h) - true)
        for h, true in zip((fix.yaw_handle, fix.pitch_handle), scene.knobs(), strict=True)
    )
    yaw = abs((fix.pose[2] - scene.pose[3] + np.pi) % (2 * np.pi) - np.pi)
    foot = np.linalg.norm(np.array([*fix.pose[:2], fix.ground_z_m]) - scene.pose[:3])
    return ("right" if knob < RIGHT_KNOB_M else "wrong"), knob, yaw, foot


def knob_of(handle):
    axis, zero = np.array(handle.axis), np.array(handle.zero)
    around = np.cos(handle.angle_rad) * zero + np.sin(handle.angle_rad) * np.cross(axis, zero)
    return np.array(handle.centre) + handle.height_m * axis + handle.radius_m * around
