"""The laws of ``tests/laws.py`` on a study of runs drawn over everything that a scenario offers, extremes included."""

import math
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import teleop_sim
from teleop_sim.run import run_scenario

RUNS = 40


def drawn(seed: int) -> dict[str, object]:
    """Overrides of ``src-dish``: link, crew, time and world, each within what is allowed."""
    rng = np.random.default_rng(seed)
    found: dict[str, object] = {
        "autonomy": str(rng.choice(["off", "low", "high", "full"])),
        "pacing": str(rng.choice(["wpi", "eager"])),
        "operator.expertise": float(rng.uniform(0.3, 3.0)),
        "time_limit_s": round(float(rng.uniform(20.0, 1800.0)), 2),
        "world.layout": int(rng.integers(1, 6)),
        "link.up.rate_bps": float(np.exp(rng.uniform(*np.log((64.0, 4e3))))),
        "link.down.rate_bps": float(np.exp(rng.uniform(*np.log((50.0, 380e3))))),
    }
    for way in ("up", "down"):
        found[f"link.{way}.delay_s"] = float(rng.choice([0.0, rng.uniform(0.0, 30.0)]))
        found[f"link.{way}.header_bytes"] = int(rng.choice([0, 40]))
        found[f"link.{way}.blackouts"] = blackouts(rng)
    return found | extremes(rng)


def blackouts(rng: np.random.Generator) -> list[list[float]]:
    """None, or up to ten, some of which touch; now and then the last one does not end.

    Then it has been light for ten seconds: at 50 bit/s a packet of 41 bytes needs seven, and less would be refused.
    """
    windows: list[list[float]] = []
    end_s = 0.0
    for _ in range(int(rng.integers(0, 11)) * int(rng.integers(0, 2))):
        start_s = end_s + float(rng.choice([0.0, rng.exponential(60.0)]))
        end_s = start_s + 0.01 + float(rng.exponential(40.0))
        windows.append([start_s, end_s])
    if windows and rng.random() < 0.1 and windows[-1][0] - sum(b - a for a, b in windows[:-1]) > 10.0:
        windows[-1][1] = math.inf
    return windows


def extremes(rng: np.random.Generator) -> dict[str, object]:
    """Worlds at and beyond the edge of what the robot can do; each is drawn one time in four."""
    ranges = {
        "world.floor_friction": rng.uniform(0.05, 0.3),
        "world.contact_friction": rng.uniform(0.1, 0.6),
        "world.wheel_friction_nm": rng.uniform(3.0, 8.0),
        "world.yaw_target_rad": rng.choice([2.2, -1.65, 0.0]),
        "world.pitch_target_rad": rng.choice([1.25, -0.2, 0.0]),
    }
    chosen = {key: [float(value)] * 2 for key, value in ranges.items() if rng.random() < 0.25}
    spread = {"world.wheel_start_spread_rad": math.pi} if rng.random() < 0.25 else {}
    return chosen | spread


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1000, 1000 + RUNS))
def test_whatever_is_run_keeps_every_law(seed: int, laws: ModuleType, tmp_path: Path) -> None:
    result = run_scenario(teleop_sim.load_scenario("src-dish", drawn(seed)), seed, tmp_path)
    assert laws.broken_laws(teleop_sim.load(result.log).records()) == []
    if result.outcome == "failed":
        assert result.cause.startswith(("fell: ", "ended by the operator in STATE_ERROR after "))
