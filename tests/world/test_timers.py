"""Nobody reads MuJoCo's stopwatches, so they must not run."""

from __future__ import annotations

import mujoco

from teleop_sim.robot.robots import ROBOTS
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import Plant


def test_mujoco_reads_no_clock_while_it_steps() -> None:
    plant = Plant(ROBOTS["valkyrie"]().model, BareFloor())
    plant.begin_tick()
    plant.end_tick()
    timer = plant.data.timer[mujoco.mjtTimer.mjTIMER_STEP]
    # Steps are counted all the same; without a clock they take no time.
    assert timer.number > 0
    assert timer.duration == 0.0
