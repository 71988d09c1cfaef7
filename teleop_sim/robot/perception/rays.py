"""What sensors need of the world: rays, light, and where a sensor is.

Everything is in the odometry frame (level, z up, z = 0 on the walkway). Who implements ``Rays`` converts to its own
frame and leaves the robot's own body out: the filter that removes it from images and clouds is assumed perfect, and
arms do not hide what is behind them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from teleop_sim.robot.commands import Vector
from teleop_sim.world.light import Light

__all__ = ["Bools", "Floats", "Ints", "Light", "Rays", "SensorPose", "upright", "vector"]

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]
Bools = npt.NDArray[np.bool_]


class Rays(Protocol):
    """Rays into the world, and how the surfaces look that they hit."""

    def cast(self, origin: Floats, directions: Floats, cutoff_m: float) -> tuple[Floats, Ints, Floats]:
        """Cast rays from one point.

        Args:
            origin: (3,) [m].
            directions: (n, 3) unit vectors.
            cutoff_m: nothing farther is seen.

        Returns:
            distance (n,) [m], -1 where nothing was hit; surface number (n,), -1 likewise; outward normal (n, 3).

        """
        ...

    def colour(self, geoms: Ints) -> Floats:
        """Colour of surfaces by number: (n,) -> red, green, blue (n, 3) in 0..1."""
        ...

    def textured(self, geoms: Ints) -> Bools:
        """Whether surfaces are speckled like soil: (n,) -> (n,)."""
        ...


@dataclass(frozen=True, eq=False)
class SensorPose:
    """Where a sensor is.

    Attributes:
        rotation: (3, 3), columns are the sensor's forward, left and up in the odometry frame.
        position: (3,) [m].

    """

    rotation: Floats
    position: Floats


def vector(point: Floats) -> Vector:
    """A point (3,) as a tuple."""
    return float(point[0]), float(point[1]), float(point[2])


def upright(mounted: Floats) -> Floats:
    """Rotation of a sensor from that of its frame, turned over if the frame hangs upside down.

    Valkyrie's head carries its sensors rolled by pi about their forward axis (``rpy`` of ``left_camera_frame`` and
    ``head_hokuyo_frame``, robot/valkyrie.json): forward is kept, left and up change sign. Images are turned likewise
    before anybody sees them. The frames of Atlas and THORMANG3 stand upright. No head leans by more than 90 degrees.

    Args:
        mounted: (3, 3) rotation of the frame; columns forward, left, up, or forward, right, down.

    Returns:
        (3, 3), columns forward, left, up.

    """
    hangs = mounted[2, 2] < 0.0
    return np.asarray(mounted * np.array([1.0, -1.0, -1.0])) if hangs else np.asarray(mounted)
