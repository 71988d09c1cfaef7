"""Figures of a real run: the door's behaviour in the laboratory, as its report draws it."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import teleop_sim
from teleop_sim.reports.parts import Chart, Timeline
from teleop_sim.reports.registry import RUN_PARTS
from teleop_sim.reports.run_view import Run

SCENARIO, SEED = "drc-door-lab-behaviour", 1
WANTED = {"timeline": "run_timeline", "waterfall": "run_waterfall", "layers": "run_layers"}
"""Part of a run's report to the figure's name."""


def charts() -> dict[str, Chart]:
    """The figures by name."""
    with TemporaryDirectory() as folder:
        result = teleop_sim.run_scenario(teleop_sim.load_scenario(SCENARIO), SEED, Path(folder))
        run = Run(teleop_sim.load(result.log))
        contents = {WANTED[part.name]: part.make(run) for part in RUN_PARTS if part.name in WANTED}
    found = {name: content.still if isinstance(content, Timeline) else content for name, content in contents.items()}
    return {name: content for name, content in found.items() if isinstance(content, Chart)}
