"""What a skill is: a generator of control references, one a control tick, that ends in an outcome."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from teleop_sim.robot.body import Body


class Tick(NamedTuple):
    """One control period's reference. A tuple: made in every tick, in half the time of a frozen dataclass.

    Attributes:
        posture: (n_upper,) reference angles of the upper body [rad], in the order of ``body.upper_names``.
        rate: (n_upper,) reference rates [rad/s]; None is zero.
        torque: (n_upper,) torques to add [N m]; None is zero.
        jaws: left, right: 0 open to 1 closed.
        row: of a walking plan; None stands on the feet as they are.
    """

    posture: np.ndarray
    rate: np.ndarray | None = None
    torque: np.ndarray | None = None
    jaws: tuple[float, float] = (0.0, 0.0)
    row: np.ndarray | None = None


@dataclass(frozen=True)
class Done:
    """How a skill ended.

    Attributes:
        takes_s: time that it needs at rest, such as a sensor's sweep.
        torque: (n_upper,) torques that hold what the hand presses on, kept while the robot comes to rest [N m].

    """

    outcome: str
    cause: str = ""
    data: Any = None
    takes_s: float = 0.0
    torque: np.ndarray | None = None


Motion = Generator[Tick, None, Done]
Skill = Callable[["Body", Any, np.random.Generator], Motion]
