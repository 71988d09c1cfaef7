"""TOML text of a machine's plain tables, one way only: equal tables give equal text."""

from __future__ import annotations

import math
import re
from typing import cast

from teleop_sim.machines.plain_table import Plain

_BARE = re.compile(r"[A-Za-z0-9_-]+\Z")
_ESCAPES = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r", "\b": "\\b", "\f": "\\f"}


def toml_text(machine: Plain) -> str:
    """Own keys first, edges one a line, then the states as ``[[states]]`` and ``[[states.states]]``."""
    return "\n".join(_container(machine, "states")) + "\n"


def _container(table: Plain, header: str) -> list[str]:
    lines = [f"{_key(key)} = {_value(value)}" for key, value in table.items() if key not in ("edges", "states")]
    if "states" not in table:
        return lines
    edges = cast(list[object], table["edges"])
    lines += ["edges = [", *(f"    {_value(edge)}," for edge in edges), "]"] if edges else ["edges = []"]
    for state in cast(list[Plain], table["states"]):
        lines += ["", f"[[{header}]]", *_container(state, f"{header}.states")]
    return lines


def _value(value: object) -> str:
    if isinstance(value, str):
        return f'"{"".join(map(_character, value))}"'
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{_key(key)} = {_value(inner)}' for key, inner in value.items())} }}" if value else "{}"
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, float) and math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return repr(value)


def _key(key: str) -> str:
    return key if _BARE.match(key) else _value(key)


def _character(character: str) -> str:
    if character in _ESCAPES:
        return _ESCAPES[character]
    control = ord(character) < 0x20 or ord(character) == 0x7F
    return f"\\u{ord(character):04x}" if control else character
