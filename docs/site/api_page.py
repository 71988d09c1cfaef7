"""The reference of the Python names: which there are is read from the package, what they are from their docstrings."""

from __future__ import annotations

import inspect

import teleop_sim

NAMES_HEAD = """# Python

`import teleop_sim` is cheap: each name is loaded when it is first used.

```python
from pathlib import Path
import teleop_sim

scenario = teleop_sim.load_scenario("src-dish", {"link.up.rate_bps": 64.0, "autonomy": "high"})
result = teleop_sim.run_scenario(scenario, seed=1, out=Path("runs"))
print(result.outcome, result.completion_time_s)
```
"""

RECORDS_HEAD = """# Records

Whatever happens in a run is one of these. The log derives its schemas from them, reports read nothing else, and
[The log](../log.md) has the same as tables of fields with topics and units.
"""

GROUPS = {
    "Runs": ("load_scenario", "run_scenario", "RunResult", "Memo"),
    "Logs": ("load", "Log", "Logs"),
    "Sweeps": ("plan_sweep", "run_sweep", "load_sweep", "load_sweep_states", "load_sweep_times"),
    "Errors": ("TeleopError", "BadInput", "Problem"),
}
"""The order of the page. With dots: what a public name gives, and is none itself. An error without a group joins the
others, any other name comes under *More*."""

CONTRACTS = {
    "An operator's policy": ("teleop_sim.operators.policies.Policy", "teleop_sim.operators.belief.Belief"),
    "A robot": ("teleop_sim.robot.spec.RobotSpec", "teleop_sim.world.robot_model.RobotModel"),
    "A task": (
        "teleop_sim.scenarios.tasks.Task",
        "teleop_sim.scenarios.tasks.Site",
        "teleop_sim.world.scoring.Score",
        "teleop_sim.world.plant.Scenery",
    ),
    "A machine": (
        "teleop_sim.machines.declare.Machine",
        "teleop_sim.machines.elements.State",
        "teleop_sim.machines.elements.Edge",
        "teleop_sim.machines.elements.Row",
        "teleop_sim.machines.elements.Counter",
    ),
    "A message": (
        "teleop_sim.channel.message.Message",
        "teleop_sim.channel.messages.encode_message",
        "teleop_sim.channel.messages.decode_message",
    ),
}
"""What whoever extends the simulator writes: by heading."""


def public_names() -> list[str]:
    """All public names but the version."""
    return [name for name in teleop_sim.__all__ if not name.startswith("_")]


def names_markdown() -> str:
    """The page of the public names and of what extensions are made of."""
    grouped = {name for group in GROUPS.values() for name in group}
    left = [name for name in public_names() if name not in grouped]
    groups = {**GROUPS, "Errors": (*GROUPS["Errors"], *filter(_is_error, left))}
    groups["More"] = tuple(name for name in left if not _is_error(name))
    parts = [NAMES_HEAD]
    for title, group in groups.items():
        parts += [f"## {title}", *(_entry(_path(name)) for name in group)] if group else []
    parts.append("## What extensions are made of\n\nThe [how-tos](../howto/policy.md) use them.")
    for title, paths in CONTRACTS.items():
        parts += [f"### {title}", *(_entry(path, level=4) for path in paths)]
    return "\n\n".join(parts) + "\n"


def records_markdown() -> str:
    """The page of the records."""
    options = "    options:\n      show_root_heading: false\n      heading_level: 2\n"
    return f"{RECORDS_HEAD}\n::: teleop_sim.core.records\n{options}"


def _path(name: str) -> str:
    return name if "." in name else f"{getattr(teleop_sim, name).__module__}.{name}"


def _is_error(name: str) -> bool:
    value = getattr(teleop_sim, name)
    return inspect.isclass(value) and issubclass(value, BaseException)


def _entry(path: str, level: int = 3) -> str:
    return f"::: {path}\n    options:\n      heading_level: {level}"
