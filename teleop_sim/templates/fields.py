"""Reading tables of numbers and names, writing down everything that is wrong with them."""

from __future__ import annotations

import math
from typing import Any

from teleop_sim.core.errors import Problem, unknown_name
from teleop_sim.templates.poses import Triple


class Fields:
    """One table of a file. What is wrong becomes a problem, and a stand-in value lets reading go on.

    Args:
        table: as TOML gave it.
        where: its place, for messages.
        problems: grows.

    """

    def __init__(self, table: dict[str, Any], where: str, problems: list[Problem]) -> None:
        self.where, self.problems = where, problems
        self._table, self._read = table, set[str]()

    def wrong(self, key: str, what: str, hint: str) -> None:
        """Write down a problem of a key."""
        self.problems.append(Problem(f"{self.where}: {key}", what, hint))

    def done(self) -> None:
        """Nothing more is read: whatever else is there is a mistake."""
        for key in self._table:
            if key not in self._read:
                problem = unknown_name(f"{self.where}: {key}", key, tuple(sorted(self._read)))
                self.problems.append(problem)

    def tables(self, key: str) -> tuple[Fields, ...]:
        """An array of tables; none if it is not there."""
        self._read.add(key)
        found = self._table.get(key, [])
        if not isinstance(found, list) or not all(isinstance(t, dict) for t in found):
            self.wrong(key, "no array of tables", "write one [[table]] or { } an entry")
            return ()
        return tuple(Fields(t, f"{self.where}: {_label(key, i, t)}", self.problems) for i, t in enumerate(found))

    def text(self, key: str, empty: bool = False) -> str:
        """A name."""
        found = self._get(key)
        if not isinstance(found, str) or not (found or empty):
            self._bad(key, found, "give some text")
            return ""
        return found

    def choice(self, key: str, names: tuple[str, ...]) -> str:
        """One of some names; the first in place of another."""
        found = self.text(key)
        if found and found not in names:
            self.problems.append(unknown_name(f"{self.where}: {key}", found, names))
        return found if found in names else names[0]

    def flag(self, key: str, default: bool) -> bool:
        """Yes or no."""
        found = self._get(key, default)
        if not isinstance(found, bool):
            self._bad(key, found, "give true or false")
            return default
        return found

    def whole(self, key: str, most: int = 65535) -> int:
        """A whole number from 0 on."""
        found = self._get(key)
        if not isinstance(found, int) or isinstance(found, bool) or not 0 <= found <= most:
            self._bad(key, found, f"give a whole number from 0 to {most}")
            return 0
        return found

    def number(self, key: str, least: float = -math.inf, above: float = -math.inf) -> float:
        """A finite number."""
        found = self._get(key)
        if not _is_number(found) or not (found >= least and found > above):
            bound = f" above {above:g}" if above > -math.inf else f" of at least {least:g}" if least > -math.inf else ""
            self._bad(key, found, f"give a number{bound}")
            return 1.0
        return float(found)

    def row(self, key: str, count: int, default: tuple[float, ...] | None = None) -> tuple[float, ...]:
        """So many finite numbers."""
        found = self._get(key, default)
        if not isinstance(found, (list, tuple)) or len(found) != count or not all(_is_number(v) for v in found):
            self._bad(key, found, f"give {count} numbers")
            return (0.0,) * count
        return tuple(float(v) for v in found)

    def triple(self, key: str, default: Triple | None = None, instead: Triple = (0.0, 0.0, 0.0)) -> Triple:
        """Three finite numbers; ``instead`` in place of something else."""
        before = len(self.problems)
        x, y, z = self.row(key, 3, default)
        return (x, y, z) if len(self.problems) == before else instead

    def _get(self, key: str, default: Any = None) -> Any:
        self._read.add(key)
        return self._table.get(key, default)

    def _bad(self, key: str, found: Any, hint: str) -> None:
        self.wrong(key, "missing" if found is None else f"{found!r}", hint)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _label(key: str, place: int, table: dict[str, Any]) -> str:
    name = table.get("name", table.get("id", place))
    return f"{key} {name}"
