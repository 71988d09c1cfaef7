"""What a scenario is: a frozen tree of checked values.

Every quantity that a result may rest on has a ``*_source`` beside it: where the number is from. Left out, it says
``assumed``. Times are simulated seconds, rates bits per second.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, PlainValidator, WithJsonSchema

from teleop_sim.operators.registry import POLICIES
from teleop_sim.scenarios import names
from teleop_sim.scenarios.disturbance_schema import Disturbances
from teleop_sim.scenarios.drc_schema import Door, Onboard, Valve
from teleop_sim.scenarios.link_schema import Link
from teleop_sim.scenarios.parts import ASSUMED, Part, named, refused, source_of
from teleop_sim.scenarios.ranges import RANGE


def _layout(value: object) -> str | int:
    if isinstance(value, str) and value == "random":
        return value
    if isinstance(value, int) and not isinstance(value, bool) and value in names.WORLDS:
        return value
    raise refused(f"{value!r} is no layout of the world", 'Give "random", or 1 to 5 for one of the five final worlds.')


Positive = Annotated[float, Field(gt=0.0)]
PitchAngle = Annotated[float, Field(ge=-0.2, le=1.57)]
YawAngle = Annotated[float, Field(ge=-math.pi, le=math.pi)]
Count = Annotated[int, Field(ge=0, le=30)]
PositiveRange = Annotated[tuple[Positive, Positive], *RANGE]
PitchRange = Annotated[tuple[PitchAngle, PitchAngle], *RANGE]
YawRange = Annotated[tuple[YawAngle, YawAngle], *RANGE]
CountRange = Annotated[tuple[Count, Count], *RANGE]


class Operator(Part):
    """Who is at the control station, and how they work.

    What is left out is not there: one person alone, who makes no mistakes and whom load does not slow.
    """

    policy: Annotated[str, *named("How the operator decides, one of", POLICIES)] = "supervise"
    expertise: float = Field(
        default=1.0,
        ge=0.1,
        le=10.0,
        description="A factor from 0.1 to 10 on all the operator's times, such as 0.7; 1 is the average person.",
    )
    expertise_source: str = ASSUMED
    team: int | None = Field(
        default=None, ge=1, le=4, description="How many people share the roles, 1 to 4; left out: one."
    )
    level_there: Annotated[str | None, *named("Level that policy collaborate sets at the thing", names.AUTONOMY)] = None
    slip_rate: float | None = Field(
        default=None,
        ge=0.0,
        le=1.0,
        description="Chance that what is sent was not meant, such as 0.02 (HEART).",
    )
    slip_rate_source: str | None = Field(default_factory=source_of("slip_rate"))
    misjudge_rate: float | None = Field(
        default=None, ge=0.0, le=1.0, description="Chance that a decision is wrong, 0 to 1, such as 0.16 (HEART)."
    )
    misjudge_rate_source: str | None = Field(default_factory=source_of("misjudge_rate"))
    workload: bool | None = Field(default=None, description="true: who is busy beyond 70 % gets slower and errs more.")
    criterion: float | None = Field(
        default=None,
        ge=-10.0,
        le=50.0,
        description="Of policy verify: evidence, in standard deviations, above which a claim is rejected, such as 3.5.",
    )
    criterion_source: str | None = Field(default_factory=source_of("criterion"))


class World(Part):
    """The dish's world: what is drawn from the seed, uniformly, and between which limits.

    One number fixes a value, as equal limits do. The defaults are those of the simulated world, which has their sources
    (``teleop_sim.world.dish_draw.DishSettings``).
    """

    layout: Annotated[str | int, PlainValidator(_layout), WithJsonSchema({"enum": ["random", *names.WORLDS]})] = Field(
        default="random", description='"random" (drawn from the seed) or 1 to 5.'
    )
    wheel_friction_nm: PositiveRange = Field(
        default=(2.0, 3.0), description="[lowest, highest] friction torque of a wheel in Nm, such as [2.0, 3.0]."
    )
    wheel_friction_source: str = ASSUMED
    yaw_target_rad: YawRange = Field(
        default=(-1.65, 2.20), description="[lowest, highest] yaw wanted of the dish in rad, within -pi to pi."
    )
    yaw_target_source: str = ASSUMED
    pitch_target_rad: PitchRange = Field(
        default=(-0.2, 1.25), description="[lowest, highest] pitch wanted of the dish in rad, within -0.2 to 1.57."
    )
    pitch_target_source: str = ASSUMED
    floor_friction: PositiveRange = Field(
        default=(0.4, 1.0), description="[lowest, highest] friction coefficient of the floor, such as [0.4, 1.0]."
    )
    floor_friction_source: str = ASSUMED
    contact_friction: PositiveRange = Field(
        default=(0.6, 1.0), description="[lowest, highest] friction coefficient of the console, such as [0.6, 1.0]."
    )
    contact_friction_source: str = ASSUMED
    wheel_start_spread_rad: float = Field(
        default=0.5, ge=0.0, le=math.pi, description="How far a wheel may start from its published place, 0 to pi rad."
    )
    wheel_start_spread_source: str = ASSUMED
    console_jitter_m: float = Field(
        default=0.03, ge=0.0, le=0.5, description="How far the console may be shifted in x and in y, 0 to 0.5 m."
    )
    console_jitter_rad: float = Field(
        default=math.radians(2.0), ge=0.0, le=0.5, description="How far the console may be turned, 0 to 0.5 rad."
    )
    console_jitter_source: str = ASSUMED
    clutter: CountRange = Field(default=(2, 6), description="[fewest, most] extra boxes on the ground, 0 to 30.")
    clutter_source: str = ASSUMED
    drums: CountRange | None = Field(
        default=None, description="[fewest, most] pairs of a red and a blue drum, 0 to 30, that look like the console."
    )
    drums_source: str | None = Field(default_factory=source_of("drums"))


class Scenario(Part):
    """Everything that is chosen before a run, apart from the replicate's number.

    ``name`` is the file's name without ``.toml`` unless the file gives another; it names the log. ``seed`` fixes all
    chance; ``autonomy`` is the level of the machine's guard at the start. ``hand`` left out is the robot's default,
    ``layer`` the behaviour. Each task has the table of its own world: ``world`` for the dish, ``door``, ``valve``.
    """

    schema_version: Literal[1] = Field(alias="schema", description="schema = 1, the one this version reads.")
    name: str = Field(
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$",
        description="Letters, digits, '-', '_' and '.', at most 64: it becomes part of the log's file name.",
    )
    question: str = Field(default="", description="Text: what the scenario is to find out.")
    seed: int = Field(default=1, ge=0, lt=2**63, description="A whole number from 0 to 9223372036854775807.")
    robot: Annotated[str, *named("A robot, one of", names.ROBOTS)] = "valkyrie"
    hand: Annotated[str | None, *named("Its hands, one of", names.HANDS)] = None
    task: Annotated[str, *named("A task, one of", names.TASKS)] = "src-dish"
    layer: Annotated[str | None, *named("The layer of control, one of", names.LAYERS)] = None
    pacing: Annotated[str, *named("Which waits the robot's program has, one of", names.PACINGS)] = "wpi"
    time_limit_s: float = Field(
        default=1800.0, gt=0.0, le=1e6, description="A time limit above zero and up to 1e6 simulated seconds."
    )
    time_limit_source: str = ASSUMED
    autonomy: Annotated[str, *named("A level of autonomy, one of", names.AUTONOMY)] = "full"
    operator: Operator = Operator()
    world: World | None = Field(
        default_factory=lambda earlier: World() if earlier.get("task") == "src-dish" else None,
        description="Of task src-dish: where the robot works.",
    )
    door: Door | None = Field(
        default_factory=lambda earlier: Door() if earlier.get("task") == "drc-door" else None,
        description="Of task drc-door: the door, and where the robot starts.",
    )
    valve: Valve | None = Field(
        default_factory=lambda earlier: Valve() if earlier.get("task") == "drc-valve" else None,
        description="Of task drc-valve: the valve, and where the robot starts.",
    )
    onboard: Onboard | None = Field(
        default=None, description="Of drc tasks: trouble between the behaviour and the robot's own computers."
    )
    disturbances: Disturbances = Disturbances()
    link: Link = Field(description="Tables [link.up] and [link.down], or a preset.")
