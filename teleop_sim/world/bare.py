"""The plainest scenery: a level floor."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco

from teleop_sim.world import contact
from teleop_sim.world.light import NOON, Light
from teleop_sim.world.plant import Plant


@dataclass(frozen=True)
class BareFloor:
    """A floor at z = 0 with one friction coefficient; no task, no status."""

    friction: float = 0.8
    light: Light = NOON

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add the floor."""
        spec.worldbody.add_geom(
            name="floor",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[20.0, 20.0, 0.1],
            condim=3,
            friction=contact.rough(self.friction),
            solref=contact.SOLE_SOLREF,
            **contact.WORLD,
        )

    def tick(self, plant: Plant, memory: tuple[float, ...]) -> tuple[float, ...]:
        """Nothing in it moves by itself."""
        return memory

    def status(self, plant: Plant, memory: tuple[float, ...]) -> dict[str, float]:
        """There is no task."""
        return {}
