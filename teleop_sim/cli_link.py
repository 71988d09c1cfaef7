"""Options of ``teleop-sim channel trace`` as a link; all that is wrong with them at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from teleop_sim.channel.delivery import DELIVERIES, BestEffort, Delivery
from teleop_sim.channel.jitter import UniformJitter
from teleop_sim.channel.loss import Bernoulli
from teleop_sim.channel.presets import PRESETS, Preset
from teleop_sim.channel.queueing import DISCIPLINES, DROPS
from teleop_sim.channel.settings import DirectionSettings
from teleop_sim.core.errors import BadInput, Problem, UnknownName
from teleop_sim.core.streams import stream
from teleop_sim.core.units import format_rate, format_time, parse_rate_bps, parse_time_s

DRAWN_AFTER_S = 86400.0
"""How long after the last message a preset's blackouts and rates are drawn (assumed).

A trace of one ends then, and one of a delivery that acknowledges, for it might never give up.
"""

T = TypeVar("T")


def _whole(text: str, where: str) -> int:
    try:
        value = int(text)
    except ValueError:
        value = -1
    if value < 0:
        raise BadInput((Problem(where, f"{_shown(text)} is no whole number from zero", "Give one, such as 1."),))
    return value


def _real(text: str, where: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise BadInput((Problem(where, f"{_shown(text)} is no number", "Give one, such as 0.16."),)) from None


def _one_of(choices: Sequence[str]) -> Callable[[str, str], str]:
    def parse(text: str, where: str) -> str:
        if text not in choices:
            raise UnknownName(where, text, tuple(choices))
        return text

    return parse


def _jitter(text: str, where: str) -> UniformJitter:
    return UniformJitter(0.0, parse_time_s(text, where))


def _loss(text: str, where: str) -> Bernoulli:
    value = _real(text, where)
    if not 0.0 <= value < 1.0:
        raise BadInput(
            (Problem(where, f"{_shown(text)} is no probability", "Give 0 or more and less than 1, such as 0.05."),)
        )
    return Bernoulli(value)


def _blackout(text: str, where: str) -> tuple[float, float]:
    start, dash, end = text.partition("-")
    if not dash:
        raise BadInput((Problem(where, f"{_shown(text)} is no stretch of time", "Give one, such as 10s-40s or 10s-."),))
    return parse_time_s(start, where), parse_time_s(end, where) if end.strip() else math.inf


def _end(text: str, where: str) -> float:
    value_s = parse_time_s(text, where)
    if value_s <= 0.0:
        raise BadInput((Problem(where, "nothing happens in no time", "Give above zero, such as 3min."),))
    return value_s


def _preset(text: str, where: str) -> Preset:
    if text not in PRESETS:
        raise UnknownName(where, text, tuple(PRESETS))
    return PRESETS[text]


def _delivery(text: str, where: str) -> Delivery:
    if text not in DELIVERIES:
        raise UnknownName(where, text, tuple(DELIVERIES))
    return DELIVERIES[text]()


def _shown(text: str) -> str:
    return repr(text if len(text) <= 40 else f"{text[:37]}...")


FIELDS: Mapping[str, tuple[str, Callable[[str, str], Any]]] = {
    "--latency": ("delay_s", parse_time_s),
    "--jitter": ("jitter", _jitter),
    "--loss": ("loss", _loss),
    "--on-dark": ("on_dark", _one_of(("pause", "restart", "lose"))),
    "--queue": ("queue_limit", _whole),
    "--discipline": ("discipline", _one_of(tuple(DISCIPLINES))),
    "--drop": ("drop", _one_of(DROPS)),
    "--mtu": ("mtu_bytes", _whole),
    "--header": ("header_bytes", _whole),
    "--budget": ("budget_bits", _whole),
}
"""Option to the field of ``DirectionSettings`` that it sets and how its text is read."""

RATES = {"--uplink": "up", "--downlink": "down"}


@dataclass(frozen=True)
class ChosenLink:
    """What is traced: settings, name of the way, when to stop [s], seed, and words for a title.

    ``back``: settings of the other direction, if the delivery acknowledges; None: it needs none.
    """

    settings: DirectionSettings
    way: str
    until_s: float
    seed: int
    title: str
    delivery: Delivery
    back: DirectionSettings | None

    @property
    def way_back(self) -> str:
        """Name of the other direction."""
        return _back_of(self.way)


def _back_of(way: str) -> str:
    return "down" if way == "up" else "up"


def link_from(given: Mapping[str, str], blackouts: Sequence[str], last_s: float) -> ChosenLink:
    """The link that options (name to text) ask for.

    Args:
        given: options.
        blackouts: texts such as ``10s-40s``; any of them replaces the preset's.
        last_s: when the last message is sent.

    Raises:
        BadInput: every problem of the options.

    """
    reader = _Reader(given)
    chosen = reader.read("--preset", _preset)
    delivery = reader.read("--delivery", _delivery) or BestEffort()
    rates = {way: reader.read(name, parse_rate_bps) for name, way in RATES.items()}
    changes = _changes(reader, blackouts)
    seed = reader.read("--seed", _whole) or 0
    until_s = reader.read("--until", _end)
    factor = reader.read("--real-time-factor", _real)
    way = _way(given, chosen, rates, reader)
    if delivery.acknowledged:
        _refuse_one_way(given, way, reader)
    reader.done()
    drawn_s = max(last_s, until_s or 0.0) + DRAWN_AFTER_S

    def made(name: str) -> DirectionSettings:
        base = DirectionSettings(math.inf, 0.0)
        if chosen is not None:
            rng = stream(seed, 0, f"link.{name}.blackouts")
            base = chosen.settings(drawn_s, rng, name, 1.0 if factor is None else factor)
        rate_bps = rates.get(name)
        return _changed(base, changes if rate_bps is None else changes | {"rate_bps": rate_bps, "rates": ()})

    settings = made(way)
    back = made(_back_of(way)) if delivery.acknowledged else None
    if until_s is None:
        # What is drawn is known up to here only.
        drawn = chosen is not None and (chosen.ways[way].dark or chosen.ways[way].alternating)
        until_s = drawn_s if drawn or back is not None else math.inf
    return ChosenLink(settings, way, until_s, seed, _title(chosen, way, settings), delivery, back)


def _changes(reader: _Reader, blackouts: Sequence[str]) -> dict[str, Any]:
    """Fields of the settings that options set, in both directions."""
    read = {field: reader.read(name, parse) for name, (field, parse) in FIELDS.items()}
    changes: dict[str, Any] = {field: value for field, value in read.items() if value is not None}
    if blackouts:
        changes["blackouts"] = tuple(filter(None, (reader.parse("--blackout", _blackout, text) for text in blackouts)))
    if "delay_s" in changes:
        changes["delays"] = ()
    return changes


def _refuse_one_way(given: Mapping[str, str], way: str, reader: _Reader) -> None:
    """Acknowledgements need a way back."""
    option = f"--{_back_of(way)}link"
    if "--preset" not in given and f"--{way}link" in given and option not in given:
        what = f"{given['--delivery']} is acknowledged, and there is no way back"
        reader.problems.append(Problem(option, what, f"Add {option} RATE."))


def _changed(base: DirectionSettings, changes: Mapping[str, Any]) -> DirectionSettings:
    """The settings with changes; what is wrong with them is told by the names of the options."""
    names = {field: name for name, (field, _) in FIELDS.items()} | {"blackouts": "--blackout"}
    try:
        return replace(base, **changes)
    except BadInput as error:
        told = (
            replace(problem, where=names.get(problem.where.split("[")[0], problem.where)) for problem in error.problems
        )
        raise BadInput(tuple(told)) from None


class _Reader:
    """Reads options one after the other and keeps what is wrong with them."""

    def __init__(self, given: Mapping[str, str]) -> None:
        self._given = given
        self.problems: list[Problem] = []

    def read(self, name: str, parse: Callable[[str, str], T]) -> T | None:
        text = self._given.get(name)
        return None if text is None else self.parse(name, parse, text)

    def parse(self, name: str, parse: Callable[[str, str], T], text: str) -> T | None:
        try:
            return parse(text, name)
        except BadInput as error:
            self.problems += error.problems
            return None

    def done(self) -> None:
        if self.problems:
            raise BadInput(tuple(self.problems))


def _way(given: Mapping[str, str], chosen: Preset | None, rates: Mapping[str, object], reader: _Reader) -> str:
    """Which way is meant; what is missing or does not exist goes to the reader's problems."""
    asked = given.get("--direction")
    way = asked or ("down" if given.get("--uplink") is None and given.get("--downlink") is not None else "up")
    if given.get("--preset") is None:
        if given.get("--uplink") is None and given.get("--downlink") is None:
            hint = "Give --preset NAME (teleop-sim channel list) or --uplink RATE."
            reader.problems.append(Problem("channel trace", "no link was given", hint))
        elif way not in rates:
            reader.parse("--direction", _one_of(tuple(rates)), way)
        elif given.get(f"--{way}link") is None:
            reader.problems.append(Problem("--direction", f"no rate was given for {way}", f"Add --{way}link RATE."))
        if given.get("--real-time-factor") is not None:
            what = "it needs a preset, whose limits may run in wall time"
            reader.problems.append(Problem("--real-time-factor", what, "Add --preset NAME or leave it out."))
    elif chosen is not None:
        reader.parse("--direction", _one_of(tuple(chosen.ways)), way)
    return way


def _title(chosen: Preset | None, way: str, settings: DirectionSettings) -> str:
    return f"{chosen.name if chosen else 'link'} {way}: {rate_words(settings)}, {delay_words(settings)} one way"


def delay_words(settings: DirectionSettings) -> str:
    """The delay, or the delays in turn, in a few words."""
    delays_s = tuple(dict.fromkeys(delay_s for _, delay_s in settings.delays)) or (settings.delay_s,)
    return " / ".join(map(format_time, delays_s))


def rate_words(settings: DirectionSettings) -> str:
    """The rate, or the rates in turn, or the budget, in a few words."""
    rates = tuple(dict.fromkeys(rate for _, rate in settings.rates)) or (settings.rate_bps,)
    if settings.budget_bits < math.inf:
        return f"{settings.budget_bits:,.0f} bit in all"
    return " / ".join("no limit" if math.isinf(rate) else format_rate(rate) for rate in rates)
