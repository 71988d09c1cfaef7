"""Why a robot fell: what physics showed in the moments before, in words. It decides nothing."""

from __future__ import annotations

from collections import deque

import numpy as np

from teleop_sim.robot import law
from teleop_sim.robot.body import Body
from teleop_sim.robot.skill import Tick

SLIP_M = 0.05
"""A standing foot that has moved further has slid (assumed; walks on dry floor stay under 1 cm)."""

PUSH_NOT_BY = ("sole", "Bar", "Flange")
"""Parts of geom names that are meant to touch."""


class FallWatch:
    """Watches feet and contacts during an episode."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self._stood = [np.array(foot[:2]) for foot in body.feet()]
        self._slip_m = 0.0
        self._hits: deque[tuple[str, str]] = deque(maxlen=8)
        self._before = law.BOTH
        self._ticks = 0

    def look(self, reference: Tick) -> None:
        """Ten times a second: how far a standing foot has moved; twice a second: what touches what."""
        self._ticks += 1
        if self._ticks % 5:
            return
        row = self._body.stand if reference.row is None else reference.row
        stance = row[law.STANCE]
        for i, foot in enumerate(self._body.feet()):
            here = np.array(foot[:2])
            # Standing now and at the last look: a foot that landed in between has not slid.
            if stance in (law.BOTH, float(i)) and self._before in (law.BOTH, float(i)):
                self._slip_m = max(self._slip_m, float(np.hypot(*(here - self._stood[i]))))
            else:
                self._stood[i] = here
        self._before = stance
        if self._ticks % 25 == 0:
            for own, other in self._body.plant.contacts():
                if not any(part in own for part in PUSH_NOT_BY) and (own, other) not in self._hits:
                    self._hits.append((own, other))

    def cause(self) -> str:
        """In words: the last moments before the fall."""
        found = []
        if self._slip_m > SLIP_M:
            found.append(f"a standing foot slid {100 * self._slip_m:.0f} cm")
        if self._hits:
            found.append("touched " + ", ".join(f"{own} on {other}" for own, other in self._hits))
        return "fell: " + ("; ".join(found) if found else "lost balance with both soles holding")
