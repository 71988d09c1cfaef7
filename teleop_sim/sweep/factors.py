"""What a sweep varies: named axes, from text such as ``64bps,380bps,4kbps`` or ``1kbps:4kbps:4``.

A factor sets one or more keys of the scenario to the same value. Any scenario key can be a factor; the common ones
have names of their own (``AXES``), which are the columns of the index.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.core.units import parse_rate_bps, parse_time_s

Value = float | int | bool | str | tuple[object, ...]
"""What a scenario key can be set to; a tuple is a TOML list."""

Parse = Callable[[str, str], Value]

MOST_VALUES: Final = 10_000
"""Of one factor: more is a slip of the finger (assumed)."""


@dataclass(frozen=True)
class Factor:
    """One axis.

    Attributes:
        name: column of the index.
        keys: dotted keys of the scenario that it sets.
        values: what it takes on, in the order given; of a range sampled by a design, its two ends.
        scale: of a range to sample from: ``linear`` or ``log``; empty where ``values`` are all there are.
        clears: keys that are set to an empty table first: a preset is the whole link.

    """

    name: str
    keys: tuple[str, ...]
    values: tuple[Value, ...]
    scale: str = ""
    clears: tuple[str, ...] = ()

    @property
    def sampled(self) -> bool:
        """Whether a design draws its values from a range."""
        return bool(self.scale)

    def overrides(self, value: Value) -> dict[str, object]:
        """The scenario's keys with this value."""
        cleared: dict[str, object] = {key: {} for key in self.clears}
        return cleared | dict.fromkeys(self.keys, list(value) if isinstance(value, tuple) else value)

    def at(self, share: float) -> Value:
        """The value at a share from 0 to 1 of a sampled range; of a list, the value whose turn it is."""
        if not self.sampled:
            return self.values[min(int(share * len(self.values)), len(self.values) - 1)]
        low, high = (float(v) for v in self.values if isinstance(v, float | int))
        if self.scale == "log":
            return float(low * (high / low) ** share)
        return low + (high - low) * share


@dataclass(frozen=True)
class Axis:
    """A named axis of the command line: its column, its keys and how one value is read."""

    column: str
    keys: tuple[str, ...]
    parse: Parse
    clears: tuple[str, ...] = ()
    numeric: bool = True


def _word(text: str, _where: str) -> Value:
    return text


def _share(text: str, where: str) -> Value:
    try:
        return float(text)
    except ValueError:
        raise BadInput((Problem(where, f"{text!r} is no number", "Give a share such as 0.05."),)) from None


AXES: Final[Mapping[str, Axis]] = {
    "--preset": Axis("preset", ("link.preset",), _word, ("link.up", "link.down"), numeric=False),
    "--uplink": Axis("uplink_bps", ("link.up.rate_bps",), parse_rate_bps),
    "--downlink": Axis("downlink_bps", ("link.down.rate_bps",), parse_rate_bps),
    "--latency": Axis("latency_s", ("link.up.delay_s", "link.down.delay_s"), parse_time_s),
    "--loss": Axis("loss", ("link.up.loss.p", "link.down.loss.p"), _share),
    "--delivery": Axis("delivery", ("link.delivery",), _word, numeric=False),
    "--autonomy": Axis("autonomy", ("autonomy",), _word, numeric=False),
    "--robot": Axis("robot", ("robot",), _word, numeric=False),
    "--policy": Axis("policy", ("operator.policy",), _word, numeric=False),
    "--pacing": Axis("pacing", ("pacing",), _word, numeric=False),
}
"""Option to axis."""

HINT: Final = "Give values (64bps,380bps), or first:last:count with log at the end for a logarithmic scale (1:8:4:log)."


def axis_factor(option: str, text: str) -> Factor:
    """The factor of a named axis.

    Raises:
        BadInput: every value that cannot be read.

    """
    axis = AXES[option]
    values, scale = _values(text, option, axis.parse, axis.numeric)
    return Factor(axis.column, axis.keys, values, scale, axis.clears)


