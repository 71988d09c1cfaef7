"""How long a message waits for the light at the DRC Finals: closed form, and the link's own model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from teleop_sim.channel.blackouts import first_light
from teleop_sim.channel.dark import DrcFinals
from teleop_sim.reports.parts import Chart

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MODEL = DrcFinals(ends_after_s=np.inf)
UNTIL_S, ARRIVALS = 200_000.0, 20_000


def simulated_s(seed: int) -> np.ndarray:
    """Waits of messages that come at random times, over one long schedule [s]."""
    rng = np.random.default_rng(seed)
    schedule = MODEL.windows(UNTIL_S, rng)
    came_s = rng.uniform(0.0, UNTIL_S - MODEL.off_s[1], ARRIVALS)
    return np.array([first_light(t_s, schedule) - t_s for t_s in came_s])


def waits_longer(wait_s: np.ndarray) -> np.ndarray:
    """Share of messages that wait longer: the residual life of gaps of 1 to 30 s (Cox, Renewal Theory, 1962, 5)."""
    gaps_s = np.arange(MODEL.off_s[0], MODEL.off_s[1] + 1)
    left_s = np.maximum(gaps_s[:, None] - wait_s, 0.0).mean(axis=0)
    return left_s / (MODEL.on_s + gaps_s.mean())


def chart() -> Chart:
    """The figure."""
    return Chart(_figure, "Share of messages that wait longer: closed form and simulated lie on each other")


def _figure() -> Figure:
    from matplotlib.figure import Figure

    waits_s, at_s = simulated_s(1), np.linspace(0.0, 30.0, 301)
    figure = Figure(figsize=(5.2, 2.6), layout="constrained")
    axes = figure.subplots()
    axes.plot(at_s, waits_longer(at_s), label=f"closed form, mean {MODEL.mean_wait_s:.2f} s")
    shown_s = np.arange(0.0, 30.0, 1.5)
    share = [(waits_s > wait_s).mean() for wait_s in shown_s]
    axes.plot(shown_s, share, "o", markersize=4, label=f"simulated, mean {waits_s.mean():.2f} s")
    axes.set(xlabel="wait for the light [s]", ylabel="waits longer", xlim=(0, 30), ylim=(0, 1))
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    return figure
