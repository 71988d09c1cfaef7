"""What a person knows of a thing that a template stands for: where a hand belongs, what is done to it in which order.

Shapes and places are the template's (``templates/library.toml``); where the hand takes it is agreed beforehand with the
field site's programs (``robot/drc_plans.py``), as a template's grasps are.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal

import numpy as np

from teleop_sim.channel.messages import StepName
from teleop_sim.core.errors import UnknownName
from teleop_sim.operators.guide import LEVER_RAD, PUSHED_M, ROUND_RAD
from teleop_sim.templates.poses import Pose, Triple

Goal = Literal[
    "align", "stand", "preview pregrasp", "preview grasp", "pregrasp", "open", "grasp", "close", "turn", "push",
    "adjust",
]  # fmt: skip

STEP_OF: Final[Mapping[str, StepName]] = MappingProxyType(
    {
        "stand": "stand", "pregrasp": "pregrasp", "open": "open", "grasp": "grasp", "close": "close",
        "turn": "affordance", "push": "affordance",
    }
)  # fmt: skip
"""Step of the workflow by goal."""

WELL: Final = frozenset({"reached", "taken", "closed", "opened", "released"})
"""Outcomes of a step that did what it should."""


@dataclass(frozen=True)
class Handling:
    """How a thing is dealt with.

    Attributes:
        template: name in the library.
        goals: from the template to the end, in order.
        affordances: by goal, the template's name for it.
        enough: by goal, amount from which it is achieved [rad, of a push m]; whether goes add up is ``adds``.
        grip_m: (3,) where the hand's tool is when it holds the thing, template's frame; of a wheel: depth behind its
            plane, then the radius, then 0.
        wheel: a wheel with so many spokes, between which the hand goes; 0: none.
        lag_rad: the rod is so far behind a spoke, against the way in which it turns.

    """

    template: str
    goals: tuple[Goal, ...]
    affordances: Mapping[str, str]
    enough: Mapping[str, float]
    grip_m: Triple
    wheel: int = 0
    lag_rad: float = 0.0

    @property
    def adds(self) -> bool:
        """Do several goes of a turn add up? A lever that is let go springs back, a wheel stays."""
        return self.wheel > 0

    def place(self, pose: Pose, hand_m: Triple) -> Triple:
        """Where the tool belongs when it holds the thing, from where it is: odometry frame [m].

        Of a wheel: in the gap between two spokes that is nearest.
        """
        if not self.wheel:
            return _triple(pose.place(np.array(self.grip_m)))
        depth, radius, _ = self.grip_m
        _, y, z = pose.inverse().place(np.array(hand_m))
        pitch = math.tau / self.wheel
        angle = math.atan2(y, z)
        angle = pitch * round((angle + self.lag_rad) / pitch) - self.lag_rad
        return _triple(pose.place(np.array((depth, radius * math.sin(angle), radius * math.cos(angle)))))


TO_THE_HANDLE: Final[tuple[Goal, ...]] = ("align", "stand", "preview pregrasp", "preview grasp", "pregrasp")

HANDLINGS: Final[Mapping[str, Handling]] = MappingProxyType(
    {
        "door": Handling(
            "door",
            (*TO_THE_HANDLE, "open", "grasp", "close", "turn", "push"),
            MappingProxyType({"turn": "turnCW", "push": "push"}),
            MappingProxyType({"turn": LEVER_RAD, "push": PUSHED_M}),
            (-0.05, -0.085, 0.0),
        ),
        "DRC_valve": Handling(
            "DRC_valve",
            (*TO_THE_HANDLE, "grasp", "turn"),
            MappingProxyType({"turn": "open"}),
            MappingProxyType({"turn": ROUND_RAD}),
            (0.015, 0.12, 0.0),
            wheel=4,
            lag_rad=math.radians(40.0),
        ),
    }
)
"""By template. Order: Romay et al., sections 6.1.2, 6.2.1, 6.2.3. A rod between spokes takes no closing."""


def handling(template: str) -> Handling:
    """Of a template.

    Raises:
        UnknownName: nobody has said how it is dealt with.

    """
    if template not in HANDLINGS:
        raise UnknownName("handling of a template", template, tuple(HANDLINGS))
    return HANDLINGS[template]


def _triple(values: np.ndarray) -> Triple:
    x, y, z = (float(v) for v in values)
    return x, y, z
