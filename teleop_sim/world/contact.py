"""Who touches whom, how hard and how rough: the same for robots and for every scenery.

MuJoCo lets two geoms touch if the ``contype`` of one shares a bit with the ``conaffinity`` of the other. The world has
bit 1, robot bodies and soles bit 2, hands bit 4; each lists only the others. So a robot touches the world and nothing
of itself, and the world nothing of itself. Not modelled: self-collision.

Of two geoms that touch, MuJoCo takes the *larger* friction: a robot's own is small, so that the world's decides.
"""

from __future__ import annotations

from typing import Any, Final

WORLD: Final[dict[str, Any]] = {"contype": 1, "conaffinity": 6, "group": 0}
"""Solid things round the robot; its rays hit group 0 alone."""

DECOR: Final[dict[str, Any]] = {"contype": 0, "conaffinity": 0, "group": 0, "mass": 0.0}
"""Seen, but never touched."""

ROBOT_GROUP: Final = 1
"""Geom group of the robot: rays of its own sensors leave it out."""

ROBOT: Final[dict[str, Any]] = {"contype": 2, "conaffinity": 1, "group": ROBOT_GROUP}
HAND: Final[dict[str, Any]] = {"contype": 4, "conaffinity": 1, "group": ROBOT_GROUP}

SOLE_SOLREF: Final = (0.01, 1.0)
GRIP_SOLREF: Final = (0.004, 1.0)
"""Time constant [s] and damping ratio of contacts under soles and in hands: measured (soft grips drop the knob)."""

OWN_FRICTION: Final = 0.05
"""Sliding friction of the robot's own geoms (assumed: below all that is drawn for the world)."""


def rough(sliding: float) -> list[float]:
    """MuJoCo's three friction coefficients: sliding as given; torsional [m] and rolling [m] are MuJoCo's defaults."""
    return [sliding, 0.005, 0.0001]
