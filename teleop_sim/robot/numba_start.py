"""Numba's runtime, without the half of scipy that it would load for nothing."""

from __future__ import annotations

import sys
from typing import Any, cast

import numpy as np

from teleop_sim.robot import law_math

_ASKED_FOR = "scipy.linalg.cython_blas"


def start() -> None:
    """Load what numba needs for its first call: 0.14 s instead of 0.34 s (thread CPU time, measured, numba 0.68).

    Numba asks scipy for BLAS when it starts (``numba/np/arraymath.py``) and does without where there is none: from then
    on only ``np.convolve`` and its like in compiled code are its own loops. Compiled code that needs BLAS asks again
    when it is compiled. Nothing compiled here does: linear algebra is written out (``law_math``).
    """
    if "numba.np.arraymath" in sys.modules or _ASKED_FOR in sys.modules:
        return
    modules = cast(dict[str, Any], sys.modules)
    # What stands as None among the modules cannot be imported (Python documentation, *The import system*).
    modules[_ASKED_FOR] = None
    try:
        law_math.dcm_backwards(np.zeros((1, 2)), 1.0)
    finally:
        del modules[_ASKED_FOR]
