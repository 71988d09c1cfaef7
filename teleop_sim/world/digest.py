"""What a plant is, as a digest: two plants of one digest move alike from one state."""

from __future__ import annotations

import mujoco
import numpy as np

from teleop_sim.core.fingerprint import fingerprint
from teleop_sim.world.plant import Plant


def plant_digest(plant: Plant) -> bytes:
    """Digest (32 bytes) of a plant as it is now: the compiled model, what its scenery does, disturbances, step.

    Raises:
        TypeError: the scenery holds something that is no value (``core.fingerprint``).

    Source: ``mj_saveModel`` writes all of a model (MuJoCo documentation, *APIreference*): options, bodies, geoms,
    actuators and their names.
    """
    model = np.zeros(mujoco.mj_sizeModel(plant.model), np.uint8)
    mujoco.mj_saveModel(plant.model, None, model)
    return fingerprint(model, plant.scenery, plant.disturbances, plant.steps_per_tick)
