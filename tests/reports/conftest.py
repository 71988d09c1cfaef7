"""Made-up runs: what a run of src-dish may look like, from a seed and a few switches. No physics, no link model."""

from collections.abc import Callable, Mapping, Sequence
from itertools import product

import numpy as np
import pandas as pd
import pytest

from teleop_sim.core.records import (
    Blackout,
    EpisodeEnded,
    ModeChanged,
    OperatorActed,
    PacketEnded,
    Record,
    Released,
    Requested,
    RunEnded,
    RunStarted,
    Scored,
    TransitionTaken,
    Waited,
)
from teleop_sim.reports.figures import RUN_FIGURES
from teleop_sim.reports.shares import SHARES
from teleop_sim.reports.sweep_view import LEVELS, SweepRuns

NAN = float("nan")
STEPS = (
    ("INIT", "posture"),
    ("DETECT_PANEL_COARSE", "detect"),
    ("WALK_TO_SEE_PANEL", "walk"),
    ("DETECT_HANDLE_CENTER", "look"),
    ("DETECT_PANEL_FINE", "scan"),
    ("WALK_TO_PANEL", "walk"),
    ("FIX_HANDLE_DETECTION", "detect"),
    ("GRASP_PITCH_HANDLE", "reach"),
    ("CORRECT_PITCH", "follow"),
    ("REDETECT_HANDLE", "posture"),
    ("GRASP_PITCH_HANDLE", "grip"),
    ("CORRECT_PITCH", "follow"),
    ("GRASP_YAW_HANDLE", "reach"),
    ("CORRECT_YAW", "follow"),
    ("DETECT_FINISH", "step"),
    ("WALK_TO_FINISH", "walk"),
)


def packet(number, direction, sent_s, delay_s, rate_bps, size_bytes, dropped=False):
    size_bits = 8 * (size_bytes + 40)
    took_s = size_bits / rate_bps
    times = (
        (NAN, NAN, 0.0, 0.0, 0.0, 0.0) if dropped else (sent_s, sent_s + took_s + delay_s, 0.0, 0.0, took_s, delay_s)
    )
    end_s = sent_s + took_s + delay_s
    fate = ("dropped", "blackout") if dropped else ("delivered", "")
    return PacketEnded(end_s, direction, number, "log", size_bytes, size_bits, sent_s, *times, *fate, "")


class Made:
    def __init__(self, seed, stretch, ask, blackouts):
        self.rng, self.stretch, self.ask, self.blackouts = np.random.default_rng(seed), stretch, ask, blackouts
        self.now_s, self.requests, self.sent, self.records = 0.0, 0, 0, []

    def put(self, record):
        self.records.append(record)

    def send(self, direction, at_s, dropped=False):
        self.sent += 1
        size = int(self.rng.integers(5, 60))
        rate = 380.0 if direction == "up" else 50_000.0
        self.put(packet(self.sent, direction, at_s, 10.0, rate, size, dropped))

    def state(self, name, skill, following):
        entered_s, retries = self.now_s, int(self.rng.random() < 0.2)
        for attempt in range(retries + 1):
            start_s = self.now_s
            self.now_s += self.stretch * float(self.rng.uniform(3.0, 15.0))
            self.put(EpisodeEnded(self.now_s, start_s, name, skill, "", "done", "", 0.1))
            self.put(Waited(self.now_s + 2.0, self.now_s, name, "pacing", "poll"))
            self.now_s += 2.0
            for at_s in np.linspace(start_s, self.now_s, 6)[:-1]:
                self.send("down", float(at_s))
            mode = "auto" if attempt else "normal"
            last = attempt == retries
            if self.ask:
                self.question(name)
            self.leave(name, following if last else name, entered_s, mode, min(attempt + 1, retries))

    def leave(self, name, following, entered_s, mode, retries):
        how = "confirmed" if self.ask else "autonomous"
        row = (self.now_s, name, "/EVENT", following, entered_s, how, mode, retries, 1, 3, 0.0, "")
        self.put(TransitionTaken(*row))

    def question(self, name):
        self.requests += 1
        self.put(Requested(self.now_s, self.requests, "confirm", name, "/EVENT", ""))
        self.send("down", self.now_s)
        arrived_s = self.now_s + 10.1
        sent_s = arrived_s + float(self.rng.uniform(2.0, 6.0))
        for kind, a, b in (("read", arrived_s, arrived_s + 1.2), ("decide", arrived_s + 1.2, sent_s)):
            self.put(OperatorActed(b, a, "supervisor", kind, self.requests, ""))
        self.send("up", sent_s, dropped=bool(self.rng.random() < 0.1))
        self.send("up", sent_s + 1.0)
        self.now_s = sent_s + 12.0
        self.put(Released(self.now_s, self.requests, f"confirm {self.requests}", "answered", ""))

    def run(self, ended):
        self.put(RunStarted(0.0, "src-dish", "schema = 1\n", 1, 0, 1800.0, "teleop-sim 0.1.0"))
        names = [f"STATE_{name}" for name, _ in STEPS]
        for i, (name, (_, skill)) in enumerate(zip(names, STEPS, strict=True)):
            self.state(name, skill, [*names, "STATE_END"][i + 1])
            if i in (5, 11, 13):
                self.put(Scored(self.now_s - 1.0, {5: 1, 11: 2, 13: 3}[i], "x"))
        self.put(Scored(self.now_s, 4, "finish"))
        self.put(ModeChanged(self.now_s, "STATE_END", "normal"))
        if self.blackouts:
            for start_s in np.arange(60.0, self.now_s, 140.0):
                for direction in ("up", "down"):
                    self.put(Blackout(float(start_s), direction, True))
                    self.put(Blackout(float(min(start_s + 30.0, self.now_s)), direction, False))
        records = sorted(self.records, key=lambda r: r.t_s)
        if ended:
            records.append(RunEnded(records[-1].t_s, "completed", "", self.now_s, self.requests, 2 * self.requests))
        return records


