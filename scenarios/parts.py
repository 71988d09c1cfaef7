"""What the tables of a scenario are made of: strict frozen parts, names that must be known, where a number is from."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from pydantic_core import PydanticCustomError

ASSUMED = "assumed"


class Part(BaseModel):
    """A table of a scenario: unknown keys are errors, types are exact, numbers finite unless a key says so."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


def named(kind: str, known: Iterable[str]) -> Any:
    """Metadata of a string that must be one of the names in ``known``."""
    choices = tuple(known)

    def check(value: str | None) -> str | None:
        if value is not None and value not in choices:
            raise unknown(value, choices)
        return value

    return AfterValidator(check), Field(
        description=f"{kind}: {', '.join(choices)}.", json_schema_extra={"enum": list(choices)}
    )


def unknown(name: str, choices: tuple[str, ...]) -> PydanticCustomError:
    """The finding that a name is not among ``choices``."""
    return PydanticCustomError("unknown_name", "unknown name", {"name": name, "choices": choices})


def refused(what: str, hint: str) -> PydanticCustomError:
    """The finding that something cannot be used, in our own words."""
    return PydanticCustomError("refused", "refused", {"what": what, "hint": hint})


def source_of(key: str) -> Callable[[dict[str, Any]], str | None]:
    """Default of a ``*_source``: ``assumed`` where the number at ``key`` is given, else nothing."""

    def source(earlier: dict[str, Any]) -> str | None:
        return None if earlier.get(key) is None else ASSUMED

    return source
