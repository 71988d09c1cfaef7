"""The reference of the log's topics, made from the record classes: ``python -m teleop_sim.log.document``."""

from __future__ import annotations

import inspect
from typing import Any

from teleop_sim.core.records import RECORDS, Record
from teleop_sim.log.schema import KINDS, field_types

UNITS = {
    "_s": "s",
    "_bps": "bit/s",
    "_bits": "bit",
    "_bytes": "byte",
    "_m": "m",
    "_rad": "rad",
    "_px": "px",
    "_sd": "standard deviations",
}
"""Suffix of a field's name to its unit."""

STORED = {"float": "double", "int": "int64", "bool": "bool", "str": "string", "tuple": "repeated double"}


def topics_markdown() -> str:
    """One section a topic, in the order of the file: what it says, and its fields with type and unit."""
    return "\n".join(_section(topic, cls) for topic, cls in sorted(RECORDS.items()))


def _section(topic: str, cls: type[Record]) -> str:
    rows = [f"| {n} | {name} | {_stored(hint)} | {_unit(name)} |" for n, (name, hint) in _numbered(cls)]
    head = ["| No. | Field | Type | Unit |", "|---:|---|---|---|"]
    return "\n".join([f"## `{topic}`: `{cls.__name__}`", "", inspect.getdoc(cls) or "", "", *head, *rows, ""])


def _numbered(cls: type[Record]) -> enumerate[tuple[str, Any]]:
    return enumerate(field_types(cls).items(), start=1)


def _stored(hint: Any) -> str:
    return STORED["tuple" if KINDS[hint].repeated else hint.__name__]


def _unit(name: str) -> str:
    return next((unit for suffix, unit in UNITS.items() if name.endswith(suffix)), "")


if __name__ == "__main__":
    print(topics_markdown())
