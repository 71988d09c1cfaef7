"""The tables of the tasks at door and valve: what is drawn from the seed there, and between which limits.

One number fixes a value, as equal limits do. Meanings and sources of the defaults: ``teleop_sim.world.drc_draw``.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from teleop_sim.scenarios.parts import ASSUMED, Part, source_of
from teleop_sim.scenarios.ranges import RANGE

Positive = Annotated[float, Field(gt=0.0)]
PositiveRange = Annotated[tuple[Positive, Positive], *RANGE]
Ahead = Annotated[float, Field(ge=0.0, le=8.0)]
AheadRange = Annotated[tuple[Ahead, Ahead], *RANGE]
Lean = Annotated[float, Field(ge=0.0, le=0.2)]
LeanRange = Annotated[tuple[Lean, Lean], *RANGE]
Count = Annotated[int, Field(ge=0, le=20)]
CountRange = Annotated[tuple[Count, Count], *RANGE]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Thing(Part):
    """What door and valve have in common: where the robot starts, and what its world model wrongly holds."""

    ahead_m: AheadRange = Field(
        default=(0.0, 0.0),
        description="[least, most] metres that the robot starts before the place it works from; 0: already in reach.",
    )
    ahead_source: str = ASSUMED
    place_jitter_m: float = Field(
        default=0.02,
        ge=0.0,
        le=0.5,
        description="How far off the robot starts, in x and in y, 0 to 0.5 m.",
    )
    place_jitter_rad: float = Field(default=0.05, ge=0.0, le=0.5, description="And how far turned, 0 to 0.5 rad.")
    place_jitter_source: str = ASSUMED
    surface_friction: PositiveRange = Field(
        default=(0.4, 1.0), description="[lowest, highest] friction coefficient of what is touched, such as [0.4, 1.0]."
    )
    surface_friction_source: str = ASSUMED
    ghosts: CountRange | None = Field(
        default=None,
        description="[fewest, most] spurious obstacles in the world model near the thing, 0 to 20, until it is reset.",
    )
    ghosts_source: str | None = Field(default_factory=source_of("ghosts"))


class Door(Thing):
    """The door (``teleop_sim.world.door``)."""

    mass_kg: PositiveRange = Field(default=(20.0, 25.0), description="[lowest, highest] mass of the panel in kg.")
    mass_source: str = ASSUMED
    hinge_nm: PositiveRange = Field(default=(1.0, 3.0), description="[lowest, highest] friction of the hinges in Nm.")
    hinge_source: str = ASSUMED
    spring_nm: PositiveRange = Field(
        default=(1.0, 3.0), description="[lowest, highest] torque of the lever's spring where the bolt is free, in Nm."
    )
    spring_source: str = ASSUMED
    closer_rad: LeanRange = Field(
        default=(0.0, 0.0),
        description="[least, most] lean of the hinges, a gravity closer, 0 to 0.2 rad.",
    )
    closer_source: str = ASSUMED


class Valve(Thing):
    """The valve (``teleop_sim.world.valve``)."""

    friction_nm: PositiveRange = Field(
        default=(2.0, 4.0), description="[lowest, highest] friction torque of the wheel in Nm, such as [2.0, 4.0]."
    )
    friction_source: str = "DARPA Robotics Challenge, task Valve: moves at 22 N at its edge, 4 Nm at 0.18 m, at most"


class Onboard(Part):
    """Between the field computer, where a behaviour runs, and the robot's own computers, which plan its motions.

    A person's orders go to the robot's computers by another way: they are not lost here.
    """

    request_loss: Share = Field(
        default=0.0, description="Chance that a request of the behaviour to plan a motion is not answered, 0 to 1."
    )
    request_loss_source: str = ASSUMED
