"""The link of a scenario as the channel wants it: settings, deliveries, rates by state; and why it cannot be.

The preset comes first, in its own clock; then what the scenario says of a direction takes its place, in the clock that
the scenario names. Everything here is in simulated seconds afterwards.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Literal

import numpy as np

from teleop_sim.channel.clock import simulated_bps, simulated_rates, simulated_s, simulated_schedule
from teleop_sim.channel.delivery import BestEffort, Delivery
from teleop_sim.channel.feasible import undeliverable
from teleop_sim.channel.link import DirectionSettings
from teleop_sim.channel.message import DirectionName
from teleop_sim.channel.presets import Spell, Way, preset
from teleop_sim.channel.tcp import least_packet_bytes
from teleop_sim.core.errors import BadInput, Problem, unknown_name
from teleop_sim.core.streams import stream
from teleop_sim.scenarios.link_schema import LinkDirection
from teleop_sim.scenarios.schema import Scenario

Streams = Callable[[str], np.random.Generator]
"""Named random streams of one replicate."""

_BARE = DirectionSettings(math.inf, 0.0)
_AS_GIVEN = (
    "header_bytes",
    "on_dark",
    "on_dark_flight",
    "loss",
    "reorder",
    "queue_limit",
    "discipline",
    "drop",
    "budget_bits",
    "mtu_bytes",
)
"""Keys of a scenario that are settings of a direction as they stand, whatever the clock."""

_ONE_OF = (
    ("blackouts", "dark"),
    ("rates", "alternating"),
    ("delays", "alternating"),
)
"""Keys that say the same thing in two ways."""


@dataclass(frozen=True)
class WayPlan:
    """One direction of a run.

    Attributes:
        settings: what the direction can do.
        delivery: how the messages get across that go this way.
        rate_of_state: the rate [bit/s] while the machine is in a state; empty: the state does not matter.
        priorities: urgency by topic; others have 0.

    """

    settings: DirectionSettings
    delivery: Delivery
    rate_of_state: Mapping[str, float] = field(default_factory=dict)
    priorities: Mapping[str, int] = field(default_factory=dict)

    def rate_in(self, state: str) -> float:
        """The rate while the machine is in a state [bit/s]."""
        return self.rate_of_state.get(state, self.settings.rate_bps)


@dataclass(frozen=True)
class LinkPlan:
    """Both directions of a run."""

    up: WayPlan
    down: WayPlan

    @property
    def round_trip_s(self) -> float:
        """There and back at the start of the run, without serialisation [s]."""
        return self.up.settings.delay_at(0.0) + self.down.settings.delay_at(0.0)


def link_plan(scenario: Scenario, streams: Streams) -> LinkPlan:
    """The link of one run.

    Args:
        scenario: whose link it is.
        streams: of the run; blackouts that a model draws come from ``link.up.dark`` and ``link.down.dark``.

    Raises:
        BadInput: with every reason why it cannot be, or could never deliver anything; places as ``link.up.rates[1]``.

    """
    plans: dict[str, WayPlan] = {}
    problems: list[Problem] = []
    for name in _names():
        try:
            plans[name] = _way_plan(scenario, name, streams)
        except BadInput as error:
            problems += error.problems
    if problems:
        raise BadInput(tuple(problems))
    return LinkPlan(plans["up"], plans["down"])


def link_problems(scenario: Scenario) -> tuple[Problem, ...]:
    """Why the scenario's link cannot be, for its own seed; nothing if it can."""
    try:
        link_plan(scenario, partial(stream, scenario.seed, 0))
    except BadInput as error:
        return error.problems
    return ()


def _names() -> tuple[DirectionName, DirectionName]:
    return "up", "down"


def _way_plan(scenario: Scenario, name: DirectionName, streams: Streams) -> WayPlan:
    link, where = scenario.link, f"link.{name}"
    own: LinkDirection = link.up if name == "up" else link.down
    factor = link.real_time_factor if link.clock == "wall" else 1.0
    rates, problems = _rates_by_state(scenario, own, where, factor)
    problems += (*_contradictions(own, where), *_way_problems(scenario, own, where))
    settings = _BARE
    try:
        settings = _settings(scenario, own, name, factor, partial(streams, f"{where}.dark"))
    except BadInput as error:
        problems += error.problems
    if rates and settings.rates:
        problems += (
            Problem(f"{where}.by_state", "stands beside rates in turn", "Give rate_bps: it holds in all other states."),
        )
    if rates:
        settings = replace(settings, rates=((0.0, rates.get(_states(scenario)[0], settings.rate_bps)),))
    if problems:
        raise BadInput(problems)
    delivery, other = _delivery(scenario, own), _delivery(scenario, link.down if name == "up" else link.up)
    _refuse_undeliverable(scenario, own, settings, where, least_packet_bytes(delivery, other))
    return WayPlan(settings, delivery, rates, own.priorities or {})


def _delivery(scenario: Scenario, own: LinkDirection) -> Delivery:
    """How messages of a direction get across."""
    return own.delivery or scenario.link.delivery or BestEffort()


