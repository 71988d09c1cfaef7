"""The head's spinning LIDAR: a fan of 270 degrees in a plane through the forward axis, which rolls about that axis.

Modelled: fan, spindle and its motion during a fan, range limits, range noise; what calibration gets wrong.
Not modelled: motion of the head while it spins, mixed points at edges, dark or shiny surfaces, intensity, beam width.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Protocol

import numpy as np

from teleop_sim.robot.commands import Side, Vector
from teleop_sim.robot.perception.miscalibrated import mounted
from teleop_sim.robot.perception.rays import Bools, Floats, Ints, Rays, SensorPose
from teleop_sim.world.sense_errors import EXACT, SenseErrors

# openhumanoids/val_description @5257ff7, multisense_sl.urdf (Hokuyo UTM-30LX-EW).
SCAN_RATE_HZ: Final = 40.0
SAMPLES: Final = 1081
FAN_RAD: Final = np.radians(270.0)
RANGE_M: Final = (0.1, 30.0)
NOISE_SD_M: Final = 0.01
# WPI-Humanoid-Robotics-Lab/SpaceRoboticsChallenge @ea36ad7: init.py sets the spindle's speed.
SPINDLE_RAD_S: Final = 0.8
HALF_TURN_S: Final = np.pi / SPINDLE_RAD_S
"""Half a turn covers everything, because the fan reaches to both sides of the axis."""

SWEEP_SHARE: Final = FAN_RAD / (2.0 * np.pi)
"""Share of a scan's period in which the mirror, which turns once, sweeps the fan; the rest looks at the housing."""

SCANS: Final = round(HALF_TURN_S * SCAN_RATE_HZ)
REGION_RADIUS_M: Final = 0.75  # the console's wheels and face fit into it
THIN: Final = 4  # assumed: away from a region one ray in so many is cast
HAND_RADIUS_M: Final = 0.25  # assumed: a hand is within 0.13 m of its tool, and a mounting off by less than the rest
MODELS: Final = 8  # assumed: so many times noise is tried to see where a hand is expected
NEAR_AXIS_RAD: Final = np.radians(30.0)  # assumed: nearer to the axis neighbouring scans crowd


@lru_cache(maxsize=1)
def half_turn_directions() -> Floats:
    """Unit directions of half a turn: (SCANS * SAMPLES, 3), scan by scan, forward, left, up; read-only."""
    fan = np.linspace(-FAN_RAD / 2.0, FAN_RAD / 2.0, SAMPLES)
    # The spindle goes on while the mirror sweeps: samples of one fan lie in no plane.
    periods = np.arange(SCANS)[:, None] + SWEEP_SHARE * np.linspace(0.0, 1.0, SAMPLES)
    s, a = periods * (SPINDLE_RAD_S / SCAN_RATE_HZ), np.broadcast_to(fan, periods.shape)
    d = np.stack([np.cos(a), np.sin(a) * np.cos(s), np.sin(a) * np.sin(s)], axis=-1).reshape(-1, 3)
    d.flags.writeable = False
    return d


@lru_cache(maxsize=1)
def thinned() -> Bools:
    """Which rays are kept away from a region: one in four; (SCANS * SAMPLES,), read-only.

    Near the axis neighbouring scans crowd together, so there whole scans are left out; elsewhere samples of a scan.
    """
    fan = np.abs(np.linspace(-FAN_RAD / 2.0, FAN_RAD / 2.0, SAMPLES))
    by_scan = (np.arange(SCANS) % THIN == 0)[:, None] & (fan < NEAR_AXIS_RAD)
    by_sample = (np.arange(SAMPLES) % THIN == 0) & (fan >= NEAR_AXIS_RAD)
    keep: Bools = (by_scan | by_sample).ravel()
    keep.flags.writeable = False
    return keep


