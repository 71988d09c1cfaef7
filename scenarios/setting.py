"""Changes of a scenario by dotted key: what the command line sets, and what a sweep varies.

A key is a path through the tables of a scenario file, such as ``link.up.rate_bps`` or ``link.up.by_state[0].rate_bps``.
A key of a direction that is given to ``link`` alone, such as ``link.delay_s``, means both directions.
"""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import Any, TypeVar

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.core.units import parse_rate_bps, parse_time_s
from teleop_sim.scenarios.complaints import keys_of, part_at, shown
from teleop_sim.scenarios.link_schema import MODELS, Link, LinkDirection
from teleop_sim.scenarios.places import KeyPath
from teleop_sim.scenarios.reading import key_path, key_text
from teleop_sim.scenarios.registered import MODEL

T = TypeVar("T")
_NONE: Mapping[str, str] = {}
_DIRECTIONS = ("up", "down")
_HOW = "Give KEY=VALUE, such as link.up.rate_bps=64bps or world.floor_friction=[0.2,0.4]."


def changed(
    tables: Mapping[str, Any], changes: Mapping[str, object], labels: Mapping[str, str] = _NONE
) -> dict[str, Any]:
    """A scenario's tables with some values changed; the tables given stay as they are.

    Args:
        tables: of a scenario file, as TOML gives them. Nothing here is checked against the schema.
        changes: dotted key to value. Tables on the way are made if missing. Where a model is wanted (a loss, a jitter)
            and none is named, it is the first that has the keys: ``link.up.loss.p`` alone is a Bernoulli loss.
        labels: dotted key to what the number's ``*_source``, and an error, should call the change.

    Raises:
        BadInput: keys that lead through something that is no table, or to no place in a list.

    """
    made, problems = attempted(tables, changes, labels)
    if problems:
        raise BadInput(problems)
    return made


def attempted(
    tables: Mapping[str, Any], changes: Mapping[str, object], labels: Mapping[str, str] = _NONE
) -> tuple[dict[str, Any], tuple[Problem, ...]]:
    """As ``changed``, with the problems beside what could be changed."""
    made: dict[str, Any] = copy.deepcopy(dict(tables))
    named, wanted = spread(labels), spread(changes)
    paths = tuple(map(key_path, wanted))
    problems = []
    for path, (dotted, value) in zip(paths, wanted.items(), strict=True):
        label = named.get(dotted, dotted)
        problem = _put(made, path, copy.deepcopy(value), paths, label)
        if problem is not None:
            problems.append(problem)
        elif (source := _source_path(path)) is not None:
            # What was put there has made all tables on the way.
            _put(made, source, f"given: {named.get(dotted, 'override')}", (), label)
    return made, tuple(problems)


def spread(keys: Mapping[str, T]) -> dict[str, T]:
    """Dotted keys with those of both directions written out: ``link.delay_s`` as that of ``up`` and of ``down``."""
    return {each: value for dotted, value in keys.items() for each in _meant(dotted)}


def read_setting(text: str) -> tuple[str, object]:
    """Key and value of a text such as ``link.up.rate_bps=64bps``.

    The value is as in a scenario file; a text needs no quotes; rates (``_bps``) and times (``_s``) may have a unit.

    Raises:
        BadInput: no key, or a value that is not understood.

    """
    dotted, given, value = text.partition("=")
    dotted, value = dotted.strip(), value.strip()
    if not given or not key_path(dotted):
        raise BadInput((Problem("--set", f"{shown(text)} sets nothing", _HOW),))
    return dotted, _value(dotted, value, label(dotted))


def label(dotted: str) -> str:
    """What errors call a setting of the command line."""
    return f"--set {dotted}"


def _value(dotted: str, text: str, where: str) -> object:
    try:
        read = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        pass
    else:
        if set(read) == {"value"}:
            return read["value"]
    if dotted.endswith("_bps"):
        return parse_rate_bps(text, where)
    if dotted.endswith("_s"):
        return parse_time_s(text, where)
    if text and text[0] not in "[{\"'":
        # A bare word; whether a text will do at this key is the schema's to say.
        return text
    what = f"{shown(text)} is no value" if text else "has no value"
    raise BadInput((Problem(where, what, "Write it as in a scenario file: 0.5, true, [0.2, 0.4], a name."),))


def _meant(dotted: str) -> tuple[str, ...]:
    path = key_path(dotted)
    if len(path) > 1 and path[0] == "link" and path[1] in set(keys_of(LinkDirection)) - set(keys_of(Link)):
        return tuple(key_text(("link", direction, *path[1:])) for direction in _DIRECTIONS)
    return (dotted,)


def _put(tables: dict[str, Any], path: KeyPath, value: object, asked: Iterable[KeyPath], where: str) -> Problem | None:
    """Put a value at a path, making tables on the way; or say why not."""
    if not path or not isinstance(path[0], str):
        return Problem(where, "is no key", _HOW)
    here: Any = tables
    for n, name in enumerate(path):
        problem = _no_place(here, name, key_text(path[:n]), where)
        if problem is not None:
            return problem
        if n == len(path) - 1:
            here[name] = value
        elif isinstance(name, int):
            here = here[name]
        else:
            if path[0] == "link" and name in MODELS:
                _name_model(here, name, [str(other[-1]) for other in asked if other[:-1] == path[: n + 1]])
            here = here.setdefault(name, {})
    return None


def _no_place(here: object, name: str | int, found: str, where: str) -> Problem | None:
    """Why nothing can be put into what was found at a key."""
    if isinstance(name, int) and not (isinstance(here, list) and name < len(here)):
        what = f"there is no [{name}] in {found}, which is {shown(here)}"
        return Problem(where, what, "Count from 0 within the list that the file gives, or give the whole list.")
    if isinstance(name, str) and not isinstance(here, dict):
        return Problem(where, f"{found} is {shown(here)}, not a table", f"Set {found} itself.")
    return None


def _name_model(table: dict[str, Any], kind: str, keys: Sequence[str]) -> None:
    """Make a table of a model's bare name; where there is none, of the first model that has the keys."""
    now = table.get(kind)
    if isinstance(now, str):
        table[kind] = {MODEL: now}
    elif now is None and MODEL not in keys:
        models = MODELS[kind]
        fitting = (name for name, made in models.items() if {field.name for field in fields(made)}.issuperset(keys))
        # What fits none is told by the one with the most to choose from.
        table[kind] = {MODEL: next(fitting, max(models, key=lambda name: len(fields(models[name]))))}


def _source_path(path: KeyPath) -> KeyPath | None:
    """Where it stands what the number at a path is from: ``rate_source`` beside ``rate_bps``."""
    for n in range(len(path), 0, -1):
        part, key = part_at(path[: n - 1]), str(path[n - 1])
        known = () if part is None or isinstance(path[n - 1], int) else keys_of(part)
        for stem in (key, key.rpartition("_")[0]):
            if f"{stem}_source" in known:
                return (*path[: n - 1], f"{stem}_source")
    return None
