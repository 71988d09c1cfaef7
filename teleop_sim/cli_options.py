"""Options of ``teleop-sim run`` as overrides of a scenario; all that is wrong with them and with the file at once."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.core.units import parse_rate_bps, parse_time_s

if TYPE_CHECKING:
    from teleop_sim.scenarios.schema import Scenario


@dataclass(frozen=True)
class _Option:
    """An option: the scenario's keys that it sets, and how its text is read."""

    name: str
    keys: tuple[str, ...]
    parse: Callable[[str, str], object]


def _text(text: str, _where: str) -> object:
    return text


def _whole(text: str, where: str) -> object:
    try:
        return int(text)
    except ValueError:
        shown = repr(text if len(text) <= 40 else f"{text[:37]}...")
        raise BadInput((Problem(where, f"{shown} is not a whole number", "Give one, such as 1."),)) from None


def _share(text: str, where: str) -> object:
    try:
        return {"model": "bernoulli", "p": float(text)}
    except ValueError:
        shown = repr(text if len(text) <= 40 else f"{text[:37]}...")
        raise BadInput((Problem(where, f"{shown} is not a number", "Give a share such as 0.05."),)) from None


def _factor(text: str, where: str) -> object:
    try:
        return float(text)
    except ValueError:
        shown = repr(text if len(text) <= 40 else f"{text[:37]}...")
        raise BadInput((Problem(where, f"{shown} is not a number", "Give a factor such as 0.7."),)) from None


OPTIONS = (
    _Option("--preset", ("link.preset",), _text),
    _Option("--delivery", ("link.delivery",), _text),
    _Option("--loss", ("link.up.loss", "link.down.loss"), _share),
    _Option("--uplink", ("link.up.rate_bps",), parse_rate_bps),
    _Option("--downlink", ("link.down.rate_bps",), parse_rate_bps),
    _Option("--latency", ("link.up.delay_s", "link.down.delay_s"), parse_time_s),
    _Option("--header", ("link.up.header_bytes", "link.down.header_bytes"), _whole),
    _Option("--robot", ("robot",), _text),
    _Option("--autonomy", ("autonomy",), _text),
    _Option("--layer", ("layer",), _text),
    _Option("--pacing", ("pacing",), _text),
    _Option("--policy", ("operator.policy",), _text),
    _Option("--team", ("operator.team",), _whole),
    _Option("--expertise", ("operator.expertise",), _factor),
    _Option("--seed", ("seed",), _whole),
    _Option("--time-limit", ("time_limit_s",), parse_time_s),
)


def scenario_from(
    name_or_path: str, given: Mapping[str, str | None], out: Path, settings: Sequence[str] = ()
) -> Scenario:
    """The scenario with options in force; the log must fit into ``out``.

    Args:
        name_or_path: of the scenario.
        given: options, name to text; None: not given.
        out: directory of the log.
        settings: texts of ``--set``, such as ``link.up.rate_bps=64bps``.

    Raises:
        BadInput: every problem of the options, of the scenario file and of ``out``.

    """
    from teleop_sim.scenarios.files import load_scenario

    changes = _Changes()
    if given.get("--preset") is not None:
        # The whole link is the preset's; what other options say is changed afterwards.
        changes.values |= {"link.up": {}, "link.down": {}}
        changes.labels |= dict.fromkeys(changes.values, "--preset")
    for option in OPTIONS:
        text = given.get(option.name)
        if text is not None:
            changes.take(option, text)
    for text in settings:
        changes.set(text)
    problems, scenario = changes.problems, None
    try:
        scenario = load_scenario(name_or_path, changes.values, changes.labels)
    except BadInput as error:
        problems += error.problems
    problems += _log_problems(out, scenario)
    if problems or scenario is None:
        # One option may set two keys: say it once.
        raise BadInput(tuple(dict.fromkeys(problems)))
    return scenario


class _Changes:
    """Changes of a scenario by dotted key, what each was called, and what was wrong with them."""

    def __init__(self) -> None:
        self.values: dict[str, object] = {}
        self.labels: dict[str, str] = {}
        self.problems: list[Problem] = []

    def take(self, option: _Option, text: str) -> None:
        """What an option asks for."""
        try:
            value = option.parse(text, option.name)
        except BadInput as error:
            self.problems += error.problems
        else:
            self.values |= dict.fromkeys(option.keys, value)
            self.labels |= dict.fromkeys(option.keys, option.name)

    def set(self, text: str) -> None:
        """What a text of ``--set`` asks for."""
        from teleop_sim.scenarios.setting import label, read_setting, spread

        try:
            key, value = read_setting(text)
        except BadInput as error:
            self.problems += error.problems
            return
        asked = spread({key: value})
        earlier = sorted({self.labels[name] for name in asked if name in self.labels})
        if earlier:
            self.problems.append(Problem(label(key), f"was given before, by {earlier[0]}", "Keep one of the two."))
        self.values |= asked
        self.labels |= dict.fromkeys(asked, label(key))


def log_path(out: Path, scenario: Scenario) -> Path:
    """Where a run's log goes."""
    return out / f"{scenario.name}_seed{scenario.seed}.mcap"


def out_problems(out: Path) -> list[Problem]:
    """What keeps a directory from being made or written to."""
    dangling = next((path for path in (out, *out.parents) if path.is_symlink() and not path.exists()), None)
    if dangling is not None:
        return [Problem("--out", f"{dangling} is a link that leads nowhere", "Give another directory.")]
    nearest = next((path for path in (out, *out.absolute().parents) if path.exists()), Path("/"))
    if not nearest.is_dir():
        return [Problem("--out", f"{nearest} is not a directory", "Give a directory.")]
    if not os.access(nearest, os.W_OK | os.X_OK):
        return [Problem("--out", f"{nearest} cannot be written to", "Give another directory.")]
    return []


def _log_problems(out: Path, scenario: Scenario | None) -> list[Problem]:
    problems = out_problems(out)
    if not problems and scenario is not None and log_path(out, scenario).is_dir():
        return [Problem("--out", f"{log_path(out, scenario)} is a directory", "Move it: the log goes there.")]
    return problems