def half_turn(
    rays: Rays,
    pose: SensorPose,
    rng: np.random.Generator,
    region: Vector | None = None,
    errors: SenseErrors = EXACT,
) -> Floats:
    """Points of half a turn of the spindle, which takes ``HALF_TURN_S``.

    Args:
        rays: the world, without the robot.
        pose: where the LIDAR is believed to be, at rest.
        rng: range noise, one draw a point.
        region: where full density is wanted: all rays within 0.75 m of it are cast, and one in four elsewhere.
            None: all rays everywhere. Leaving rays out saves computing; the robot's LIDAR would give them all.
        errors: of mounting, spindle and ranges.

    Returns:
        (n, 3) in the odometry frame [m].

    """
    directions = half_turn_directions()
    if region is not None:
        # Chosen in the sensor's frame: only what is cast need be turned into the world's.
        way = (np.asarray(region) - pose.position) @ pose.rotation
        directions = directions[thinned() | _towards(directions, way)]
    believed = directions @ pose.rotation.T
    true, cast = _true_rays(directions, pose, errors)
    distance, _, _ = rays.cast(true.position, cast, RANGE_M[1])
    seen = distance > RANGE_M[0]
    range_m = distance[seen] + rng.normal(0.0, errors.range_noise * NOISE_SD_M, int(seen.sum()))
    return np.asarray(pose.position + believed[seen] * range_m[:, None])


class OwnRays(Protocol):
    """Rays that the robot's own body stops, too (``world.plant.Plant``)."""

    def cast_robot(
        self, origin: Floats, directions: Floats, cutoff_m: float, frame: str, alone: bool
    ) -> tuple[Floats, Ints]:
        """Cast rays; ``frame``: of the sensor. ``alone``: there is no world. Distances (n,) [m] and surfaces (n,)."""
        ...

    def on_hand(self, geoms: Ints, side: str) -> Bools:
        """Whether surfaces are those of a hand: (n,)."""
        ...


@dataclass(frozen=True, eq=False)
class HandPoints:
    """Points on a hand, odometry frame [m].

    Attributes:
        seen: (n, 3).
        model: (MODELS, m, 3), what the robot's own model expects, each time with noise of its own.

    """

    seen: Floats
    model: Floats


def hand_points(
    rays: OwnRays,
    frame: str,
    pose: SensorPose,
    tool_m: Vector,
    side: Side,
    rng: np.random.Generator,
    errors: SenseErrors = EXACT,
) -> HandPoints:
    """What half a turn has on one of the robot's hands, and what it should have.

    Which returns are the hand's is taken to be known, as the filter that removes them from clouds is. Joints are
    believed to be where they are; only the sensor's own errors part what is seen from the model.

    Args:
        rays: the robot in its world.
        frame: the LIDAR's. pose: where it is believed to be, at rest.
        tool_m: of the hand; ``side``: which.
        rng: range noise, one draw a point, and the data sheet's in the model.
        errors: of mounting, spindle and ranges.

    """
    directions = half_turn_directions()
    way = (np.asarray(tool_m) - pose.position) @ pose.rotation
    directions = directions[_towards(directions, way, HAND_RADIUS_M)]
    believed = directions @ pose.rotation.T
    true, cast = _true_rays(directions, pose, errors)
    distance, surface = rays.cast_robot(true.position, cast, RANGE_M[1], frame, alone=False)
    seen = (distance > RANGE_M[0]) & rays.on_hand(surface, side)
    range_m = distance[seen] + rng.normal(0.0, errors.range_noise * NOISE_SD_M, int(seen.sum()))
    points = pose.position + believed[seen] * range_m[:, None]
    distance, surface = rays.cast_robot(pose.position, believed, RANGE_M[1], frame, alone=True)
    expected = (distance > RANGE_M[0]) & rays.on_hand(surface, side)
    # Voxels that noise alone has filled draw a middle aside: it is expected as it would be seen.
    noise_m = rng.normal(0.0, NOISE_SD_M, (MODELS, int(expected.sum())))
    model = pose.position + believed[expected] * (distance[expected] + noise_m)[..., None]
    return HandPoints(points, model)


def _true_rays(directions: Floats, pose: SensorPose, errors: SenseErrors) -> tuple[SensorPose, Floats]:
    """Where the sensor truly is that is believed to be at a pose, and its rays' (n, 3) true directions there."""
    true, off = mounted(pose, errors.lidar), errors.spindle_rad
    return true, (rolled(directions, off) if off else directions) @ true.rotation.T


def rolled(directions: Floats, angle_rad: float) -> Floats:
    """Directions (n, 3) turned about the forward axis, as the spindle turns."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.asarray(directions @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]]))


def _towards(directions: Floats, way: Floats, radius_m: float = REGION_RADIUS_M) -> Bools:
    """Which rays can pass within a region's radius of its centre."""
    length = float(np.linalg.norm(way))
    if length <= radius_m:
        return np.ones(len(directions), np.bool_)
    return np.asarray(directions @ (way / length) > np.sqrt(1.0 - (radius_m / length) ** 2))
