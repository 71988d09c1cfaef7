"""Why a robot fell: what physics showed in the moments before, in words and in order. It decides nothing."""

from __future__ import annotations

import math

from teleop_sim.robot import law
from teleop_sim.robot.body import Body
from teleop_sim.robot.skill import Tick

SLIP_M = 0.03
"""A standing foot that has moved further has slid (assumed; walks on dry floor stay under 1 cm)."""

DCM_M = 0.06
"""A DCM so far from its reference is past what the soles can correct (assumed; cranking reaches 22 mm)."""

LOAD_N = 120.0
"""A hand's bars so loaded pull at the body (assumed; a handle takes 15 to 25 N)."""

PUSH_NOT_BY = ("sole", "Bar", "Flange")
"""Parts of geom names that are meant to touch."""

LOOK_EVERY_TICKS = 5


class FallWatch:
    """Watches feet, balance, hands and contacts during an episode; remembers what went wrong first."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self._stood = list(body.sole_places())
        self._slip_m = 0.0
        self._seen: dict[str, float] = {}
        self._before = law.BOTH
        self._ticks = 0

    def look(self, reference: Tick) -> None:
        """Ten times a second. What is seen first comes first in the cause."""
        self._ticks += 1
        if self._ticks % LOOK_EVERY_TICKS:
            return
        self._look_at_feet(reference)
        if self._slip_m > SLIP_M:
            self._note("a standing foot slid")
        if self._body.balance_error_m() > DCM_M:
            self._note("balance went past what the soles can correct")
        for side in self._body.hands:
            if self._body.hand_force(side) > LOAD_N:
                self._note(f"the {side} hand's bars were loaded with more than {LOAD_N:.0f} N")
        if self._ticks % (5 * LOOK_EVERY_TICKS) == 0 or self._seen:
            for own, other in self._body.plant.contacts():
                if not any(part in own for part in PUSH_NOT_BY):
                    self._note(f"{own} touched {other}")

    def _look_at_feet(self, reference: Tick) -> None:
        row = self._body.stand if reference.row is None else reference.row
        stance, before, stood = float(row[law.STANCE]), self._before, self._stood
        for i, here in enumerate(self._body.sole_places()):
            # Standing now and at the last look: a foot that landed in between has not slid.
            if stance in (law.BOTH, i) and before in (law.BOTH, i):
                self._slip_m = max(self._slip_m, math.dist(here, stood[i]))
            else:
                stood[i] = here
        self._before = stance

    def _note(self, what: str) -> None:
        self._seen.setdefault(what, self._ticks * self._body.tick_s)

    def cause(self) -> str:
        """In words: what went wrong, in order, with seconds from the start of the episode."""
        if not self._seen:
            return "fell: tipped over within a tenth of a second"
        if "a standing foot slid" in self._seen:
            at_s = self._seen["a standing foot slid"]
            told = {f"a standing foot slid ({100 * self._slip_m:.0f} cm in all)": at_s}
            told |= {what: t for what, t in self._seen.items() if what != "a standing foot slid"}
        else:
            told = dict(self._seen)
        order = sorted(told.items(), key=lambda item: item[1])[:6]
        return "fell: " + ", then ".join(f"{what} at {at_s:.1f} s" for what, at_s in order)
