"""A decision map of a made-up table, to show how one reads: the example of ``docs/statistics.md``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from teleop_sim.reports.decision import decision_figure
from teleop_sim.reports.parts import Chart
from teleop_sim.stats.decision import decision_map
from teleop_sim.stats.runs import Measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LIMIT_S = 1100.0


def chart() -> Chart:
    """The figure."""
    return Chart(_figure, "Best level by delay: off without delay, not sure at 2 s, full from 5 s on")


def _figure() -> Figure:
    import pandas as pd

    rng, rows = np.random.default_rng(1), []
    for replicate in range(40):
        work_s, falls = 300.0 * np.exp(0.2 * rng.standard_normal()), rng.random() < 0.25
        for delay_s in (0.0, 2.0, 5.0, 10.0):
            rows.append((replicate, delay_s, "off", "completed", work_s + 60.0 * delay_s, 4.0, LIMIT_S))
            fate = ("failed", work_s, 1.0) if falls else ("completed", work_s, 4.0)
            rows.append((replicate, delay_s, "full", *fate, LIMIT_S))
    columns = ["replicate", "latency_s", "autonomy", "status", "time_s", "score", "limit_s"]
    measure = Measure("time", limit_s=LIMIT_S)
    found = decision_map(pd.DataFrame(rows, columns=columns), ["latency_s"], "autonomy", measure, seed=1)
    return decision_figure(found, ["latency_s"], "autonomy", measure)
