"""The reference of frames and topics, made from the record classes: ``python -m teleop_sim.log.document``."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

from teleop_sim.core.records import RECORDS, Record
from teleop_sim.log.load import Log
from teleop_sim.log.meanings import EVERY_FRAME, unit
from teleop_sim.log.schema import KINDS, field_types
from teleop_sim.log.store import Messages

STORED = {"float": "double", "int": "int64", "bool": "bool", "str": "string", "tuple": "repeated double"}


def frames_markdown() -> str:
    """One section a frame: what a row is, and its columns with dtype, unit and meaning."""
    log = Log(Path("empty"), True, Messages((), (), ()))
    return "\n".join(_frame_section(name, log) for name in EVERY_FRAME)


def _frame_section(name: str, log: Log) -> str:
    rows = [f"| {' | '.join(row)} |" for row in log.columns(name).itertuples(index=False, name=None)]
    if name in ("plant", "joints"):
        rows.append("| each joint by its name | float64 | rad or m | joint of the model |")
    doc = " ".join((inspect.getdoc(getattr(type(log), name)) or "").split())
    head = ["| Column | Dtype | Unit | Meaning |", "|---|---|---|---|"]
    return "\n".join([f"### `{name}`", "", doc, "", *head, *rows, ""])


def topics_markdown() -> str:
    """One section a topic, in the order of the file: what it says, and its fields with type and unit."""
    return "\n".join(_section(topic, cls) for topic, cls in sorted(RECORDS.items()))


def _section(topic: str, cls: type[Record]) -> str:
    rows = [f"| {n} | {name} | {_stored(hint)} | {unit(name)} |" for n, (name, hint) in _numbered(cls)]
    head = ["| No. | Field | Type | Unit |", "|---:|---|---|---|"]
    return "\n".join([f"## `{topic}`: `{cls.__name__}`", "", inspect.getdoc(cls) or "", "", *head, *rows, ""])


def _numbered(cls: type[Record]) -> enumerate[tuple[str, Any]]:
    return enumerate(field_types(cls).items(), start=1)


def _stored(hint: Any) -> str:
    return STORED["tuple" if KINDS[hint].repeated else hint.__name__]


if __name__ == "__main__":
    print(f"<!-- frames -->\n\n{frames_markdown()}\n<!-- topics -->\n\n{topics_markdown()}")
