"""The tables of a scenario that say what its link can do. Rules and models: docs/link.md.

A quantity that is left out is the preset's, or as if it did not exist. Where the link has no preset, each direction
must have a rate and a delay.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, ConfigDict, Field, Strict, ValidationInfo, WrapValidator
from pydantic.config import JsonDict
from pydantic.functional_validators import ModelWrapValidatorHandler
from pydantic_core import PydanticKnownError

from teleop_sim.channel.dark import DARK_MODELS, DarkModel
from teleop_sim.channel.delivery import DELIVERIES, Delivery
from teleop_sim.channel.jitter import JITTERS, Jitter
from teleop_sim.channel.loss import LOSS_MODELS, Loss
from teleop_sim.channel.messages import MESSAGES
from teleop_sim.channel.presets import PRESETS
from teleop_sim.channel.queueing import DISCIPLINES
from teleop_sim.scenarios.parts import ASSUMED, Part, named, refused, source_of, unknown
from teleop_sim.scenarios.registered import registered

MODELS: Mapping[str, Mapping[str, type[Any]]] = {
    "loss": LOSS_MODELS,
    "jitter": JITTERS,
    "dark": DARK_MODELS,
    "delivery": DELIVERIES,
}
"""Keys of a link whose value is a model, and the models by name."""

TOPICS = (*MESSAGES, "ack")
"""What urgency can be given to: messages and acknowledgements."""


def _window(value: tuple[float, float]) -> tuple[float, float]:
    start_s, end_s = value
    if not (math.isfinite(start_s) and start_s >= 0.0):
        raise refused(f"a blackout cannot start at {start_s} s", "Start at zero or later, in simulated seconds.")
    if not end_s > start_s:
        raise refused(
            f"a blackout from {start_s} s to {end_s} s ends no later than it starts",
            "Give [start_s, end_s] with the end after the start; inf means for ever.",
        )
    return value


def _in_order(value: tuple[tuple[float, float], ...] | None) -> tuple[tuple[float, float], ...] | None:
    wrong = [
        f"[{b[0]}, {b[1]}] starts before [{a[0]}, {a[1]}] has ended" for a, b in pairwise(value or ()) if b[0] < a[1]
    ]
    if wrong:
        raise refused("; ".join(wrong), "List blackouts in order of time and without overlap; join those that touch.")
    return value


def _topics(value: dict[str, int] | None) -> dict[str, int] | None:
    for topic in value or ():
        if topic not in TOPICS:
            raise unknown(topic, TOPICS)
    return value or None


Bound = Annotated[float, Field(allow_inf_nan=True)]
Window = Annotated[tuple[Bound, Bound], Strict(False), AfterValidator(_window)]
Windows = tuple[Window, ...]
Pair = Annotated[tuple[float, float], Strict(False)]
Pairs = Annotated[tuple[Pair, ...] | None, Strict(False)]

_RATE = "A rate above zero in bits per second, such as 380.0."
_DELAY = "A one-way delay of zero or more seconds, such as 10.0."
_HEADER = "Whole bytes added to each message for its headers, such as 40."
_BLACKOUTS = "A list of [start_s, end_s] in simulated seconds, such as [[60.0, 120.0]]."


class Spell(Part):
    """A stretch of an alternating link."""

    for_s: float = Field(gt=0.0, description="How long it lasts: above zero seconds, such as 60.0.")
    rate_bps: float = Field(gt=0.0, description=_RATE)
    delay_s: float = Field(ge=0.0, description=_DELAY)


class StateRate(Part):
    """The rate while the robot's machine is in a state."""

    state: str = Field(description='A state of the task\'s machine, such as "STATE_DETECT_PANEL".')
    rate_bps: float = Field(gt=0.0, description=_RATE)
    rate_source: str = ASSUMED


