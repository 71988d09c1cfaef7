"""TOML text to plain values, with every mistake of the text named by line and column."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from typing import Any

from teleop_sim.core.errors import Problem
from teleop_sim.scenarios.places import Place, Places, find_places

_AT = re.compile(r"(.*?) \(at (?:line (\d+), column (\d+)|end of document)\)\Z", re.DOTALL)
_TOO_LONG = re.compile(r"[\d_]{4300}")
_MOST_PROBLEMS = 20


@dataclass(frozen=True)
class Text:
    """A TOML text that was read.

    Attributes:
        values: what it says, without the lines that could not be read; None if too little could be read to go on.
        places: where its keys stand.
        problems: of the text itself; ``values`` is complete only if there are none.

    """

    values: dict[str, Any] | None
    places: Places
    problems: tuple[Problem, ...]


def read_toml(text: str, where: str) -> Text:
    """Read a TOML text; never raises.

    A line that is wrong by itself is reported, blanked and the rest read on. A mistake whose extent is unknown (a
    broken table header, a bracket left open) ends the reading, because what follows could be blamed for it.
    """
    try:
        places = find_places(text)
        return _read_on(text, where, places)
    except RecursionError:
        return Text(None, Places(), (Problem(f"{where}:1:1", "is nested too deeply", "A scenario has three levels."),))


def _read_on(text: str, where: str, places: Places) -> Text:
    lines = text.replace("\r\n", "\n").split("\n")
    problems: list[Problem] = []
    last = -1
    while len(problems) < _MOST_PROBLEMS:
        try:
            return Text(tomllib.loads("\n".join(lines)), places, tuple(problems))
        except ValueError as error:  # TOMLDecodeError, or an integer with more than 4300 digits
            why, place = _mistake(error, lines)
        if place.line == last + 1:  # one mistake drags the next line along: only the first is sure
            return Text(None, places, tuple(problems))
        problems.append(_problem(why, place, where, places))
        line = lines[place.line - 1]
        if not re.match(r"\s*[\w\"'.-]+\s*(=|$)", line):
            return Text(None, places, tuple(problems))
        lines[place.line - 1], last = "", place.line
    return Text(None, places, tuple(problems))


def _mistake(error: ValueError, lines: list[str]) -> tuple[str, Place]:
    found = _AT.match(str(error))
    if found is None:
        line = next((i for i, text in enumerate(lines) if _TOO_LONG.search(text)), 0)
        return "a whole number has too many digits", Place(line + 1, 1)
    if found[2] is None:
        return found[1], Place(len(lines), len(lines[-1]) + 1)
    return found[1], Place(int(found[2]), int(found[3]))


def _problem(why: str, place: Place, where: str, places: Places) -> Problem:
    if place.line in places.twice:
        path = places.twice[place.line]
        first = places.nearest(path)
        return Problem(
            f"{where}:{place.line}:1: {key_text(path)}",
            f"was given before, at line {first.line}",
            "Keep one of the two.",
        )
    return Problem(
        f"{where}:{place.line}:{place.column}",
        f"is not TOML: {why[:1].lower()}{why[1:]}",
        'A line is a [table], key = value or # comment; text stands in "quotes".',
    )


def key_text(path: tuple[str | int, ...]) -> str:
    """A path as people write it: ``link.up.blackouts[1]``."""
    parts = [f"[{part}]" if isinstance(part, int) else f".{part}" for part in path]
    return "".join(parts).removeprefix(".")


def key_path(text: str) -> tuple[str | int, ...]:
    """The path that ``key_text`` writes so."""
    parts = re.findall(r"\[(\d+)\]|([^.\[\]]+)", text)
    return tuple(int(number) if number else name for number, name in parts)
