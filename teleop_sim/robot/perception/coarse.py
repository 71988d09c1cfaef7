"""Coarse detection: two coloured blobs in an image that could be the console's wheels, and their depth by stereo.

Red is the yaw wheel, on the left of a robot that faces the console, blue the pitch wheel. As in the WPI team's program
the place found serves to walk near; fine detection does the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from teleop_sim.robot.commands import Vector
from teleop_sim.robot.perception.camera import (
    BASELINE_M,
    HEIGHT,
    WIDTH,
    Image,
    focal_px,
    pixel_directions,
    take,
    true_directions,
)
from teleop_sim.robot.perception.colours import BLUE, RED, Blob, blobs_of
from teleop_sim.robot.perception.miscalibrated import mounted
from teleop_sim.robot.perception.rays import Floats, Light, Rays, SensorPose, vector
from teleop_sim.robot.sightings import ConsoleGlimpse
from teleop_sim.world.sense_errors import EXACT, SenseErrors

DISPARITY_SD_PX: Final = 0.5
"""Assumed: block matching at the image's own resolution; half its variance common to a blob."""
LEAST_DISPARITY_PX: Final = 0.3  # assumed
STEREO_PIXELS: Final = 60  # assumed: so many pixels of a blob are matched
LEAST_MATCHES: Final = 5  # assumed
STEREO_RANGE_M: Final = 30.0  # assumed: a disparity of 0.4 px

# What two wheels of equal size, 0.4 m apart, can look like: assumed, with room for slant and shade.
AREA_RATIO: Final = (0.4, 2.5)
GAP_IN_SIZES: Final = (0.5, 2.2)
SLANT: Final = 0.9
SEPARATION_M: Final = (0.1, 0.6)  # across the view; the wheels are 0.4 m apart, seen up to 75 degrees from the side
WHEEL_Z_M: Final = (0.3, 1.4)  # over the walkway; the wheels are at 0.81 m
PAIRS_TRIED: Final = 3  # assumed
AVOID_ACROSS_M: Final = 0.3  # assumed: less than a wheel's separation
AVOID_ALONG_SHARE: Final = 0.3  # assumed: of the range: stereo depth is that vague


def detect(
    rays: Rays,
    pose: SensorPose,
    light: Light,
    rng: np.random.Generator,
    avoid: Sequence[Vector] = (),
    width: int = WIDTH,
    height: int = HEIGHT,
    errors: SenseErrors = EXACT,
) -> tuple[ConsoleGlimpse | None, str]:
    """Take an image and look for the console in it.

    Args:
        rays: the world, without the robot.
        pose: of the camera, odometry frame.
        light: sun and ambient light.
        rng: pixel noise and errors of stereo matching.
        avoid: places found wrong before; a pair that looks to be there is refused.
        width: of the image [pixels].
        height: of the image [pixels].
        errors: of the camera pair.

    Returns:
        What was found, and ``ok``; or None and the reason: ``no red``, ``no blue``, ``no pair`` (no two blobs look like
        wheels side by side), ``pair refused`` (too close together, too far apart, at a wrong height, or to be avoided).

    """
    return find(take(rays, pose, light, rng, width, height, errors), rays, pose, rng, avoid, errors)


def find(
    image: Image,
    rays: Rays,
    pose: SensorPose,
    rng: np.random.Generator,
    avoid: Sequence[Vector] = (),
    errors: SenseErrors = EXACT,
) -> tuple[ConsoleGlimpse | None, str]:
    """Look for the console in an image; arguments and result as for ``detect``."""
    red, blue = blobs_of(image, RED), blobs_of(image, BLUE)
    if not red or not blue:
        return None, "no blue" if red else "no red"
    pairs = sorted(
        ((r, b) for r in red for b in blue if _side_by_side(r, b)), key=lambda pair: -(pair[0].area + pair[1].area)
    )
    if not pairs:
        return None, "no pair"
    size = (image.shape[1], image.shape[0])
    for r, b in pairs[:PAIRS_TRIED]:
        at_red = stereo_point(r, rays, pose, rng, size, errors)
        at_blue = stereo_point(b, rays, pose, rng, size, errors)
        if at_red is None or at_blue is None or not _possible(at_red, at_blue, pose.position, avoid):
            continue
        return ConsoleGlimpse(vector(at_red), vector(at_blue)), "ok"
    return None, "pair refused"


