"""teleop-sim: a discrete-event simulator of low-bandwidth, high-latency teleoperation.

The public names are loaded when they are first used, so that ``import teleop_sim`` stays cheap and
no layer drags in another (docs/architecture.md).
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from teleop_sim.core.errors import BadInput, LogDamaged, Problem, TeleopError, UnknownName
    from teleop_sim.log.load import Log, load
    from teleop_sim.run import RunResult, run_scenario
    from teleop_sim.scenarios.files import load_scenario

_HOME = {
    "BadInput": "teleop_sim.core.errors",
    "Log": "teleop_sim.log.load",
    "LogDamaged": "teleop_sim.core.errors",
    "Problem": "teleop_sim.core.errors",
    "RunResult": "teleop_sim.run",
    "TeleopError": "teleop_sim.core.errors",
    "UnknownName": "teleop_sim.core.errors",
    "load": "teleop_sim.log.load",
    "load_scenario": "teleop_sim.scenarios.files",
    "run_scenario": "teleop_sim.run",
}

__all__ = [
    "BadInput",
    "Log",
    "LogDamaged",
    "Problem",
    "RunResult",
    "TeleopError",
    "UnknownName",
    "__version__",
    "load",
    "load_scenario",
    "run_scenario",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        # Costs 30 ms, which every call of --help would pay.
        from importlib import metadata

        return metadata.version("teleop-sim")
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'teleop_sim' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
