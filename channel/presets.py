"""Links with a name: what competitions and distances do to messages, each with its source. See docs/link.md.

A preset is data (``presets.toml``): for each way its settings, a model of its blackouts and its changes of rate.
``Preset.settings`` draws the blackouts and makes of them what one run needs.

Source of each figure: in ``presets.toml`` beside it; ``assumed`` there names what no source states.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib.resources import files
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from teleop_sim.channel.clock import simulated_bps, simulated_rates, simulated_s, simulated_schedule
from teleop_sim.channel.dark import DARK_MODELS, DarkModel
from teleop_sim.channel.feasible import refuse_undeliverable
from teleop_sim.channel.settings import DirectionSettings
from teleop_sim.core.errors import UnknownName

WayName = Literal["up", "down", "burst"]
Clock = Literal["wall", "simulated"]

WAYS: tuple[WayName, ...] = ("up", "down", "burst")
"""To the robot, back, and a second link back beside the first (DRC Finals)."""


@dataclass(frozen=True, slots=True)
class Spell:
    """A stretch of an alternating link: how long [s], its rate [bit/s], its one-way delay [s]."""

    for_s: float
    rate_bps: float
    delay_s: float


@dataclass(frozen=True, slots=True)
class Way:
    """One way of a preset: settings without what is drawn or repeats, and what draws and repeats."""

    base: DirectionSettings
    dark: DarkModel | None = None
    alternating: tuple[Spell, ...] = ()

    def settings(self, until_s: float, rng: np.random.Generator) -> DirectionSettings:
        """Everything up to ``until_s`` in place. One draw order: the blackouts of this way."""
        made = self.base
        if self.alternating:
            made = replace(made, **_alternate(self.alternating, until_s))
        return made if self.dark is None else replace(made, blackouts=self.dark.windows(until_s, rng))


@dataclass(frozen=True, slots=True)
class Preset:
    """A named link.

    Attributes:
        name: what one types.
        title: what it is, in a line.
        source: where its figures are from.
        status: how the source says so: code, rules, paper, page, constant or computed.
        clock: whether its limits run in ``"wall"`` time or in ``"simulated"`` time.
        on_dark: rule for the fragment that is being sent when it gets dark: pause, restart or lose.
        on_dark_flight: rule for bits that are already out: arrive or lose.
        ways: by name (up, down, burst).
        assumed: keys that no source states.
        note: what else to know.
        facts: figures of the source that the model has no use for.

    """

    name: str
    title: str
    source: str
    status: str
    clock: Clock
    on_dark: str
    on_dark_flight: str
    ways: Mapping[str, Way]
    assumed: tuple[str, ...] = ()
    note: str = ""
    facts: Mapping[str, object] = field(default_factory=dict)

    @property
    def up(self) -> DirectionSettings:
        """To the robot, without drawn blackouts."""
        return self.ways["up"].base

    @property
    def down(self) -> DirectionSettings:
        """Back from the robot, without drawn blackouts."""
        return self.ways["down"].base

    def way(self, name: str) -> Way:
        """One way of this preset.

        Raises:
            UnknownName: it has no such way.

        """
        if name not in self.ways:
            raise UnknownName(f"direction of {self.name}", name, tuple(self.ways))
        return self.ways[name]

    def settings(
        self, until_s: float, rng: np.random.Generator, way: str = "up", real_time_factor: float = 1.0
    ) -> DirectionSettings:
        """What one run needs of one way, in simulated time.

        Args:
            until_s: simulated time up to which blackouts are drawn and rates alternate.
            rng: of this way's blackouts alone.
            way: up, down or burst.
            real_time_factor: simulated seconds in a second on the wall. It matters where the preset's clock is
                ``wall``: at 0.16 a link of 64 bit/s on the wall carries 400 bits in a simulated second, and 10 s of
                delay are 1.6 s.

        Raises:
            UnknownName: it has no such way.
            BadInput: the factor is not above zero, or nothing could ever be delivered.

        """
        checked = simulated_s(1.0, real_time_factor)
        factor = checked if self.clock == "wall" else 1.0
        made = self.way(way).settings(until_s / factor, rng)
        made = made if factor == 1.0 else in_simulated_time(made, factor)
        refuse_undeliverable(made, until_s, f"{self.name}.{way}")
        return made


def in_simulated_time(settings: DirectionSettings, factor: float) -> DirectionSettings:
    """Settings that were meant in wall time; see ``clock``."""
    return replace(
        settings,
        rate_bps=simulated_bps(settings.rate_bps, factor),
        delay_s=simulated_s(settings.delay_s, factor),
        jitter=settings.jitter.scaled(factor),
        blackouts=simulated_schedule(settings.blackouts, factor),
        rates=simulated_rates(settings.rates, factor),
        delays=tuple((simulated_s(a_s, factor), simulated_s(b_s, factor)) for a_s, b_s in settings.delays),
    )


def preset(name: str) -> Preset:
    """The preset of a name.

    Raises:
        UnknownName: there is none; the message says which was probably meant.

    """
    if name not in PRESETS:
        raise UnknownName("preset", name, tuple(PRESETS))
    return PRESETS[name]


def _alternate(spells: tuple[Spell, ...], until_s: float) -> dict[str, Any]:
    rates: list[tuple[float, float]] = []
    delays: list[tuple[float, float]] = []
    clock_s, i = 0.0, 0
    while not rates or clock_s < until_s:
        spell = spells[i % len(spells)]
        rates.append((clock_s, spell.rate_bps))
        delays.append((clock_s, spell.delay_s))
        clock_s, i = clock_s + spell.for_s, i + 1
    return {"rates": tuple(rates), "delays": tuple(delays)}


def _load() -> Mapping[str, Preset]:
    text = files("teleop_sim.channel").joinpath("presets.toml").read_text(encoding="utf-8")
    read = (_preset(entry) for entry in tomllib.loads(text)["preset"])
    return MappingProxyType({made.name: made for made in read})


def _preset(entry: dict[str, Any]) -> Preset:
    rules: dict[str, Any] = {"on_dark": entry["on_dark"], "on_dark_flight": entry["on_dark_flight"]}
    ways: dict[str, Way] = {name: _way(entry.pop(name), rules) for name in WAYS if name in entry}
    entry["assumed"] = tuple(entry.get("assumed", ()))
    return Preset(ways=MappingProxyType(ways), **entry)


def _way(entry: dict[str, Any], rules: dict[str, Any]) -> Way:
    spells = tuple(Spell(**spell) for spell in entry.pop("alternating", ()))
    dark = dict(entry.pop("dark", {}))
    model = DARK_MODELS[dark.pop("model")](**{k: _frozen(v) for k, v in dark.items()}) if dark else None
    if spells:
        entry = {"rate_bps": spells[0].rate_bps, "delay_s": spells[0].delay_s} | entry
    return Way(DirectionSettings(**entry, **rules), model, spells)


def _frozen(value: Any) -> Any:
    return tuple(_frozen(v) for v in value) if isinstance(value, list) else value


PRESETS: Mapping[str, Preset] = _load()
