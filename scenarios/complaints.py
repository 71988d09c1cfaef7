"""pydantic's findings as problems a person can act on: where, what came, what would do."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import date, time
from difflib import get_close_matches
from typing import Any, get_args

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from teleop_sim.core.errors import Problem, unknown_name
from teleop_sim.scenarios.places import KeyPath, Places
from teleop_sim.scenarios.reading import key_text
from teleop_sim.scenarios.schema import Scenario

_WANTED = {
    "float_type": "not a number",
    "int_type": "not a whole number",
    "string_type": "not a text",
    "tuple_type": "not a list",
    "model_type": "not a table",
    "greater_than": "not above {gt:g}",
    "greater_than_equal": "below {ge:g}",
    "less_than": "not below {lt:g}",
    "less_than_equal": "above {le:g}",
    "finite_number": "not finite",
    "literal_error": "not {expected}",
    "string_pattern_mismatch": "not a name",
    "too_long": "longer than {max_length}",
}


@dataclass(frozen=True)
class Reporter:
    """Turns findings into problems; ``labels`` names overridden keys, which stand in no file."""

    where: str
    places: Places
    labels: Mapping[str, str]

    def problems(self, details: Iterable[ErrorDetails]) -> Iterator[Problem]:
        """One problem for each finding, in the order of the text."""
        found = [(self.places.nearest(detail["loc"]), detail) for detail in details]
        found.sort(key=lambda pair: (pair[0].line, pair[0].column))
        return (self._problem(detail["loc"], detail) for _, detail in found)

    def _problem(self, path: KeyPath, detail: ErrorDetails) -> Problem:
        where = self._where(path)
        context: Mapping[str, Any] = detail.get("ctx", {})
        match detail["type"]:
            case "unknown_name":
                return unknown_name(where, context["name"], context["choices"])
            case "refused":
                return Problem(where, context["what"], context["hint"])
            case "extra_forbidden":
                part = part_at(path[:-1])
                return _unknown_key(where, path, keys_of(part) if part else ())
            case "unknown_key":
                return _unknown_key(where, path, context["choices"])
            case "missing":
                return Problem(where, "is missing", _hint(path))
            case kind:
                wanted = _WANTED.get(kind, detail["msg"]).format(**context)
                return Problem(where, f"{shown(detail['input'])} is {wanted}", _hint(path))

    def _where(self, path: KeyPath) -> str:
        key = key_text(path)
        # The closest override is to blame: --uplink, not the --preset that it changes.
        for dotted, label in sorted(self.labels.items(), key=lambda item: -len(item[0])):
            inside = key == dotted or key.startswith((f"{dotted}.", f"{dotted}["))
            made_by_it = dotted.startswith(f"{key}.") and path not in self.places.of
            if inside or made_by_it:
                return label
        place = self.places.nearest(path)
        return f"{self.where}:{place.line}:{place.column}: {key}"


def shown(value: object) -> str:
    """A value as a TOML file spells it, cut short."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict | list | tuple) and not value:
        return "an empty table" if isinstance(value, dict) else "an empty list"
    text = str(value) if isinstance(value, date | time) else repr(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


def part_at(path: KeyPath) -> type[BaseModel] | None:
    """The model of the table at a path of the scenario, also of one in a list."""
    part: type[BaseModel] = Scenario
    for name in path:
        if isinstance(name, int):
            continue
        field = next((f for n, f in part.model_fields.items() if (f.alias or n) == name), None)
        inner = _part_in(field.annotation) if field else None
        if inner is None:
            return None
        part = inner
    return part


def _part_in(annotation: Any) -> type[BaseModel] | None:
    """The model in a type such as ``tuple[Model, ...] | None``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(filter(None, map(_part_in, get_args(annotation))), None)


def keys_of(part: type[BaseModel]) -> tuple[str, ...]:
    """The keys of a table, as a file spells them."""
    return tuple(field.alias or name for name, field in part.model_fields.items())


def _unknown_key(where: str, path: KeyPath, known: tuple[str, ...]) -> Problem:
    close = get_close_matches(str(path[-1]), known, n=1)
    guess = f"Did you mean {close[0]!r}? " if close else ""
    return Problem(where, "unknown key", f"{guess}Known here: {', '.join(known)}.")


def _hint(path: KeyPath) -> str:
    """The description of the field at a path or around it."""
    for length in range(len(path), 0, -1):
        part = part_at(path[: length - 1])
        if part is not None and not isinstance(path[length - 1], int):
            fields = {field.alias or name: field for name, field in part.model_fields.items()}
            field = fields.get(str(path[length - 1]))
            return (field.description or "") if field else ""
    return ""
