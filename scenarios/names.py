"""The names a scenario may use, each with what it stands for.

A new robot or task is one line here and its own file; error messages, shell completion and the JSON Schema follow.
Policies register themselves in ``teleop_sim.operators.policies``.
"""

from __future__ import annotations

from collections.abc import Mapping

ROBOTS: Mapping[str, str] = {
    "valkyrie": "NASA Valkyrie R5, as in the Space Robotics Challenge",
}

TASKS: Mapping[str, str] = {
    "src-dish": "Space Robotics Challenge task 1: align the communication dish with two crank wheels",
}

PACINGS: Mapping[str, str] = {
    "wpi": "with the fixed waits, polling and sensor sweeps of WPI's program",
    "eager": "without them: each step starts as soon as the one before is done",
}

AUTONOMY: Mapping[str, int] = {"off": 0, "low": 1, "high": 2, "full": 3}
"""Level of the guard: an outcome passes by itself if its threshold is below the level."""

WORLDS = (1, 2, 3, 4, 5)
"""The five final worlds of the Space Robotics Challenge, the same for every team."""
