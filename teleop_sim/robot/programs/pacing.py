"""How a program waits: fixed waits, least times and polling, as data. Presets are in ``pacing.toml``."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import Any

from teleop_sim.core.errors import UnknownName


@dataclass(frozen=True)
class Pacing:
    """Waits of the dish task's programs [s]; what each is and where it comes from stands in ``pacing.toml``.

    ``retry_sleep_s``, ``slow_retries`` (how many retries have that sleep; all if not named) and ``success_sleep_s``
    go by state. ``turning_limit_counts``: a handle that is not home by then is a counted time-out, not a plain retry.
    """

    poll_s: float
    coarse_detections: int
    fine_detections: int
    head_move_s: float
    head_settle_s: float
    tilt_move_s: float
    tilt_wait_s: float
    walk_start_s: float
    finish_start_s: float
    posture_reset_s: float
    side_step_s: float
    grasp_s: float
    hold_s: float
    hold_overlaps: bool
    retreat_s: float
    turn_s: float
    turning_limit_s: float
    turning_limit_counts: bool
    retry_sleep_s: Mapping[str, float]
    slow_retries: Mapping[str, int]
    success_sleep_s: Mapping[str, float]

    def retry_wait_s(self, state: str, tries: int) -> float:
        """Sleep after the ``tries``-th failure in a row of a state, from 1."""
        return self.retry_sleep_s.get(state, 0.0) if tries <= self.slow_retries.get(state, tries) else 0.0


def pacing(name: str) -> Pacing:
    """The preset of that name, ``wpi`` or ``eager``.

    Raises:
        UnknownName: no such preset.

    """
    presets = _presets()
    if name not in presets:
        raise UnknownName("pacing", name, tuple(presets))
    return Pacing(**{key: _frozen(value) for key, value in presets[name].items()})


@cache
def _presets() -> dict[str, Any]:
    return tomllib.loads(files("teleop_sim.robot.programs").joinpath("pacing.toml").read_text(encoding="utf-8"))


def _frozen(value: Any) -> Any:
    return MappingProxyType(value) if isinstance(value, dict) else value


def wait_for_poll_s(spent_s: float, poll_s: float) -> float:
    """Time until a state that has lasted ``spent_s`` is seen to be done, if it looks every ``poll_s`` from its entry.

    Zero if it looks all the time (``poll_s`` 0) or is done exactly when it looks.
    """
    if poll_s <= 0.0:
        return 0.0
    # A billionth of a slice: sums of durations must not miss a look by rounding.
    return max(0.0, math.ceil(spent_s / poll_s - 1e-9) * poll_s - spent_s)
