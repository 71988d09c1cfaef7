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
    from teleop_sim.log.many import Logs
    from teleop_sim.robot.memo import Memo
    from teleop_sim.run import RunResult, run_scenario
    from teleop_sim.scenarios.files import load_scenario
    from teleop_sim.sweep.folder import SweepBroken
    from teleop_sim.sweep.index import load_sweep, load_sweep_states, load_sweep_times
    from teleop_sim.sweep.planning import plan_sweep
    from teleop_sim.sweep.study import run_sweep

_HOME = {
    "BadInput": "teleop_sim.core.errors",
    "Log": "teleop_sim.log.load",
    "LogDamaged": "teleop_sim.core.errors",
    "Logs": "teleop_sim.log.many",
    "Memo": "teleop_sim.robot.memo",
    "Problem": "teleop_sim.core.errors",
    "RunResult": "teleop_sim.run",
    "TeleopError": "teleop_sim.core.errors",
    "UnknownName": "teleop_sim.core.errors",
    "load": "teleop_sim.log.load",
    "SweepBroken": "teleop_sim.sweep.folder",
    "load_scenario": "teleop_sim.scenarios.files",
    "load_sweep": "teleop_sim.sweep.index",
    "load_sweep_states": "teleop_sim.sweep.index",
    "load_sweep_times": "teleop_sim.sweep.index",
    "plan_sweep": "teleop_sim.sweep.planning",
    "run_scenario": "teleop_sim.run",
    "run_sweep": "teleop_sim.sweep.study",
}

__all__ = [
    "BadInput",
    "Log",
    "LogDamaged",
    "Logs",
    "Memo",
    "Problem",
    "RunResult",
    "SweepBroken",
    "TeleopError",
    "UnknownName",
    "__version__",
    "load",
    "load_scenario",
    "load_sweep",
    "load_sweep_states",
    "load_sweep_times",
    "plan_sweep",
    "run_scenario",
    "run_sweep",
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
