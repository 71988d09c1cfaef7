"""Values that a scenario may leave to chance: one number, or ``[lowest, highest]`` between which the seed draws.

One number is read as a range without width, so that both are written alike. A vector may be given by its length (one
number or a range; its direction is then drawn) or by its three components.
"""

from __future__ import annotations

from typing import Any

from pydantic import AfterValidator, GetCoreSchemaHandler, GetJsonSchemaHandler, Strict, ValidationError
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, InitErrorDetails, core_schema

from teleop_sim.scenarios.parts import refused


class OrOne:
    """Metadata of a list of numbers: one number alone will do, and stands for both."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_wrap_validator_function(_widened, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        many = handler(schema)
        return {"anyOf": [many["prefixItems"][0] if "prefixItems" in many else many["items"], many]}


def _widened(value: Any, read: core_schema.ValidatorFunctionWrapHandler) -> Any:
    if isinstance(value, list | tuple):
        return read(value)
    try:
        return read((value, value))
    except ValidationError as error:
        # Both ends are wrong in the same way, and neither stands in the file.
        first = error.errors()[0]
        context = first.get("ctx", {})
        if first["type"] == "refused":
            raise refused(context["what"], context["hint"]) from None
        told = InitErrorDetails(type=first["type"], loc=(), input=value, ctx=context)
        raise ValidationError.from_exception_data("range", [told]) from None


def low_to_high(value: tuple[Any, Any]) -> tuple[Any, Any]:
    """Refuse a range that runs backwards."""
    if value[0] > value[1]:
        raise refused(f"the range runs backwards from {value[0]} to {value[1]}", "Give [lowest, highest].")
    return value


def _sized(value: tuple[float, ...]) -> tuple[float, ...]:
    if len(value) == 3:
        return value
    if len(value) != 2:
        raise refused(f"{len(value)} numbers are neither a size nor a vector", "Give one number, two or three.")
    low, high = value
    if low < 0:
        raise refused(f"no vector is {low} long", "Give [shortest, longest], or all of [x, y, z].")
    return low_to_high((low, high))


RANGE = Strict(False), AfterValidator(low_to_high), OrOne()
"""Metadata of a pair: lowest and highest, or one number."""

SIZED = Strict(False), AfterValidator(_sized), OrOne()
"""Metadata of a row of numbers: the length of a vector, its shortest and longest, or its three components."""