class LinkDirection(Part):
    """One direction of a link: what it changes of the link's preset. Left out: as the preset, or not there at all."""

    rate_bps: float | None = Field(default=None, gt=0.0, description=_RATE)
    rate_source: str | None = Field(default_factory=source_of("rate_bps"))
    delay_s: float | None = Field(default=None, ge=0.0, description=_DELAY)
    delay_source: str | None = Field(default_factory=source_of("delay_s"))
    header_bytes: int | None = Field(default=None, ge=0, le=1500, description=_HEADER)
    header_source: str | None = Field(default_factory=source_of("header_bytes"))
    blackouts: Annotated[Windows | None, Strict(False), AfterValidator(_in_order)] = Field(
        default=None, description=_BLACKOUTS
    )
    blackouts_source: str | None = Field(default_factory=source_of("blackouts"))
    way: Literal["up", "down", "burst"] | None = Field(
        default=None, description='Which way of the preset this is: "up", "down", or "burst" where there is one.'
    )
    dark: Annotated[DarkModel | None, *registered(MODELS["dark"])] = Field(
        default=None,
        description='Blackouts by a model, such as { model = "random_gaps", mean_light_s = 50, mean_dark_s = 5 }.',
    )
    dark_source: str | None = Field(default_factory=source_of("dark"))
    on_dark: Literal["pause", "restart", "lose"] | None = Field(
        default=None, description='A fragment being sent when it gets dark: "pause", "restart" or "lose".'
    )
    on_dark_flight: Literal["arrive", "lose"] | None = Field(
        default=None, description='Bits in the air when it gets dark: "arrive" or "lose".'
    )
    on_dark_source: str | None = Field(default_factory=source_of("on_dark"))
    rates: Pairs = Field(
        default=None, description="Rates that change: [[from_s, rate_bps], ...], such as [[0.0, 64.0], [60.0, 4e3]]."
    )
    rates_source: str | None = Field(default_factory=source_of("rates"))
    delays: Pairs = Field(
        default=None, description="Delays that change: [[from_s, delay_s], ...], such as [[0.0, 10.0], [60.0, 1.0]]."
    )
    delays_source: str | None = Field(default_factory=source_of("delays"))
    alternating: Annotated[tuple[Spell, ...] | None, Strict(False)] = Field(
        default=None,
        description="Rate and delay in turn, again and again: [{ for_s = 60.0, rate_bps = 1e6, delay_s = 0.05 }, ...].",
    )
    alternating_source: str | None = Field(default_factory=source_of("alternating"))
    by_state: Annotated[tuple[StateRate, ...] | None, Strict(False)] = Field(
        default=None,
        description="Rates that hold while the robot's machine is in a state: tables with state and rate_bps.",
    )
    loss: Annotated[Loss | None, *registered(MODELS["loss"])] = Field(
        default=None, description='How fragments are lost, such as { model = "bernoulli", p = 0.1 }.'
    )
    loss_source: str | None = Field(default_factory=source_of("loss"))
    jitter: Annotated[Jitter | None, *registered(MODELS["jitter"])] = Field(
        default=None, description='What delays vary by, such as { model = "uniform", low_s = 0.0, high_s = 0.1 }.'
    )
    jitter_source: str | None = Field(default_factory=source_of("jitter"))
    reorder: bool | None = Field(default=None, description="true or false: may a packet with less jitter overtake?")
    queue_limit: int | None = Field(default=None, ge=0, description="Packets that may wait; 0 for no limit.")
    queue_source: str | None = Field(default_factory=source_of("queue_limit"))
    discipline: Annotated[str | None, *named("Who goes next, one of", DISCIPLINES)] = None
    drop: Literal["tail", "head"] | None = Field(
        default=None, description='Who goes when there is no room: "tail" (the newest) or "head" (the oldest).'
    )
    priorities: Annotated[dict[str, int] | None, AfterValidator(_topics)] = Field(
        default=None, description="Urgency by topic, greater goes first, such as { request = 2, mirror = 1 }."
    )
    budget_bits: int | None = Field(
        default=None, ge=1, description="Bits of all packets together, with headers, such as 115200."
    )
    budget_source: str | None = Field(default_factory=source_of("budget_bits"))
    mtu_bytes: int | None = Field(
        default=None, ge=0, description="Largest fragment with its header in bytes, such as 1500; 0 for no limit."
    )
    mtu_source: str | None = Field(default_factory=source_of("mtu_bytes"))
    delivery: Annotated[Delivery | None, *registered(MODELS["delivery"])] = Field(
        default=None, description="How messages of this way get across, in place of the link's delivery."
    )
    delivery_source: str | None = Field(default_factory=source_of("delivery"))


