"""How long a whole run takes on one core: ``make bench`` or ``python benchmarks/whole_run.py [seeds]``.

Each run is a fresh process pinned to one core, so the figure includes starting Python and importing everything.
Machines are noisy: quote the median, and compare only figures of one call.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

SEEDS = 7
BOUND_S = 5.0


def one(seed: int, folder: str) -> dict[str, float]:
    """Run src-dish at full autonomy in a process of its own; times in seconds."""
    command = [sys.executable, "-m", "teleop_sim", "run", "src-dish", "--seed", str(seed), "--out", folder, "--json"]
    core = min(os.sched_getaffinity(0))
    started_s = time.perf_counter()
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, preexec_fn=lambda: os.sched_setaffinity(0, {core})
    )
    whole_s = time.perf_counter() - started_s
    if done.returncode not in (0, 1):
        sys.exit(done.stderr)
    told = json.loads(done.stdout)
    return {
        "seed": seed,
        "simulated_s": told["completion_time_s"] or float("nan"),
        "process_s": whole_s,
        "run_s": told["wall_s"],
        "mujoco_s": told["physics_s"],
    }


def main() -> None:
    """Print a row a seed and the medians."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS
    print("  seed  simulated s  whole process s  run s  in MuJoCo s  share in MuJoCo  times real time")
    with tempfile.TemporaryDirectory() as folder:
        rows = [one(seed, folder) for seed in range(1, count + 1)]
    for r in rows:
        share, factor = r["mujoco_s"] / r["process_s"], r["simulated_s"] / r["process_s"]
        print(
            f"{r['seed']:6.0f} {r['simulated_s']:12.1f} {r['process_s']:16.2f} {r['run_s']:6.2f} {r['mujoco_s']:12.2f}"
            f" {share:16.0%} {factor:16.0f}"
        )
    median_s, worst_s = statistics.median(r["process_s"] for r in rows), max(r["process_s"] for r in rows)
    print(f"whole process: median {median_s:.2f} s, worst {worst_s:.2f} s; bound {BOUND_S:.0f} s on one core")


if __name__ == "__main__":
    main()
