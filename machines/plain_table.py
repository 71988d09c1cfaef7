"""A table of plain values (TOML's or JSON's) read key by key; every mistake is noted, with its place."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from teleop_sim.core.errors import Problem, unknown_name
from teleop_sim.machines.elements import Given, Value

Plain = dict[str, object]
"""What a TOML table or a JSON object is in Python."""

_MISSING = object()


@dataclass
class Table:
    """One table, while it is read.

    A wrong value is noted in ``problems`` and read as something harmless, so that all mistakes are found at once: what
    was read may be used only if there are no problems.

    Attributes:
        given: what should be a table.
        where: its place, such as ``states[2].rows[0]``; empty for the outermost.
        problems: shared by a table and those in it.

    """

    given: object
    where: str = ""
    problems: list[Problem] = field(default_factory=list)
    _known: dict[str, None] = field(default_factory=dict)
    _values: Plain = field(default_factory=dict)

    def __post_init__(self) -> None:
        if isinstance(self.given, dict) and all(isinstance(key, str) for key in self.given):
            self._values = self.given
        else:
            self._wrong(self.where, self.given, "Give a table.")

    def __contains__(self, key: str) -> bool:
        return key in self._values

    def text(self, key: str, default: str | None = "") -> str:
        """A text; without a default it must be there."""
        value = self._take(key, _MISSING if default is None else default, "a text")
        return value if isinstance(value, str) else self._wrong(self._at(key), value, "Give a text.")

    def choice(self, key: str, choices: tuple[str, ...], default: str | None) -> str:
        """One of some texts; without a default it must be there."""
        value = self._take(key, _MISSING if default is None else default, f"one of {', '.join(choices)}")
        if value not in choices:
            if isinstance(value, str) and value:
                self.problems.append(unknown_name(self._at(key), value, choices))
            elif value != "":
                self._wrong(self._at(key), value, f"Give one of {', '.join(choices)}.")
            return choices[0]
        return str(value)

    def flag(self, key: str, default: bool = False) -> bool:
        """True or false."""
        value = self._take(key, default, "")
        return value if isinstance(value, bool) else bool(self._wrong(self._at(key), value, "Give true or false."))

    def number(self, key: str, least: int = 0, most: int = 2**32 - 1) -> int:
        """A whole number, which must be there."""
        value = self._take(key, _MISSING, "a whole number")
        if isinstance(value, int) and not isinstance(value, bool) and least <= value <= most:
            return value
        if value != "":
            self._wrong(self._at(key), value, f"Give a whole number from {least} to {most}.")
        return least

    def texts(self, key: str) -> tuple[str, ...]:
        """A list of texts."""
        listed = self._list(key)
        for i, value in enumerate(listed):
            if not isinstance(value, str):
                self._wrong(f"{self._at(key)}[{i}]", value, "Give a text.")
        return tuple(str(value) for value in listed)

    def table(self, key: str) -> Table:
        """A table, which must be there."""
        return Table(self._take(key, {}, "a table"), self._at(key), self.problems)

    def tables(self, key: str) -> list[Table]:
        """A list of tables."""
        return [Table(value, f"{self._at(key)}[{i}]", self.problems) for i, value in enumerate(self._list(key))]

    def value(self, key: str) -> Value | Given:
        """What a key or a parameter holds; it must be there."""
        return self._value(self._at(key), self._take(key, _MISSING, "a value"))

    def values(self, key: str) -> tuple[Value | Given, ...]:
        """A list of those."""
        return tuple(self._value(f"{self._at(key)}[{i}]", value) for i, value in enumerate(self._list(key)))

    def names(self, key: str) -> tuple[tuple[str, str], ...]:
        """Pairs of texts: a table, a list of pairs, or texts alone where both of a pair are the same."""
        pairs = []
        for name, value in self._pairs(key):
            if not isinstance(value, str):
                self._wrong(f"{self._at(key)}.{name}", value, "Give a text.")
            pairs.append((name, str(value)))
        return tuple(pairs)

    def holdings(self, key: str) -> tuple[tuple[str, Value | Given], ...]:
        """Pairs of a name and what it holds: a table or a list of pairs."""
        return tuple((name, self._value(f"{self._at(key)}.{name}", value)) for name, value in self._pairs(key))

    def close(self) -> None:
        """Nothing else may be in it."""
        for key in self._values:
            if key not in self._known:
                self.problems.append(unknown_name(self._at(key), key, tuple(self._known)))

    def _at(self, key: str) -> str:
        return f"{self.where}.{key}" if self.where else key

    def _take(self, key: str, default: object, kind: str) -> object:
        self._known[key] = None
        value = self._values.get(key, default)
        if value is _MISSING:
            self.problems.append(Problem(self._at(key), "is missing", f"Give {kind}."))
            return ""
        return value

    def _list(self, key: str) -> list[object]:
        value = self._take(key, [], "a list")
        if isinstance(value, list):
            return value
        self._wrong(self._at(key), value, "Give a list.")
        return []

    def _pairs(self, key: str) -> list[tuple[str, object]]:
        value = self._take(key, {}, "a table")
        if isinstance(value, dict):
            return list(value.items())
        pairs: list[tuple[str, object]] = []
        for i, item in enumerate(self._list(key)):
            if isinstance(item, str):
                pairs.append((item, item))
            elif isinstance(item, list) and len(item) == 2 and isinstance(item[0], str):
                pairs.append((item[0], item[1]))
            else:
                self._wrong(f"{self._at(key)}[{i}]", item, 'Give a name or ["name", value].')
        return pairs

    def _value(self, where: str, value: object) -> Value | Given:
        if isinstance(value, str | int | float):
            return value
        if value == {"none": True}:
            return None
        if isinstance(value, dict) and list(value) == ["given"] and isinstance(value["given"], str):
            return Given(value["given"])
        hint = 'Give a text, a number, true, false, {given = "a parameter"} or {none = true}.'
        return self._wrong(where, value, hint)

    def _wrong(self, where: str, value: object, hint: str) -> Literal[""]:
        shown = repr(value)
        self.problems.append(Problem(where or "all of it", f"{shown[:60]}{'…' * (len(shown) > 60)} does not fit", hint))
        return ""
