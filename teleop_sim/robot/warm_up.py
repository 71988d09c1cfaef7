"""Compile the control law once: ``python -m teleop_sim.robot.warm_up``. Numba keeps the result beside the sources."""

from __future__ import annotations

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Cloud, Walk
from teleop_sim.robot.episode import NoiseKey, perform
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import Plant


def main() -> None:
    """Walk a little with every robot on a bare floor: their arrays lie differently in memory."""
    for make in ROBOTS.values():
        robot = make()
        body = Body(robot, Plant(robot.model, BareFloor()))
        perform(body, Walk(((0.2, 0.0, 0.0),)), body.standing(), NoiseKey(0, 0, 0), until_s=0.1)
        # Something in the way: the footstep planner compiles too.
        post = Cloud(np.array([[0.8, 0.0, z] for z in (0.5, 0.5, 1.5, 1.5)]), (0.0, 0.0, 1.6))
        perform(body, Walk(((1.6, 0.0, 0.0),), (post,)), body.standing(), NoiseKey(0, 0, 0), until_s=0.1)


if __name__ == "__main__":
    main()
