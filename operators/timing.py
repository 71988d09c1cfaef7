"""How long a person takes: sums of cited elements, a lognormal spread, a floor.

Every figure is in ``timing.toml`` with its source and status.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, fields
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

from teleop_sim.core.errors import BadInput, Problem


@dataclass(frozen=True)
class OperatorTiming:
    """Mean times of one person's elements of work, and how they vary.

    Attributes:
        look_s, search_s, read_per_word_s, think_s, verify_s, recall_s, mental_s, keystroke_s: elements [s].
        floor_s: no act is shorter [s].
        spread: standard deviation over mean of every act, zero or more.
        answer_keys: keystrokes to confirm, reject or repeat.
        patience_s: waited beyond the announced round trip before the first repeat [s].
        patience_growth: factor from one wait to the next, above one.
        screen_lines: unread lines and pictures kept.
        expertise: factor on every time but the floor; 1 is the sources' average person, less is faster.

    Not modelled: fatigue, learning, workload slowing the person down.

    Raises:
        BadInput: a time that is not above zero, a negative spread, a growth of one or less; all of them at once.

    """

    look_s: float
    search_s: float
    read_per_word_s: float
    think_s: float
    verify_s: float
    recall_s: float
    mental_s: float
    keystroke_s: float
    floor_s: float
    spread: float
    answer_keys: int
    patience_s: float
    patience_growth: float
    screen_lines: int
    expertise: float

    def __post_init__(self) -> None:
        least = {"spread": 0.0, "patience_growth": 1.0}
        problems = tuple(
            Problem(f"operator timing: {f.name}", f"{value} cannot be used", _demand(f.name))
            for f in fields(self)
            for value in (getattr(self, f.name),)
            if not (math.isfinite(value) and (value > least.get(f.name, 0.0) or (f.name == "spread" and value == 0.0)))
        )
        if problems:
            raise BadInput(problems)

    def read_line_s(self, words: int) -> float:
        """Look at a line and read it."""
        return self.look_s + words * self.read_per_word_s

    def read_image_s(self) -> float:
        """Look at a picture and search it once."""
        return self.look_s + self.search_s

    def judge_s(self, words: int) -> float:
        """Decide on a suggested transition: read what is asked, think, verify."""
        return self.read_line_s(words) + self.think_s + self.verify_s

    def plan_s(self, words: int) -> float:
        """Decide how to help by hand: read what is asked, recall what can be done, think."""
        return self.read_line_s(words) + self.recall_s + self.think_s

    def press_s(self) -> float:
        """Press the keys of an answer."""
        return self.answer_keys * self.keystroke_s

    def type_s(self, command: str) -> float:
        """Type one command: prepare, a key a character and Enter, verify."""
        return self.mental_s + (len(command) + 1) * self.keystroke_s + self.verify_s

    def repeat_s(self) -> float:
        """Notice that nothing happened and send the last command again."""
        return self.look_s + self.verify_s + self.press_s()

    def sample_s(self, mean_s: float, rng: np.random.Generator) -> float:
        """One time with mean ``mean_s * expertise`` and the spread, at least the floor. Draws exactly once.

        The floor lifts the mean by less than 1e-6 of it for any act above 1 s at the spread of ``timing.toml``.
        """
        factor = lognormal_factor(float(rng.standard_normal()), self.spread)
        return max(self.floor_s, mean_s * self.expertise * factor)


def _demand(name: str) -> str:
    if name == "spread":
        return "Give zero or more."
    return "Give more than one." if name == "patience_growth" else "Give a number above zero."


def lognormal_factor(z: float, spread: float) -> float:
    """A lognormal factor with mean 1 and standard deviation ``spread`` from a standard normal ``z``.

    Source: moments of the lognormal: with s^2 = ln(1 + spread^2), exp(s z - s^2/2) has mean 1 and variance spread^2.
    """
    variance = math.log1p(spread * spread)
    return math.exp(math.sqrt(variance) * z - variance / 2.0)


def load_timing(**changes: float) -> OperatorTiming:
    """The times of ``timing.toml``, with fields replaced by ``changes``, such as ``expertise=0.7``.

    Raises:
        BadInput: a field is out of its range.

    """
    return OperatorTiming(**(_cited() | changes))


@cache
def _cited() -> dict[str, Any]:
    text = resources.files("teleop_sim.operators").joinpath("timing.toml").read_text(encoding="utf-8")
    return {name: entry["value"] for name, entry in tomllib.loads(text).items()}


def words_in(text: str) -> int:
    """Words a person reads in a line: runs of letters or digits; underscores, slashes and signs separate.

    ``/DETECTED_PANEL_FINE`` has three.
    """
    return len("".join(c if c.isalnum() or c == "." else " " for c in text).split())
