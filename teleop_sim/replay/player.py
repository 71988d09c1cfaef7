"""Playing a run in a window: what keys do, and where the run is shown."""

from __future__ import annotations

from dataclasses import dataclass, replace

SPACE, RIGHT, LEFT, HOME, END = 32, 262, 263, 268, 269
FASTER, SLOWER = frozenset({61, 334}), frozenset({45, 333})
"""Codes of keys: GLFW 3's, https://www.glfw.org/docs/latest/group__keys.html (= and -, on keyboard and keypad)."""

SEEK_S = 5.0
"""An arrow goes so far, times the speed."""
SLOWEST, FASTEST = 1 / 16, 64.0
KEYS = "space: pause   left, right: 5 s back, ahead   + -: speed   Home, End"


@dataclass(frozen=True)
class Player:
    """Where a run is shown.

    Attributes:
        from_s, to_s: what is played [s of simulated time].
        t_s: what is shown now.
        speed: simulated seconds a second.
        paused: whether it stands.

    """

    from_s: float
    to_s: float
    t_s: float
    speed: float = 1.0
    paused: bool = False

    def pressed(self, key: int) -> Player:
        """After a key; others do nothing."""
        if key == SPACE:
            # At the end there is nothing to go on with: begin again.
            over = self.t_s >= self.to_s
            return replace(self, paused=not self.paused and not over, t_s=self.from_s if over else self.t_s)
        if key in (LEFT, RIGHT):
            return self.at(self.t_s + (SEEK_S if key == RIGHT else -SEEK_S) * max(1.0, self.speed))
        if key in (HOME, END):
            return self.at(self.from_s if key == HOME else self.to_s)
        if key in FASTER or key in SLOWER:
            factor = 2.0 if key in FASTER else 0.5
            return replace(self, speed=min(max(self.speed * factor, SLOWEST), FASTEST))
        return self

    def after(self, seconds: float) -> Player:
        """After so much time of whoever looks on."""
        return self if self.paused else self.at(self.t_s + self.speed * seconds)

    def at(self, t_s: float) -> Player:
        """At another time, or as near to it as there is."""
        return replace(self, t_s=min(max(t_s, self.from_s), self.to_s))
