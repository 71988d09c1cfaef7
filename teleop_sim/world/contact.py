"""Who touches whom, how hard and how rough: the same for robots and for every scenery.

MuJoCo lets two geoms touch if the ``contype`` of one shares a bit with the ``conaffinity`` of the other. Bits: the
world 1, robot bodies 2, hands 4, the left arm 8, the right arm 16, the left leg 32. So a robot touches the world, an
arm with its hand touches trunk, legs and the other arm, and one leg the other. The world touches nothing of itself.
Links of one arm or leg, and legs and trunk, cannot touch: joint limits keep them apart, and their shapes are too rough
near the joints.

Of two geoms that touch, MuJoCo takes the *larger* friction: a robot's own is small, so that the world's decides.
"""

from __future__ import annotations

from typing import Any, Final, Literal

WORLD: Final[dict[str, Any]] = {"contype": 1, "conaffinity": 6, "group": 0}
"""Solid things round the robot; its rays hit group 0 alone."""

DECOR: Final[dict[str, Any]] = {"contype": 0, "conaffinity": 0, "group": 0, "mass": 0.0}
"""Seen, but never touched."""

ROBOT_GROUP: Final = 1
"""Geom group of the robot: rays of its own sensors leave it out."""

Part = Literal["trunk", "left_arm", "right_arm", "left_leg", "right_leg"]
"""Parts of a robot that can touch each other."""

_ARMS = 8 + 16
_BITS: Final[dict[Part, tuple[int, int]]] = {
    "trunk": (2, 1 + _ARMS),
    "left_arm": (2 + 8, 1 + 16),
    "right_arm": (2 + 16, 1 + 8),
    "left_leg": (2 + 32, 1 + _ARMS),
    "right_leg": (2, 1 + _ARMS + 32),
}


def robot_part(part: Part) -> dict[str, Any]:
    """Settings of a geom on a part of the robot."""
    kind, other = _BITS[part]
    return {"contype": kind, "conaffinity": other, "group": ROBOT_GROUP}


def hand_of(side: str) -> dict[str, Any]:
    """Settings of a geom on a hand: as its arm, but the world can tell it from one."""
    arm = 8 if side == "left" else 16
    return {"contype": 4 + arm, "conaffinity": 1 + _ARMS - arm, "group": ROBOT_GROUP}


SOLE_SOLREF: Final = (0.01, 1.0)
GRIP_SOLREF: Final = (0.004, 1.0)
"""Time constant [s] and damping ratio of contacts under soles and in hands: measured (soft grips drop the knob)."""

OWN_FRICTION: Final = 0.05
"""Sliding friction of the robot's own geoms (assumed: below all that is drawn for the world)."""


def rough(sliding: float) -> list[float]:
    """MuJoCo's three friction coefficients: sliding as given; torsional [m] and rolling [m] are MuJoCo's defaults."""
    return [sliding, 0.005, 0.0001]