def set_factor(text: str) -> Factor:
    """The factor of ``KEY=VALUES``: any dotted key of a scenario; values as in TOML, or bare words.

    Whether they fit is for the scenario's schema to say.

    Raises:
        BadInput: no key, no values, or values that cannot be read.

    """
    key, equals, listed = (part.strip() for part in text.partition("="))
    if not (key and equals and listed):
        raise BadInput((Problem("--set", f"{text!r} is not understood", "Give KEY=VALUES, such as world.layout=1,2."),))
    values, scale = _values(listed, f"--set {key}", _plain, numeric=True)
    return Factor(key, (key,), values, scale)


def _plain(text: str, where: str) -> Value:
    """A TOML value, or else a bare word."""
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        if any(c in text for c in "[]{}=\"'"):
            raise BadInput((Problem(where, f"{text!r} is no value", "Give it as in a scenario file."),)) from None
        return text
    if isinstance(value, list):
        return tuple(value)
    if isinstance(value, float | int | bool | str):
        return value
    raise BadInput((Problem(where, f"{text!r} is neither number, text nor list", "Give one of these."),))


def _values(text: str, where: str, parse: Parse, numeric: bool) -> tuple[tuple[Value, ...], str]:
    """Values and scale: of a list, of a range with a count, or the ends of a range to sample from."""
    parts = list(_split(text, ","))
    if numeric and len(parts) == 1 and ":" in text and not text.startswith(("[", '"')):
        return _range(text, where, parse)
    problems: list[Problem] = []
    values: list[Value] = []
    for part in parts:
        try:
            if not part:
                raise BadInput((Problem(where, "a value is missing", HINT),))
            values.append(parse(part, where))
        except BadInput as error:
            problems += error.problems
    if len(set(map(repr, values))) < len(values):
        problems.append(Problem(where, f"{text!r} has a value twice", "Give each once."))
    if problems:
        raise BadInput(tuple(problems))
    return tuple(values), ""


def _range(text: str, where: str, parse: Parse) -> tuple[tuple[Value, ...], str]:
    """``first:last:count``, ``first:last`` to sample from; either with ``:log``."""
    parts = text.split(":")
    log = parts[-1] == "log"
    parts = parts[:-1] if log else parts
    if len(parts) not in (2, 3):
        raise BadInput((Problem(where, f"{text!r} is no range", HINT),))
    ends = [parse(part, where) for part in parts[:2]]
    if not all(isinstance(end, float | int) and not isinstance(end, bool) for end in ends):
        raise BadInput((Problem(where, f"{text!r} does not run from number to number", HINT),))
    low, high = (float(end) for end in ends if isinstance(end, float | int))
    if log and min(low, high) <= 0.0:
        raise BadInput((Problem(where, f"{text!r} has no logarithm", "Begin above zero, or leave out :log."),))
    if len(parts) == 2:
        return (low, high), "log" if log else "linear"
    count = int(parts[2]) if parts[2].isdigit() else 0
    if not 2 <= count <= MOST_VALUES:
        raise BadInput((Problem(where, f"{text!r} has no count from 2 to {MOST_VALUES}", HINT),))
    space = np.geomspace if log else np.linspace
    values = [float(v) for v in space(low, high, count)]
    # Steps of whole numbers stay whole where the ends are: replicates, layouts, retries.
    if all(isinstance(end, int) for end in ends) and all(v.is_integer() for v in values):
        return tuple(int(v) for v in values), ""
    return tuple(values), ""


def _split(text: str, at: str) -> Iterator[str]:
    """Parts between separators that stand in no bracket and no quotes."""
    depth, quoted, part = 0, "", ""
    for c in text:
        if quoted:
            quoted = "" if c == quoted else quoted
        elif c in "\"'":
            quoted = c
        else:
            depth += (c in "[{") - (c in "]}")
        if c == at and depth == 0 and not quoted:
            yield part.strip()
            part = ""
        else:
            part += c
    yield part.strip()
