"""Where to look from: views that follow the robot, and one of the whole place.

All distances and angles are assumed: chosen by eye, so that robot and thing are both seen whole.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from teleop_sim.replay.scene import Scene
from teleop_sim.world.drawing import View

SMOOTH_S = 1.0
"""Cameras follow the mean of what the pelvis does so long before and after: they do not sway with each step."""
FOV_RAD = math.radians(45.0)
"""MuJoCo's vertical field of view, its default."""
WIDE, OVER_M, AROUND_M = 1.5, 0.25, 0.5
"""Pictures are at least so much wider than high; what the robot takes up over its
highest joint, and round its way."""
FAR_M, NEAR_M = 1.8, 1.0
"""From where on the robot is at the thing."""


def behind(scene: Scene, t_s: float) -> View:
    """Over the shoulder that is nearer to the thing."""
    x, y, z, heading = followed(scene, t_s)
    near = nearness(scene, x, y)
    ahead_m = 0.27 * scene.tall_m
    at = (x + ahead_m * math.cos(heading), y + ahead_m * math.sin(heading), z)
    aside = math.radians(38.0 + 17.0 * near)
    return View(at, heading - side_of_thing(scene) * aside, math.radians(-22.0), (2.0 - 0.2 * near) * scene.tall_m)


def beside(scene: Scene, t_s: float) -> View:
    """From the side on which the thing is."""
    x, y, z, heading = followed(scene, t_s)
    side = side_of_thing(scene)
    ahead_m = 0.18 * scene.tall_m
    at = (x + ahead_m * math.cos(heading), y + ahead_m * math.sin(heading), z)
    return View(at, heading - side * math.radians(90.0), math.radians(-8.0), 1.9 * scene.tall_m)


def station(scene: Scene, t_s: float) -> View:
    """All of the way and the thing, from a place that stays."""
    del t_s
    track = scene.track
    ground = track.pelvis[:, :2]
    if scene.thing is not None:
        ground = np.vstack([ground, [scene.thing[:2]]])
    low, high = ground.min(axis=0) - AROUND_M, ground.max(axis=0) + AROUND_M
    tall_m = scene.tall_m + OVER_M
    corners = np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (0.0, tall_m)])
    x, y, z = corners.mean(axis=0).tolist()
    heading = _bearing(track.pelvis[0, :2], scene.thing, float(track.headings_rad[0]))
    azimuth, elevation = heading - side_of_thing(scene) * math.radians(50.0), math.radians(-25.0)
    return View((x, y, z), azimuth, elevation, _far_enough(corners - (x, y, z), azimuth, elevation))


def _far_enough(points: np.ndarray, azimuth_rad: float, elevation_rad: float) -> float:
    """The least distance [m] from which all points (n, 3), from where the camera looks, are in a picture."""
    ca, sa, ce, se = math.cos(azimuth_rad), math.sin(azimuth_rad), math.cos(elevation_rad), math.sin(elevation_rad)
    forward, right, up = np.array([[ca * ce, sa * ce, se], [sa, -ca, 0.0], [-ca * se, -sa * se, ce]])
    half = math.tan(FOV_RAD / 2)
    # |right| <= half * WIDE * depth and |up| <= half * depth, where depth = distance + forward.
    needed = np.maximum(np.abs(points @ right) / (half * WIDE), np.abs(points @ up) / half) - points @ forward
    return float(needed.max())


CAMERAS: Mapping[str, Callable[[Scene, float], View]] = {"behind": behind, "side": beside, "station": station}
"""Name on the command line to view."""


def followed(scene: Scene, t_s: float) -> tuple[float, float, float, float]:
    """What a camera follows: x, y, and a height to look at [m], heading [rad]."""
    x, y, z, heading = scene.track.mean(t_s - SMOOTH_S, t_s + SMOOTH_S)
    return x, y, max(0.4, z), heading


def nearness(scene: Scene, x_m: float, y_m: float) -> float:
    """0 far from the thing to 1 at it: hands are seen better from aside."""
    if scene.thing is None:
        return 0.0
    away_m = math.hypot(scene.thing[0] - x_m, scene.thing[1] - y_m)
    share = min(max((FAR_M - away_m) / (FAR_M - NEAR_M), 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


def side_of_thing(scene: Scene) -> float:
    """+1: where the robot came nearest to the thing it had it on its left; -1: on its right or nowhere."""
    if scene.thing is None:
        return -1.0
    away = np.array(scene.thing[:2]) - scene.track.pelvis[:, :2]
    near = int(np.argmin((away**2).sum(axis=1)))
    heading = float(scene.track.headings_rad[near])
    return 1.0 if away[near, 1] * math.cos(heading) >= away[near, 0] * math.sin(heading) else -1.0


def _bearing(start: np.ndarray, thing: tuple[float, float, float] | None, otherwise_rad: float) -> float:
    if thing is None:
        return otherwise_rad
    return math.atan2(thing[1] - float(start[1]), thing[0] - float(start[0]))
