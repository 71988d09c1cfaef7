"""Policies by name."""

from __future__ import annotations

from collections.abc import Callable

from teleop_sim.operators.adaptive import Adaptive
from teleop_sim.operators.collaborate import Collaborate
from teleop_sim.operators.policies import Policy, Supervise, Verify
from teleop_sim.operators.step_down import StepDown

POLICIES: dict[str, Callable[[], Policy]] = {
    "adaptive": Adaptive,
    "collaborate": Collaborate,
    "step_down": StepDown,
    "supervise": Supervise,
    "verify": Verify,
}
"""Name in a scenario to policy."""