def _settings(
    scenario: Scenario,
    own: LinkDirection,
    name: DirectionName,
    factor: float,
    draw: Callable[[], np.random.Generator],
) -> DirectionSettings:
    """What the direction can do, apart from rates by state."""
    named, until_s, where = scenario.link.preset, scenario.time_limit_s, f"link.{name}"
    way = own.way or name
    # A way that the preset does not have is told elsewhere.
    known = named is not None and way in preset(named).ways
    base = _from_preset(scenario, way, draw(), where) if known else _BARE
    try:
        return replace(base, **_changes(own, factor, until_s, draw))
    except BadInput as error:
        raise BadInput(tuple(replace(p, where=f"{where}.{p.where}") for p in error.problems)) from None


def _refuse_undeliverable(
    scenario: Scenario, own: LinkDirection, settings: DirectionSettings, where: str, tcp_bytes: int
) -> None:
    # What is drawn is known up to the end of the run only.
    drawn = own.dark is not None or scenario.link.preset is not None
    found = undeliverable(settings, scenario.time_limit_s if drawn else math.inf, where, tcp_bytes)
    if own.dark is not None:
        found = tuple(replace(p, where=p.where.replace(".blackouts", ".dark")) for p in found)
    if found:
        raise BadInput(found)


def _from_preset(
    scenario: Scenario, way: Literal["up", "down", "burst"], rng: np.random.Generator, where: str
) -> DirectionSettings:
    chosen = preset(scenario.link.preset or "")
    try:
        return chosen.settings(scenario.time_limit_s, rng, way, scenario.link.real_time_factor)
    except BadInput as error:
        raise BadInput(tuple(replace(p, where=where, what=f"{p.where}: {p.what}") for p in error.problems)) from None


def _changes(
    own: LinkDirection, factor: float, until_s: float, draw: Callable[[], np.random.Generator]
) -> dict[str, Any]:
    """The settings that a direction of the scenario gives, in simulated seconds."""
    made: dict[str, Any] = {key: getattr(own, key) for key in _AS_GIVEN if getattr(own, key) is not None}
    # One rate or delay for good takes the place of those in turn.
    if own.rate_bps is not None:
        made |= {"rate_bps": simulated_bps(own.rate_bps, factor), "rates": ()}
    if own.delay_s is not None:
        made |= {"delay_s": simulated_s(own.delay_s, factor), "delays": ()}
    if own.alternating is not None:
        spells = tuple(Spell(spell.for_s, spell.rate_bps, spell.delay_s) for spell in own.alternating)
        turns = Way(_BARE, None, spells).settings(until_s / factor, draw())
        made |= {"rates": simulated_rates(turns.rates, factor), "delays": simulated_schedule(turns.delays, factor)}
    if own.rates is not None:
        made["rates"] = simulated_rates(own.rates, factor)
    if own.delays is not None:
        made["delays"] = simulated_schedule(own.delays, factor)
    if own.blackouts is not None:
        made["blackouts"] = simulated_schedule(own.blackouts, factor)
    if own.dark is not None:
        made["blackouts"] = simulated_schedule(own.dark.windows(until_s / factor, draw()), factor)
    if own.jitter is not None:
        made["jitter"] = own.jitter.scaled(factor)
    return made


def _contradictions(own: LinkDirection, where: str) -> tuple[Problem, ...]:
    """Keys that say the same thing in two ways."""
    both = [(a, b) for a, b in _ONE_OF if getattr(own, a) and getattr(own, b) is not None]
    return tuple(Problem(f"{where}.{b}", f"stands beside {a}", f"Give {a} or {b}.") for a, b in both)


def _way_problems(scenario: Scenario, own: LinkDirection, where: str) -> tuple[Problem, ...]:
    """A way of the preset that is not there."""
    if own.way is None:
        return ()
    if scenario.link.preset is None:
        return (Problem(f"{where}.way", f"{own.way!r} of no preset", "Add preset to [link], or leave it out."),)
    known = tuple(preset(scenario.link.preset).ways)
    return () if own.way in known else (unknown_name(f"{where}.way", own.way, known),)


def _rates_by_state(
    scenario: Scenario, own: LinkDirection, where: str, factor: float
) -> tuple[dict[str, float], tuple[Problem, ...]]:
    """State to rate [bit/s], and states that the task's machine does not have or that are named twice."""
    if not own.by_state:
        return {}, ()
    known, rates, problems = _states(scenario), dict[str, float](), list[Problem]()
    for i, entry in enumerate(own.by_state):
        here = f"{where}.by_state[{i}].state"
        if entry.state not in known:
            problems.append(unknown_name(here, entry.state, known))
        elif entry.state in rates:
            problems.append(Problem(here, f"{entry.state} was given before", "Keep one of the two."))
        rates[entry.state] = simulated_bps(entry.rate_bps, factor)
    return rates, tuple(problems)


def _states(scenario: Scenario) -> tuple[str, ...]:
    """States of the task's machine, the first one first."""
    # Robots and their worlds are loaded only if a machine is asked for.
    from teleop_sim.scenarios.objects import machine_of

    machine = machine_of(scenario)
    return (machine.start, *(name for name in machine.state_names if name != machine.start))