def _side_by_side(red: Blob, blue: Blob) -> bool:
    """Whether two blobs look like equal wheels side by side, red on the left."""
    across, down = blue.across - red.across, blue.down - red.down
    gap = np.hypot(across, down)
    size = np.sqrt(red.area + blue.area)
    return bool(
        across > 0.0
        and AREA_RATIO[0] < red.area / blue.area < AREA_RATIO[1]
        and GAP_IN_SIZES[0] * size < gap < GAP_IN_SIZES[1] * size
        and abs(down) <= SLANT * gap
    )


def _possible(red: Floats, blue: Floats, eye: Floats, avoid: Sequence[Vector]) -> bool:
    """Whether two places can be the wheels: separation across the view, height, and not to be avoided."""
    middle = (red + blue) / 2.0
    way = middle - eye
    range_m = float(np.linalg.norm(way))
    # Across the view only: the error of depth would spoil the rest.
    apart = range_m * float(
        np.linalg.norm((red - eye) / np.linalg.norm(red - eye) - (blue - eye) / np.linalg.norm(blue - eye))
    )
    if not (SEPARATION_M[0] < apart < SEPARATION_M[1] and WHEEL_Z_M[0] < middle[2] < WHEEL_Z_M[1]):
        return False
    for place in avoid:
        off = np.asarray(place) - middle
        along = float(off @ way) / range_m
        across = np.sqrt(max(0.0, float(off @ off) - along * along))
        if across < AVOID_ACROSS_M and abs(along) < AVOID_ALONG_SHARE * range_m:
            return False
    return True


def depth_error(depth_m: Floats, focal: float, disparity_error_px: Floats) -> Floats:
    """Depth seen by stereo when the disparity is wrong.

    Disparity is ``f B / z``, so a small error e moves depth by ``z^2 e / (f B)``, towards the camera when e > 0.
    Source: Hartley and Zisserman, Multiple View Geometry, 2nd ed., section 9 (parallel cameras).
    """
    return np.asarray(
        focal * BASELINE_M / np.maximum(focal * BASELINE_M / depth_m + disparity_error_px, LEAST_DISPARITY_PX)
    )


def stereo_point(
    blob: Blob,
    rays: Rays,
    pose: SensorPose,
    rng: np.random.Generator,
    size: tuple[int, int],
    errors: SenseErrors = EXACT,
) -> Floats | None:
    """Median (3,) of the places that stereo gives for pixels of a blob; None when too few have depth.

    Each pixel's true depth comes from a ray; matching is replaced by its error: ``DISPARITY_SD_PX``, half of the
    variance common to the blob (windows overlap), half each pixel's own. Not modelled: mismatches, fattened edges.
    """
    own = rng.normal(size=STEREO_PIXELS)
    common = rng.normal()
    picked = blob.pixels[rng.integers(0, blob.area, STEREO_PIXELS)]
    directions = pixel_directions(*size)[picked]
    true, looks = mounted(pose, errors.camera), true_directions(*size, errors.focal)[picked]
    distance, _, _ = rays.cast(true.position, looks @ true.rotation.T, STEREO_RANGE_M)
    seen = distance > 0.0
    if int(seen.sum()) < LEAST_MATCHES:
        return None
    # Disparity is true focal length times true baseline over true depth; believed ones turn it back into depth.
    depth = distance[seen] * looks[seen, 0] / (errors.focal * errors.baseline)
    error = DISPARITY_SD_PX * (common + own[seen]) / np.sqrt(2.0)
    wrong = depth_error(depth, focal_px(size[0]), error)
    points = pose.position + (directions[seen] * (wrong / directions[seen, 0])[:, None]) @ pose.rotation.T
    return np.asarray(np.median(points, axis=0))
