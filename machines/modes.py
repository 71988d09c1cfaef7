"""The mode of a running machine: the worst of its states'; told when it changes."""

from __future__ import annotations

from collections.abc import Mapping

import simpy

from teleop_sim.core.records import Emit, ModeChanged
from teleop_sim.machines.engine import MODES
from teleop_sim.machines.visits import Visit
from teleop_sim.machines.voice import Voice


class Modes:
    """Tells the mode.

    Attributes:
        mode: ``normal``, ``auto``, ``manual`` or ``not_recoverable``.

    """

    def __init__(self, env: simpy.Environment, visits: Mapping[str, Visit], voice: Voice, emit: Emit) -> None:
        """``visits`` are those of the running machine, by path; it adds and removes them."""
        self._env, self._visits, self._voice, self._emit = env, visits, voice, emit
        self.mode = "normal"

    def show(self) -> None:
        """The states at work, or their modes, have changed; without any the mode stays."""
        worst = max(self._visits.values(), key=lambda v: MODES.index(v.mode), default=None)
        if worst is not None:
            self.set(worst.mode, worst.path)

    def by_hand(self, visit: Visit) -> None:
        """A person acts, or decides, instead of the state."""
        visit.mode = "manual"
        self.show()

    def set(self, mode: str, path: str) -> None:
        """Tell a mode, if it is another one, and the state that brought it about."""
        if mode != self.mode:
            self.mode = mode
            self._emit(ModeChanged(float(self._env.now), path, mode))
            self._voice.mode(mode)
