"""What a task's scorer is: a value that takes samples of the plant in the order of time."""

from __future__ import annotations

from typing import Protocol

import numpy as np


class Score(Protocol):
    """How a task stands, and what comes next."""

    @property
    def checkpoint(self) -> int:
        """The last checkpoint scored."""

    def at(self, t_s: float, pelvis: np.ndarray, joints: np.ndarray) -> tuple[Score, tuple[tuple[int, str], ...]]:
        """The score after a sample (pelvis (7,), joints in model order), and what it saw: (checkpoint, words)."""

    def quiet(self, t_s: np.ndarray, pelvis: np.ndarray, joints: np.ndarray) -> int:
        """How many of these samples (n,), (n, 7), (n, k), from the first on, ``at`` can be spared.

        Each of them would leave the score equal and see nothing. It may be too few, never too many; 0 spares none.
        """

    def next_s(self, t_s: float) -> float:
        """When a frozen robot must be sampled next; ``inf``: never."""

    def status(self, t_s: float, joints: np.ndarray) -> dict[str, float]:
        """The status message that the task sends the robot; empty when there is none."""
