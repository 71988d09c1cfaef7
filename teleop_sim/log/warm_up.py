"""Compile the loops that read logs once: ``python -m teleop_sim.log.warm_up``. Numba keeps the result on disk."""

from __future__ import annotations

import math
from pathlib import Path
from tempfile import TemporaryDirectory

from teleop_sim.core.records import PlantNames, PlantSample, RunEnded, RunStarted, TransitionTaken
from teleop_sim.log.load import open_log
from teleop_sim.log.meanings import EVERY_FRAME
from teleop_sim.log.writer import LogWriter


def main() -> None:
    """Write a log of a moment, and make every table of it."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "moment.mcap"
        with LogWriter(path, durable=False) as write:
            write(RunStarted(0.0, "moment", "", 1, 0, 1.0, ""))
            write(PlantNames(0.0, "knee"))
            write(PlantSample(0.0, (0.0,) * 7, (0.5,)))
            write(TransitionTaken(0.5, "a", "go", "b", 0.0, "autonomous", "normal", 0, 0, 3, 0.0, "a note"))
            write(RunEnded(1.0, "failed", "none", math.nan, 0, 0))
        log = open_log(path)
        for name in EVERY_FRAME:
            getattr(log, name)


if __name__ == "__main__":
    main()
