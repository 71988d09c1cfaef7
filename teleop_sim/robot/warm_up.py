"""Compile the control law once: ``python -m teleop_sim.robot.warm_up``. Numba keeps the result beside the sources."""

from __future__ import annotations

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Look
from teleop_sim.robot.episode import NoiseKey, perform
from teleop_sim.robot.valkyrie import valkyrie
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import Plant


def main() -> None:
    """Move the head of a robot on a bare floor."""
    robot = valkyrie()
    body = Body(robot, Plant(robot.model, BareFloor()))
    perform(body, Look(0.3, duration_s=0.1), body.standing(), NoiseKey(0, 0, 0))


if __name__ == "__main__":
    main()
