"""A hand as numbers: two flat pads that squeeze what is between them and hold it by friction alone.

Assumed as a whole, as the cage is: the sizes of a throw-away trial that gripped a 29 mm knob (58 mm across) with 60 N.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from teleop_sim.world import contact
from teleop_sim.world.cage import flange
from teleop_sim.world.hand_parts import ORIGIN, Drive, HandPart, Lump, Solid


@dataclass(frozen=True)
class PadHand:
    """A parallel gripper: pads slide along the tool's x and meet the handle from both sides.

    Attributes:
        open_m, closed_m: from the tool's axis to a pad's face; closed is a stop well inside a knob.
        pad_half_m: half sizes of a pad: along the slide, across it, along tool z.
        pad_mass_kg, force_n, kp_n_m, kv_ns_m, damping_ns_m, armature_kg: of one pad, as a cage's jaw.
        friction: sliding, of the pads' surface; the larger of it and the handle's counts.
        body_radius_m, body_half_m, body_z_m, body_mass_kg: the flange.

    Not modelled: soft pads, which would hold a turning knob by a patch instead of a point.

    """

    open_m: float = 0.055
    closed_m: float = 0.020
    pad_half_m: tuple[float, float, float] = (0.008, 0.025, 0.03)
    pad_mass_kg: float = 0.04
    friction: float = contact.OWN_FRICTION
    force_n: float = 60.0
    kp_n_m: float = 3000.0
    kv_ns_m: float = 60.0
    damping_ns_m: float = 10.0
    armature_kg: float = 0.3
    body_radius_m: float = 0.05
    body_half_m: float = 0.012
    body_z_m: float = -0.075
    body_mass_kg: float = 0.2

    @property
    def mass_kg(self) -> float:
        """Of flange and pads."""
        return self.body_mass_kg + 2 * self.pad_mass_kg

    @property
    def fixed(self) -> tuple[Solid, ...]:
        """The flange."""
        return (flange(self.body_z_m, self.body_radius_m, self.body_half_m, self.body_mass_kg),)

    @property
    def parts(self) -> tuple[HandPart, ...]:
        """Two pads."""
        return tuple(self._pad(i, sign) for i, sign in enumerate((1.0, -1.0)))

    def _pad(self, i: int, sign: float) -> HandPart:
        at = (sign * (self.open_m + self.pad_half_m[0]), 0.0, 0.0)
        pad = Solid(f"Bar{i}", "box", at, self.pad_half_m, mass_kg=self.pad_mass_kg, friction=self.friction)
        stroke_m = self.open_m - self.closed_m
        drive = Drive(
            rotary=False,
            axis=(-sign, 0.0, 0.0),
            lower=0.0,
            upper=stroke_m,
            open_q=0.0,
            shut_q=stroke_m,
            kp=self.kp_n_m,
            kv=self.kv_ns_m,
            limit=self.force_n,
            damping=self.damping_ns_m,
            armature=self.armature_kg,
        )
        return HandPart(f"Jaw{i}", "", ORIGIN, np.eye(3), drive, (pad,))

    @property
    def lumps(self) -> tuple[Lump, ...]:
        """The flange, and the open pads as one cylinder about the tool's axis."""
        width_m = self.open_m + self.pad_half_m[0]
        return (
            Lump(self.body_mass_kg, (0.0, 0.0, self.body_z_m), self.body_radius_m, 2 * self.body_half_m),
            Lump(2 * self.pad_mass_kg, ORIGIN, width_m, 2 * self.pad_half_m[2]),
        )
