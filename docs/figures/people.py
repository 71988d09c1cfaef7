"""Waits for one busy person: the crew's own times in an M/G/1 queue against Pollaczek and Khinchine's formula."""

from __future__ import annotations

from math import log1p
from typing import TYPE_CHECKING

import numpy as np

from teleop_sim.operators.timing import load_timing
from teleop_sim.reports.parts import Chart

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WORDS, REQUESTS = 3, 200_000


def services_s(seed: int) -> np.ndarray:
    """Times of deciding and pressing, as the crew draws them (``operators/timing.py``) [s]."""
    timing, rng = load_timing(), np.random.default_rng(seed)
    s2 = log1p(timing.spread**2)
    means_s = (timing.judge_s(WORDS), timing.press_s())
    parts = [mean_s * np.exp(np.sqrt(s2) * rng.standard_normal(REQUESTS) - s2 / 2.0) for mean_s in means_s]
    return sum((np.maximum(timing.floor_s, part) for part in parts), start=np.zeros(REQUESTS))


def mean_wait_s(served_s: np.ndarray, load: float, seed: int) -> float:
    """Of requests that come at random times; D. V. Lindley (1952) as a running sum above its running minimum [s]."""
    gaps_s = np.random.default_rng(seed).exponential(served_s.mean() / load, len(served_s))
    walk_s = np.concatenate([[0.0], np.cumsum(served_s[:-1] - gaps_s[1:])])
    return float((walk_s - np.minimum.accumulate(walk_s)).mean())


def closed_form_s(served_s: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Pollaczek and Khinchine: load / (1 - load) times half of E[S²] / E[S] [s]."""
    return load / (1.0 - load) * (served_s**2).mean() / (2.0 * served_s.mean())


def chart() -> Chart:
    """The figure."""
    return Chart(_figure, "Mean wait of a request over the person's load: closed form and simulated agree")


def _figure() -> Figure:
    from matplotlib.figure import Figure

    served_s, load = services_s(1), np.linspace(0.02, 0.86, 200)
    figure = Figure(figsize=(5.2, 2.6), layout="constrained")
    axes = figure.subplots()
    axes.plot(load, closed_form_s(served_s, load), label="Pollaczek and Khinchine")
    loads = np.arange(0.1, 0.9, 0.1)
    waits_s = [mean_wait_s(served_s, float(x), seed) for seed, x in enumerate(loads, start=2)]
    axes.plot(loads, waits_s, "o", markersize=4, label="the crew's times, simulated")
    axes.set(xlabel="share of time a person is busy", ylabel="mean wait [s]", xlim=(0, 0.9), ylim=(0, None))
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    return figure