@pytest.fixture
def make_run() -> Callable[..., list[Record]]:
    def make(seed=1, stretch=1.0, ask=False, blackouts=False, ended=True):
        return Made(seed, stretch, ask, blackouts).run(ended)

    return make


def made_sweep(
    axes: Mapping[str, Sequence[object]],
    replicates: int = 6,
    seed: int = 1,
    fails: float = 0.2,
    censors: float = 0.0,
    design: str = "grid",
    limit_s: float = 1800.0,
    **given: object,
) -> SweepRuns:
    """A sweep of made-up runs: later by 60 s a second of delay, and earlier by 100 s a level of autonomy."""
    rng = np.random.default_rng(seed)
    cells = list(product(*axes.values())) if design == "grid" else list(zip(*axes.values(), strict=True))
    rows = []
    for cell, values in enumerate(cells):
        for replicate in range(replicates):
            setting = dict(zip(axes, values, strict=True))
            status = str(rng.choice(["failed", "censored", "completed"], p=[fails, censors, 1.0 - fails - censors]))
            parts = rng.exponential([150.0, 40.0, 60.0, 50.0, 1.0])
            parts[2] += 60.0 * float(setting.get("latency_s", 0.0))
            parts[3] += 100.0 * LEVELS[::-1].index(setting.get("autonomy", "full"))
            parts *= min(1.0, 0.9 * limit_s / parts.sum())
            if status == "censored":
                parts *= limit_s / parts.sum()
            time_s = float(parts.sum())
            row = {name: 0 if name in WHOLE else 0.0 for name in RUN_FIGURES} | setting
            row |= dict(zip(SHARES, parts.tolist(), strict=True))
            cause = "" if status == "completed" else f"fell at {rng.random():.3f} rad" if replicate % 2 else "left"
            log = f"runs/c{cell:04d}/r{replicate:05d}.mcap"
            row |= {"cell": cell, "replicate": replicate, "status": status, "outcome": status, "cause": cause}
            row |= {"time_s": time_s, "score": int(rng.integers(0, 4)), "limit_s": limit_s, "log": log}
            rows.append(row)
    columns = ["cell", "replicate", *axes, *RUN_FIGURES, "limit_s", "log"]
    plan = {"name": "src-dish", "question": "?", "task": "src-dish", "base": {}, "seed": 1, "detail": "full"}
    plan |= {"design": design, "planned": len(rows), "cells": len(cells), "finished": True, "until": False}
    runs = pd.DataFrame(rows, columns=columns)
    return SweepRuns(**({"runs": runs, "factors": tuple(axes), "where": "runs/s"} | plan | given))


WHOLE = ("score", "round_trips", "requests", "retries", "episodes", "operator_acts")


@pytest.fixture
def make_sweep() -> Callable[..., SweepRuns]:
    return made_sweep
