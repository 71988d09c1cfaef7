"""Scenario files: found, read, overridden, checked; every problem of a file at once."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import chain
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.scenarios.complaints import Reporter
from teleop_sim.scenarios.disturbances import disturbance_problems
from teleop_sim.scenarios.drc import task_problems
from teleop_sim.scenarios.library import find_scenario, list_scenarios
from teleop_sim.scenarios.links import link_problems
from teleop_sim.scenarios.reading import key_path, read_toml
from teleop_sim.scenarios.robots import robot_problems
from teleop_sim.scenarios.schema import Scenario
from teleop_sim.scenarios.setting import attempted, spread
from teleop_sim.scenarios.writing import scenario_to_toml

__all__ = ["json_schema", "list_scenarios", "load_scenario", "read_scenario", "scenario_to_toml"]

_NONE: Mapping[str, Any] = {}


def load_scenario(
    name_or_path: str | Path, overrides: Mapping[str, object] = _NONE, labels: Mapping[str, str] = _NONE
) -> Scenario:
    """Load a scenario by name or path.

    Args:
        name_or_path: of one that comes with teleop-sim, or of a file.
        overrides: dotted key to value, such as ``{"link.up.rate_bps": 380.0}``; they take the place of the file's, and
            the number's ``*_source`` then says so (``scenarios.setting.changed``).
        labels: dotted key to what an error about its override should call it, such as ``--uplink``.

    Raises:
        BadInput: with every problem of the file and of the overrides.

    """
    path = find_scenario(str(name_or_path))
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadInput((_not_utf8(error, path),)) from None
    except OSError as error:
        raise BadInput((Problem(str(path), f"cannot be read: {error.strerror}"),)) from None
    return read_scenario(text, str(path), path.stem, overrides, labels)


def read_scenario(
    text: str,
    where: str,
    name: str = "",
    overrides: Mapping[str, object] = _NONE,
    labels: Mapping[str, str] = _NONE,
) -> Scenario:
    """Read a scenario from TOML text; ``where`` is what errors call it, ``name`` its name unless the text gives one."""
    read = read_toml(text, where)
    if read.values is None:
        raise BadInput(read.problems)
    values, unset = attempted(read.values, overrides, labels)
    if name:
        values.setdefault("name", name)
    named = spread(labels)
    reporter = Reporter(where, read.places, {key: named.get(key, key) for key in spread(overrides)})
    try:
        scenario = Scenario.model_validate(values)
    except ValidationError as error:
        # What is missing may stand on a line that could not be read; sources wait for what they are sources of.
        left_out = ("default_factory_not_called", "missing" if read.problems else "")
        details = [d for d in error.errors() if d["type"] not in left_out]
        raise BadInput(read.problems + unset + tuple(reporter.problems(details))) from None
    problems_of = (task_problems, robot_problems, link_problems, disturbance_problems)
    impossible = tuple(chain.from_iterable(of(scenario) for of in problems_of))
    if problems := (read.problems + unset) or tuple(reporter.problems(map(_detail, impossible))):
        raise BadInput(problems)
    return scenario


def json_schema() -> dict[str, Any]:
    """JSON Schema of a scenario file, for editors."""
    schema = _without_nothing(Scenario.model_json_schema(by_alias=True))
    # A file that gives no name is called after itself.
    schema["required"] = [key for key in schema["required"] if key != "name"]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def _without_nothing(schema: Any) -> Any:
    """A schema without null, which TOML does not have, and without endless defaults, which JSON does not have."""
    if isinstance(schema, list):
        return [_without_nothing(inner) for inner in schema if inner != {"type": "null"}]
    if not isinstance(schema, dict):
        return schema
    kept = {key: _without_nothing(inner) for key, inner in schema.items() if inner is not None and _in_json(inner)}
    choices = kept.get("anyOf", ())
    return {key: inner for key, inner in kept.items() if key != "anyOf"} | choices[0] if len(choices) == 1 else kept


def _in_json(value: object) -> bool:
    return not (isinstance(value, float) and math.isinf(value))


def _detail(problem: Problem) -> ErrorDetails:
    """A problem whose place is a key, as pydantic would tell it."""
    told = {"what": problem.what, "hint": problem.hint}
    return ErrorDetails(type="refused", loc=key_path(problem.where), msg=problem.what, input=None, ctx=told)


def _not_utf8(error: UnicodeDecodeError, path: Path) -> Problem:
    before: bytes = error.object[: error.start]
    line, column = before.count(b"\n") + 1, error.start - (before.rfind(b"\n") + 1) + 1
    return Problem(
        f"{path}:{line}:{column}", f"byte 0x{error.object[error.start]:02x} is not UTF-8", "Save the file as UTF-8."
    )
