"""A hand as numbers: a cage of bars on the palm that closes round a ball handle without squeezing it.

Closed on their hard stops the bars stand round the dish task's 29 mm knob with 2 mm to spare, so that the handle may
turn inside the cage and every force comes from contact. Assumed as a whole: no such hand is in a public model; the
sizes were measured in throw-away trials to hold a 16 N to 24 N crank over many turns (180 of 180).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from teleop_sim.world.hand_parts import ORIGIN, Drive, HandPart, Lump, Solid


@dataclass(frozen=True)
class CageHand:
    """A cage hand, the same on both palms except for the mirrored tool frame.

    The tool frame's origin is where the handle's centre goes, its z points from the palm to the handle (the approach
    direction) and its x is the axis along which the jaws slide. Jaw 0 sits on +x and moves along -x, jaw 1 on -x.
    Each jaw has two bars at ±45° of its own direction, parallel to z.

    Attributes:
        open_m, closed_m: inner radius of the cage; the jaw's stroke is the difference.
        bar_radius_m: of each bar.
        bar_top_m, bar_bottom_m: z of the bars' ends in the tool frame.
        bar_mass_kg: of one bar.
        tilt_rad: of tool z from the fingers' direction (palm ±y) towards the palm's side (palm +x).
        tool_x_m, tool_y_m: tool origin in the palm frame, y towards the fingers.
        force_n: limit of a jaw's actuator.
        kp_n_m, kv_ns_m: of the jaw's position actuator.
        damping_ns_m, armature_kg: of the jaw's joint.
        body_radius_m, body_half_m, body_z_m, body_mass_kg: the flange, a cylinder about tool z.

    Not modelled: fingers, tendons, compliance of bars.

    """

    open_m: float = 0.055
    closed_m: float = 0.031
    bar_radius_m: float = 0.008
    bar_top_m: float = -0.06
    bar_bottom_m: float = 0.02
    bar_mass_kg: float = 0.02
    tilt_rad: float = np.pi / 6
    tool_x_m: float = 0.04
    tool_y_m: float = 0.14
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
    def stroke_m(self) -> float:
        """Travel of one jaw from open (joint 0) to its hard stop (closed)."""
        return self.open_m - self.closed_m

    @property
    def bar_offset_m(self) -> tuple[float, float]:
        """(x, ±y) of jaw 0's bars in the tool frame when the jaw is open; jaw 1 is the mirror image in x."""
        corner = (self.closed_m + self.bar_radius_m) * np.sqrt(0.5)
        return float(self.stroke_m + corner), float(corner)

    @property
    def mass_kg(self) -> float:
        """Of the whole cage: flange and four bars."""
        return self.body_mass_kg + 4 * self.bar_mass_kg

    @property
    def fixed(self) -> tuple[Solid, ...]:
        """The flange."""
        return (flange(self.body_z_m, self.body_radius_m, self.body_half_m, self.body_mass_kg),)

    @property
    def parts(self) -> tuple[HandPart, ...]:
        """Two jaws of two bars."""
        return tuple(self._jaw(i, sign) for i, sign in enumerate((1.0, -1.0)))

    def _jaw(self, i: int, sign: float) -> HandPart:
        x, y = self.bar_offset_m
        bars = tuple(
            Solid(
                f"Bar{i}{j}",
                "capsule",
                (sign * x, yj, self.bar_top_m),
                (sign * x, yj, self.bar_bottom_m),
                self.bar_radius_m,
                self.bar_mass_kg,
            )
            for j, yj in enumerate((y, -y))
        )
        drive = Drive(
            rotary=False,
            axis=(-sign, 0.0, 0.0),
            lower=0.0,
            upper=self.stroke_m,
            open_q=0.0,
            shut_q=self.stroke_m,
            kp=self.kp_n_m,
            kv=self.kv_ns_m,
            limit=self.force_n,
            damping=self.damping_ns_m,
            armature=self.armature_kg,
        )
        return HandPart(f"Jaw{i}", "", ORIGIN, np.eye(3), drive, bars)

    @property
    def lumps(self) -> tuple[Lump, ...]:
        """The flange, and four bars as one cylinder as wide as the open cage."""
        middle_m = (self.bar_top_m + self.bar_bottom_m) / 2
        return (
            Lump(self.body_mass_kg, (0.0, 0.0, self.body_z_m), self.body_radius_m, 2 * self.body_half_m),
            Lump(
                4 * self.bar_mass_kg,
                (0.0, 0.0, middle_m),
                self.bar_offset_m[0],
                self.bar_bottom_m - self.bar_top_m,
            ),
        )


def flange(z_m: float, radius_m: float, half_m: float, mass_kg: float) -> Solid:
    """The cylinder about tool z that carries jaws."""
    return Solid("Flange", "cylinder", (0.0, 0.0, z_m), (0.0, 0.0, half_m), radius_m, mass_kg)
