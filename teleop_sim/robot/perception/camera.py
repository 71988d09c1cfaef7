"""The head's colour camera, as one ray a pixel.

Modelled: field of view, one sun with hard shadows, light from everywhere, speckled soil, pixel noise, calibration.
Not modelled: lens distortion, motion blur, automatic exposure, gloss, colour balance, Bayer pattern, smear.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from teleop_sim.robot.perception.miscalibrated import mounted
from teleop_sim.robot.perception.rays import Bools, Floats, Ints, Light, Rays, SensorPose
from teleop_sim.world.sense_errors import EXACT, SenseErrors

Image = npt.NDArray[np.uint8]
"""(height, width, 3) red, green, blue."""

# openhumanoids/val_description @5257ff7, multisense_sl.urdf: horizontal field and noise of the 1024 x 544 camera.
FIELD_RAD: Final = 1.3962634
NOISE_SD: Final = 0.007
BASELINE_M: Final = 0.07  # between left_camera_frame and right_camera_frame
WIDTH: Final = 320
HEIGHT: Final = 170  # the camera's 1024 x 544 at a width of 320

CUTOFF_M: Final = 60.0  # assumed: beyond it is sky
SUN_M: Final = 500.0  # rays of one shadow cast start here; over a scene of 10 m they differ by 0.02 rad
SHADOW_GAP_M: Final = 0.03  # assumed: a surface does not shade itself over this gap
SKY: Final = (0.75, 0.65, 0.55)  # assumed: dusty


def focal_px(width: int) -> float:
    """Focal length of a pinhole camera with the camera's field of view [pixels]."""
    return float(width / 2.0 / np.tan(FIELD_RAD / 2.0))


@lru_cache(maxsize=4)
def pixel_directions(width: int, height: int) -> Floats:
    """Unit directions through all pixel centres, row by row: (height * width, 3), forward, left, up; read-only."""
    across, down = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    f = focal_px(width)
    d = np.stack([np.full(across.size, f), width / 2.0 - across.ravel(), height / 2.0 - down.ravel()], axis=-1)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    d.flags.writeable = False
    return d


def take(
    rays: Rays,
    pose: SensorPose,
    light: Light,
    rng: np.random.Generator,
    width: int = WIDTH,
    height: int = HEIGHT,
    errors: SenseErrors = EXACT,
) -> Image:
    """Take one image.

    Args:
        rays: the world, without the robot.
        pose: where the camera is believed to be.
        light: sun and ambient light.
        rng: pixel noise, standard deviation 0.007 of full scale; one draw a pixel and colour.
        width: [pixels]; the field of view stays.
        height: [pixels].
        errors: of mounting, lens, exposure and noise.

    Returns:
        (height, width, 3) of 0..255.

    """
    pose = mounted(pose, errors.camera)
    directions = true_directions(width, height, errors.focal) @ pose.rotation.T
    distance, geoms, normal = rays.cast(pose.position, directions, CUTOFF_M)
    hit = np.flatnonzero(geoms >= 0)
    points = pose.position + directions[hit] * distance[hit, None]
    to_sun = np.asarray(light.to_sun)
    facing = normal[hit] @ to_sun
    sunlit = facing > 0.0
    sunlit[sunlit] = _in_sun(rays, points[sunlit], pose.position, to_sun)
    shade = light.ambient + np.where(sunlit, facing, 0.0)[:, None] * np.asarray(light.sun)
    picture = np.empty((width * height, 3), np.float32)
    picture[:] = np.asarray(SKY) * min(1.0, light.sun[0])
    picture[hit] = rays.colour(geoms[hit]) * shade * _speckle(rays, geoms[hit], points)[:, None]
    return _expose(picture * np.float32(errors.exposure), rng, errors.pixel_noise).reshape(height, width, 3)


def project(points: Floats, pose: SensorPose, width: int = WIDTH, height: int = HEIGHT) -> Floats:
    """Where a picture should show points (n, 3), by what is believed of the camera: (n, 2) [px] from its upper left.

    Inverse of ``pixel_directions``. NaN for what is not in front of the camera.
    """
    ahead, left, up = ((points - pose.position) @ pose.rotation).T
    depth = np.where(ahead > 0.0, ahead, np.nan)
    f = focal_px(width)
    return np.stack([width / 2.0 - f * left / depth, height / 2.0 - f * up / depth], axis=-1)


def true_directions(width: int, height: int, focal: float) -> Floats:
    """``pixel_directions`` of a lens whose focal length is ``focal`` times that believed."""
    if focal == 1.0:
        return pixel_directions(width, height)
    d = pixel_directions(width, height) * np.array([focal, 1.0, 1.0])
    return np.asarray(d / np.linalg.norm(d, axis=1, keepdims=True))


def _in_sun(rays: Rays, points: Floats, eye: Floats, to_sun: Floats) -> Bools:
    """Whether points see the sun: rays from far along the sun's direction must reach them."""
    sun = eye + SUN_M * to_sun
    way = points - sun
    length = np.linalg.norm(way, axis=1)
    distance, _, _ = rays.cast(sun, way / length[:, None], 2.0 * SUN_M)
    return np.asarray((distance < 0.0) | (distance > length - SHADOW_GAP_M))


def _speckle(rays: Rays, geoms: Ints, points: Floats) -> Floats:
    """Brightness of grains of 1/60 m on speckled surfaces, 0.75 to 1.15 (assumed); fixed to the ground."""
    grain = np.ones(len(points))
    mask = rays.textured(geoms)
    cell = np.floor(points[mask, :2] * 60.0).astype(np.int64).astype(np.uint32)
    # An integer hash: the ground looks the same in every process. Multipliers: Teschner et al., VMV 2003.
    h = (cell[:, 0] * np.uint32(73856093)) ^ (cell[:, 1] * np.uint32(19349663))
    h = (h ^ (h >> np.uint32(15))) * np.uint32(83492791)
    grain[mask] = 0.75 + 0.4 * ((h >> np.uint32(8)) & np.uint32(0xFFFF)).astype(np.float64) / 65535.0
    return grain


def _expose(picture: npt.NDArray[np.float32], rng: np.random.Generator, noise: float) -> Image:
    noisy = picture + np.float32(noise * NOISE_SD) * rng.standard_normal(picture.shape, np.float32)
    return np.asarray(np.clip(noisy * np.float32(255.0) + np.float32(0.5), 0.0, 255.0).astype(np.uint8))
