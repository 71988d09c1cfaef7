"""Waits with physics: what freezing leaves out, to measure what it costs. For validation only; runs freeze.

``run_scenario(..., memo=Stepped())`` steps the standing robot and its scene through every wait instead of freezing
them. The run's log does not tell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from teleop_sim.robot.body import Body, RobotState
from teleop_sim.robot.memo import Fresh
from teleop_sim.robot.skill import Tick


@dataclass(frozen=True)
class _Wait:
    """How far a wait has been stepped: so many ticks from ``start`` to ``now``. ``stand``: the law's reference."""

    start: RobotState
    ticks: int
    now: RobotState
    stand: np.ndarray


class Stepped(Fresh):
    """Computes everything anew, and waits too.

    Attributes:
        waited_s: simulated time of waits stepped so far.
    """

    def __init__(self) -> None:
        self.waited_s = 0.0
        self._wait: _Wait | None = None

    def stood(self, body: Body, state: RobotState, seconds: float, /) -> RobotState:
        """The robot after standing for so long, in whole control ticks: a function of its arguments."""
        ticks = int(seconds / body.tick_s + 1e-9)
        if state.fallen or ticks == 0:
            return state
        wait = self._wait
        if wait is None or wait.start is not state or wait.ticks > ticks:
            body.load(state)
            wait = _Wait(state, 0, state, body.stand)
        body.load(wait.now)
        # Where it was to stand when the wait began, not where it has come to stand by now.
        body.stand = wait.stand
        for _ in range(ticks - wait.ticks):
            if not body.tick(Tick(body.posture, jaws=body.jaws)):
                break
        self.waited_s += (ticks - wait.ticks) * body.tick_s
        self._wait = _Wait(state, ticks, body.save(), wait.stand)
        return self._wait.now
