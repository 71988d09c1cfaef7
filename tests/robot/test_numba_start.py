"""Starting numba must leave the interpreter as it would be, but for what was not loaded."""

from __future__ import annotations

import subprocess
import sys

CODE = """
import sys
import numpy as np
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.body import Body
from teleop_sim.robot.skill import Tick
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import Plant

spec = ROBOTS["valkyrie"]()
body = Body(spec, Plant(spec.model, BareFloor()))
body.load(body.standing())
assert body.tick(Tick(body.posture, jaws=body.jaws))
print("scipy.linalg" in sys.modules)

from numba import njit
import scipy.linalg.cython_blas

print(njit(lambda a: np.dot(a, a))(np.eye(2)).tolist())
"""


def test_a_control_tick_loads_no_scipy_and_hides_none() -> None:
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=False)
    # What numba compiles later finds scipy's BLAS as ever.
    assert done.stdout.splitlines() == ["False", "[[1.0, 0.0], [0.0, 1.0]]"], done.stderr
