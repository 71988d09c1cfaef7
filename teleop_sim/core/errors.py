"""The errors that reach a user.

::

    TeleopError
    ├── BadInput (ValueError)      a file, an option or an argument is wrong; lists every problem
    │   └── UnknownName            something is not registered
    ├── LogDamaged (ValueError)    a log cannot be read at all
    ├── BadMessage (ValueError)    bytes or text that are no message          (channel/codec.py)
    ├── BadSnapshot (ValueError)   bytes that are no state of a machine       (machines/sync.py)
    ├── BadPatch (ValueError)      a change that a machine cannot take        (machines/modify.py)
    ├── CannotDraw (RuntimeError)  no OpenGL or no display here               (world/drawing.py)
    └── LinkClosed (RuntimeError)  something was sent after the run's end     (channel/link.py)

Every field is in ``args``: SimPy rebuilds a failed event's exception as ``type(e)(*e.args)`` and so does pickle.
What goes wrong *inside* a run (a fall, a lost grip, a missed deadline) is an outcome, never an exception.
"""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches


class TeleopError(Exception):
    """Base of all errors that teleop-sim raises on purpose."""


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong.

    Attributes:
        where: place, as ``file:line:column: key`` or an option's name.
        what: what came and why it cannot be used.
        hint: what would do.

    """

    where: str
    what: str
    hint: str = ""

    def __str__(self) -> str:
        return f"{self.where}: {self.what}" + (f"\n  {self.hint}" if self.hint else "")


class BadInput(TeleopError, ValueError):
    """Input that was refused before anything ran, with every problem found in it."""

    def __init__(self, problems: tuple[Problem, ...]) -> None:
        super().__init__(problems)

    @property
    def problems(self) -> tuple[Problem, ...]:
        """All problems, in the order of the input."""
        found: tuple[Problem, ...] = self.args[0]
        return found

    def __str__(self) -> str:
        return "\n".join(str(p) for p in self.problems)


class UnknownName(BadInput):
    """A file or a caller named something that is not registered."""

    def __init__(self, where: str, name: str, choices: tuple[str, ...]) -> None:
        super().__init__((unknown_name(where, name, choices),))
        self.args = (where, name, choices)

    @property
    def problems(self) -> tuple[Problem, ...]:
        """The one problem."""
        return (unknown_name(*self.args),)


class LogDamaged(TeleopError, ValueError):
    """A file that is no log, or is damaged where no record can be saved.

    A log that was merely cut off is not damaged: it reads up to the cut.
    """

    def __init__(self, path: str, why: str) -> None:
        super().__init__(path, why)

    def __str__(self) -> str:
        return f"{self.args[0]}: {self.args[1]}"


def unknown_name(where: str, name: str, choices: tuple[str, ...]) -> Problem:
    """Say that ``name`` is not among ``choices`` and which one was probably meant."""
    close = get_close_matches(name, choices, n=1)
    guess = f"Did you mean {close[0]!r}? " if close else ""
    return Problem(where, f"unknown name {name!r}", f"{guess}Known: {', '.join(choices)}.")
