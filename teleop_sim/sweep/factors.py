"""What a sweep varies: named axes, from text such as ``64bps,380bps,4kbps`` or ``1kbps:4kbps:4``.

A factor sets one or more keys of the scenario to the same value. Any key of a scenario can be a factor; the common ones
have options of their own (``AXES``), whose names are the columns of the index.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final, cast

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.core.units import parse_rate_bps, parse_time_s
from teleop_sim.scenarios.setting import label, read_setting
from teleop_sim.stats.factors import Factor as Levels
from teleop_sim.stats.factors import Range, parse_levels
from teleop_sim.stats.factors import Value as Simple

Value = Simple | tuple[object, ...]
"""What a scenario key can be set to; a tuple is a list of a scenario file."""


@dataclass(frozen=True)
class Factor:
    """One axis.

    Attributes:
        name: column of the index.
        keys: dotted keys of the scenario that it sets.
        levels: what it takes on, in the order given, or a range.
        clears: keys that are set to an empty table first: a preset is the whole link.

    """

    name: str
    keys: tuple[str, ...]
    levels: tuple[Value, ...] | Range
    clears: tuple[str, ...] = ()

    def overrides(self, value: Value) -> dict[str, object]:
        """The scenario's keys with this value."""
        cleared: dict[str, object] = {key: {} for key in self.clears}
        return cleared | dict.fromkeys(self.keys, list(value) if isinstance(value, tuple) else value)

    def designed(self) -> Levels:
        """As ``teleop_sim.stats.designs`` wants it; lists are as good as any other value there."""
        return Levels(self.name, cast(tuple[Simple, ...] | Range, self.levels))


@dataclass(frozen=True)
class Axis:
    """An option that is an axis: its column, its keys and how one value is read."""

    column: str
    keys: tuple[str, ...]
    read: Callable[[str, str], Simple]
    clears: tuple[str, ...] = ()


def _word(text: str, where: str) -> Simple:
    if not text:
        raise BadInput((Problem(where, "a value is missing", "Give values with commas between them."),))
    return text


def _share(text: str, where: str) -> Simple:
    try:
        return float(text)
    except ValueError:
        raise BadInput((Problem(where, f"{text!r} is no number", "Give a share such as 0.05."),)) from None


def _whole(text: str, where: str) -> Simple:
    if not text.isdecimal():
        raise BadInput((Problem(where, f"{text!r} is no whole number", "Give one such as 2."),))
    return int(text)


def _factor(text: str, where: str) -> Simple:
    try:
        return float(text)
    except ValueError:
        raise BadInput((Problem(where, f"{text!r} is no number", "Give a factor such as 0.7."),)) from None


AXES: Final[Mapping[str, Axis]] = {
    "--preset": Axis("preset", ("link.preset",), _word, ("link.up", "link.down")),
    "--uplink": Axis("uplink_bps", ("link.up.rate_bps",), parse_rate_bps),
    "--downlink": Axis("downlink_bps", ("link.down.rate_bps",), parse_rate_bps),
    "--latency": Axis("latency_s", ("link.up.delay_s", "link.down.delay_s"), parse_time_s),
    "--loss": Axis("loss", ("link.up.loss.p", "link.down.loss.p"), _share),
    "--delivery": Axis("delivery", ("link.delivery",), _word),
    "--autonomy": Axis("autonomy", ("autonomy",), _word),
    "--layer": Axis("layer", ("layer",), _word),
    "--robot": Axis("robot", ("robot",), _word),
    "--pacing": Axis("pacing", ("pacing",), _word),
    "--policy": Axis("policy", ("operator.policy",), _word),
    "--team": Axis("team", ("operator.team",), _whole),
    "--expertise": Axis("expertise", ("operator.expertise",), _factor),
}
"""Option to axis."""


def axis_factor(option: str, text: str) -> Factor:
    """The factor of a named axis.

    Raises:
        BadInput: a value that cannot be read, or one twice.

    """
    axis = AXES[option]
    return Factor(axis.column, axis.keys, parse_levels(text, option, axis.read), axis.clears)


def set_factor(text: str) -> Factor:
    """The factor of ``KEY=VALUES``: any dotted key of a scenario; values as ``teleop-sim run --set`` has them.

    Whether they fit is for the scenario's schema to say.

    Raises:
        BadInput: no key, no values, or values that cannot be read.

    """
    key, equals, listed = (part.strip() for part in text.partition("="))
    if not (key and equals and listed):
        raise BadInput((Problem("--set", f"{text!r} is not understood", "Give KEY=VALUES, such as world.layout=1,2."),))

    def read(part: str, _where: str) -> Simple:
        return cast(Simple, read_setting(f"{key}={part}")[1])

    if not any(c in listed for c in "[{\"'"):
        return Factor(key, (key,), parse_levels(listed, label(key), read))
    values = tuple(_frozen(read(part, key)) for part in _split(listed))
    Levels(label(key), cast(tuple[Simple, ...], values))  # refuses what is there twice
    return Factor(key, (key,), values)


def _frozen(value: object) -> Value:
    return tuple(map(_frozen, value)) if isinstance(value, list) else cast(Value, value)


def _split(text: str) -> Iterator[str]:
    """Parts between commas that stand in no bracket and no quotes."""
    depth, quoted, part = 0, "", ""
    for c in text:
        if quoted:
            quoted = "" if c == quoted else quoted
        elif c in "\"'":
            quoted = c
        else:
            depth += (c in "[{") - (c in "]}")
        if c == "," and depth == 0 and not quoted:
            yield part
            part = ""
        else:
            part += c
    yield part
