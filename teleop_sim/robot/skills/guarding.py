"""What force at a hand ends a movement that was ordered by hand."""

from __future__ import annotations

from teleop_sim.robot.body import Body
from teleop_sim.robot.kinematics import kinematics_of
from teleop_sim.world.plant import GRAVITY_M_S2

MOST_N = 60.0
"""Assumed: levers take 35 N; Act stops at 80."""
SHIFT_M, HEIGHT_M = 0.06, 1.0
"""So far may a level force at so high a hand shift the centre of pressure (assumed: half a sole, 10 to 13 cm, and some
to spare). THORMANG3 fell at doors with 40 N and stood with 30 (4 ways into one); this gives it 25."""


def guard_n(body: Body) -> float:
    """Force [N] beyond what a hand felt at first: F h / (m g) is what a force F at height h shifts the pressure by."""
    mass_kg = kinematics_of(body.spec.model.description.name).mass_kg
    return min(MOST_N, mass_kg * GRAVITY_M_S2 * SHIFT_M / HEIGHT_M)
