"""Tables that name a model: ``loss = { model = "bernoulli", p = 0.1 }``, by the registries of the simulator.

A registry maps a name to a frozen dataclass. The keys of the table are the fields of that class, with its types and its
defaults; what the class itself refuses is refused here with the key's place. So a new model needs no line here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import MISSING, Field, fields
from typing import Any, get_type_hints

from pydantic import (
    BaseModel,
    ConfigDict,
    PlainSerializer,
    PlainValidator,
    ValidationError,
    WithJsonSchema,
    create_model,
)
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError, PydanticKnownError

from teleop_sim.core.errors import BadInput
from teleop_sim.scenarios.parts import refused, unknown
from teleop_sim.scenarios.reading import key_path

MODEL = "model"
"""The key that names the model."""


def registered(models: Mapping[str, type[Any]]) -> Any:
    """Metadata of a value that a table or a bare name makes: one of the classes in ``models``, or None."""
    table = _Registered(models)
    return PlainValidator(table.check), PlainSerializer(table.write), WithJsonSchema(table.json_schema())


class _Registered:
    """One registry as a kind of table."""

    def __init__(self, models: Mapping[str, type[Any]]) -> None:
        self._models = models
        self._tables = {name: _table_of(name, made) for name, made in models.items()}

    def check(self, value: object) -> object:
        """The model that a table asks for.

        Raises:
            ValidationError: with everything that is wrong with the table.
            PydanticCustomError, PydanticKnownError: it is no table, or names no model.

        """
        if value is None or type(value) in self._models.values():
            return value
        if isinstance(value, str):
            # A bare name: what is wrong with it is wrong with the value itself.
            if value not in self._models:
                raise unknown(value, tuple(self._models))
            value = {MODEL: value}
        if not isinstance(value, Mapping):
            raise PydanticKnownError("model_type", {"class_name": MODEL})
        given = {str(key): _frozen(inner) for key, inner in value.items()}
        name = given.pop(MODEL, None)
        if not isinstance(name, str):
            what = "is missing" if MODEL not in value else f"{name!r} is not a text"
            raise _errors([_error((MODEL,), refused(what, self._hint()))])
        if name not in self._models:
            raise _errors([_error((MODEL,), unknown(name, tuple(self._models)))])
        return self._made(name, given)

    def write(self, value: object) -> dict[str, Any] | None:
        """The table of a model, with every key that says something."""
        if value is None:
            return None
        name = next(name for name, made in self._models.items() if type(value) is made)
        keys = ((field.name, getattr(value, field.name)) for field in fields(self._models[name]))
        return {MODEL: name} | {key: inner for key, inner in keys if inner is not None}

    def json_schema(self) -> dict[str, Any]:
        """One schema a model; a name alone will do where the model needs no key."""
        bare = [name for name in self._models if not self._needed(name)]
        return {"anyOf": [{"enum": bare}, *(self._schema_of(name) for name in self._models)]}

    def _schema_of(self, name: str) -> dict[str, Any]:
        schema = self._tables[name].model_json_schema()
        properties = {MODEL: {"const": name}} | schema.get("properties", {})
        return schema | {"properties": properties, "required": [MODEL, *schema.get("required", ())]}

    def _made(self, name: str, given: dict[str, Any]) -> object:
        table = self._tables[name]
        extra = [_error((key,), self._unknown_key(name)) for key in given if key not in table.model_fields]
        try:
            read = table.model_validate({key: value for key, value in given.items() if key in table.model_fields})
            made = self._models[name](**dict(read))
        except ValidationError as error:
            raise _errors([*extra, *(self._told(name, detail) for detail in error.errors())]) from None
        except BadInput as error:
            told = [_error(key_path(p.where), refused(p.what, p.hint)) for p in error.problems]
            raise _errors([*extra, *told]) from None
        if extra:
            raise _errors(extra)
        return made

    def _unknown_key(self, name: str) -> PydanticCustomError:
        known = (MODEL, *self._tables[name].model_fields)
        return PydanticCustomError("unknown_key", "unknown key", {"choices": known})

    def _told(self, name: str, detail: ErrorDetails) -> InitErrorDetails:
        loc, kind = detail["loc"], detail["type"]
        if kind == "missing":
            needs = f"{name!r} needs {', '.join(self._needed(name))}."
            return _error(loc, refused("is missing", needs if len(loc) == 1 else "The list is too short."))
        return InitErrorDetails(type=kind, loc=loc, input=detail["input"], ctx=detail.get("ctx", {}))

    def _needed(self, name: str) -> list[str]:
        return [field.name for field in fields(self._models[name]) if _needed(field)]

    def _hint(self) -> str:
        return f'Give {MODEL} = "NAME" with one of: {", ".join(self._models)}.'


def _table_of(name: str, made: type[Any]) -> type[BaseModel]:
    """The keys of a class as a strict table. Endless times are the class's own to judge."""
    hints = get_type_hints(made)
    keys: dict[str, Any] = {f.name: (hints[f.name], ... if _needed(f) else _default(f)) for f in fields(made)}
    # Defaults are read as if they had been given, so that 8 and 8.0 are written alike.
    config = ConfigDict(frozen=True, extra="forbid", strict=True, validate_default=True)
    return create_model(name, __config__=config, **keys)


def _needed(field: Field[Any]) -> bool:
    return field.default is MISSING and field.default_factory is MISSING


def _default(field: Field[Any]) -> Any:
    return field.default_factory() if field.default_factory is not MISSING else field.default


def _error(loc: tuple[str | int, ...], kind: PydanticCustomError) -> InitErrorDetails:
    return InitErrorDetails(type=kind, loc=loc, input=None)


def _errors(found: Iterable[InitErrorDetails]) -> ValidationError:
    """Findings at places inside a table, as one error that pydantic puts at the place of the table."""
    return ValidationError.from_exception_data("table", list(found))


def _frozen(value: Any) -> Any:
    return tuple(map(_frozen, value)) if isinstance(value, list) else value
