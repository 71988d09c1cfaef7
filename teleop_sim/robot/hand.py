"""Valkyrie's hands: its fingers are stiffly folded into the palms, which carry cage hands in their place."""

from __future__ import annotations

import numpy as np

from teleop_sim.robot.commands import Side
from teleop_sim.world.cage import CageHand

CAGE = CageHand()


def tool_in_palm(side: Side, hand: CageHand = CAGE) -> tuple[np.ndarray, np.ndarray]:
    """Return position (3,) [m] and rotation (3, 3) of the tool frame in the frame of ``<side>Palm``.

    Valkyrie's fingers point to -y of the right palm and +y of the left palm; +x is the palm's side on both.
    """
    y = -1.0 if side == "right" else 1.0
    z_axis = np.array([np.sin(hand.tilt_rad), y * np.cos(hand.tilt_rad), 0.0])
    x_axis = np.array([0.0, 0.0, 1.0])
    rotation = np.column_stack([x_axis, np.cross(z_axis, x_axis), z_axis])
    return np.array([hand.tool_x_m, y * hand.tool_y_m, 0.0]), rotation