class WholeDirection(LinkDirection):
    """One direction of a link without a preset: a rate, a delay, and what else it says; the rest is not there."""

    rate_bps: float = Field(gt=0.0, description=_RATE)
    rate_source: str = ASSUMED
    delay_s: float = Field(ge=0.0, description=_DELAY)
    delay_source: str = ASSUMED
    header_bytes: int = Field(default=0, ge=0, le=1500, description=_HEADER)
    header_source: str = ASSUMED
    blackouts: Annotated[Windows, Strict(False), AfterValidator(_in_order)] = Field(default=(), description=_BLACKOUTS)
    blackouts_source: str = ASSUMED


def _direction(value: Any, read: ModelWrapValidatorHandler[LinkDirection], info: ValidationInfo) -> LinkDirection:
    """Read a direction: beside a preset all keys may be left out."""
    # A preset that could not be read may have been meant for all of it.
    whole = info.data.get("preset", "") is None
    if value is None:
        if whole:
            raise PydanticKnownError("missing")
        return LinkDirection()
    return WholeDirection.model_validate(value) if whole else read(value)


_KNOWN = f"Known: {', '.join(DELIVERIES)}."
_NEEDED: JsonDict = {"required": ["rate_bps", "delay_s"]}
_WITHOUT_PRESET: JsonDict = {
    "if": {"not": {"required": ["preset"]}},
    "then": {"required": ["up", "down"], "properties": {"up": _NEEDED, "down": _NEEDED}},
}
"""What editors are told of a link: without a preset, each direction has a rate and a delay."""


class Link(Part):
    """Both directions: ``up`` from the operator to the robot, ``down`` back.

    ``clock`` says in which seconds rates, delays and blackouts are given. On the wall, a simulation that runs at
    ``real_time_factor`` sees a delay of d seconds as d times the factor of its own. A preset knows its own clock.
    """

    model_config = ConfigDict(json_schema_extra=_WITHOUT_PRESET)

    clock: Literal["simulated", "wall"] = Field(
        default="simulated", description='"simulated" or "wall": whose seconds the link\'s figures are in.'
    )
    real_time_factor: float = Field(
        default=1.0,
        gt=0.0,
        le=1e3,
        description="Simulated seconds in a second on the wall, such as 0.16.",
    )
    real_time_factor_source: str = ASSUMED
    preset: Annotated[str | None, *named("A link with a name, one of", PRESETS)] = None
    heartbeat: Literal["state", "hash"] = Field(
        default="state",
        description='"state" or "hash": the field site\'s heartbeat tells all that the mirror must hold, or its hash.',
    )
    heartbeat_s: float = Field(
        default=10.0,
        gt=0.0,
        le=1e6,
        description="How often, in simulated seconds, the field site's heart beats, such as 10.0.",
    )
    heartbeat_source: str = ASSUMED
    delivery: Annotated[Delivery | None, *registered(MODELS["delivery"])] = Field(
        default=None,
        description=f"How messages get across: a name, or a table with model and its keys. {_KNOWN}",
    )
    delivery_source: str | None = Field(default_factory=source_of("delivery"))
    up: Annotated[LinkDirection, WrapValidator(_direction)] = Field(
        default=None, validate_default=True, description="A table [link.up] with rate_bps and delay_s."
    )
    down: Annotated[LinkDirection, WrapValidator(_direction)] = Field(
        default=None, validate_default=True, description="A table [link.down] with rate_bps and delay_s."
    )
