"""What a sweep costs: 5 uplinks x 5 latencies x 4 levels x 50 replicates of src-dish, and how two workers share it.

``python benchmarks/sweep.py [replicates] [replicates for the comparisons]``. Wall times; machines are noisy: compare
only figures of one call. The directory of the sweep is removed at the end.
"""

from __future__ import annotations

import resource
import statistics
import sys
import tempfile
import time
from pathlib import Path

from teleop_sim.robot.warm_up import main as warm_up
from teleop_sim.sweep.index import load_sweep
from teleop_sim.sweep.plan import Plan
from teleop_sim.sweep.planning import plan_sweep
from teleop_sim.sweep.study import SweepProgress, run_sweep
from teleop_sim.sweep.workers import Here, Processes

AXES = {
    "--uplink": "64bps,200bps,380bps,1kbps,4kbps",
    "--latency": "0s,2s,5s,10s,20s",
    "--autonomy": "off,low,high,full",
}


def timed(plan: Plan, folder: Path, workers: int) -> tuple[SweepProgress, float]:
    """A sweep with worker processes, and its wall time [s]."""
    started_s = time.monotonic()
    at = run_sweep(plan, folder, Processes(workers))
    return at, time.monotonic() - started_s


def whole(replicates: int, folder: Path) -> None:
    """The whole sweep with two workers."""
    plan = plan_sweep("src-dish", AXES, runs=replicates)
    at, wall_s = timed(plan, folder, 2)
    index = load_sweep(folder)
    computed_s, remembered_ms = at.computed_s / max(at.computed, 1), 1e3 * at.remembered_s / max(at.remembered, 1)
    print(f"{at.done} runs in {wall_s:.0f} s with 2 workers, {at.done / wall_s:.1f} runs/s; {at.bad} not completed")
    print(f"  {at.computed} runs computed physics, {computed_s:.2f} s each (CPU)")
    print(f"  {at.remembered} runs remembered all of it, {remembered_ms:.1f} ms each (CPU)")
    print(f"  memo: {at.found} of {at.found + at.made} episodes found ({at.found / max(at.found + at.made, 1):.1%})")
    print(f"  logs: {index['log_bytes'].mean() / 1e3:.0f} kB a run, {index['log_bytes'].sum() / 1e9:.2f} GB in all")
    journals = sum(path.stat().st_size for path in folder.glob("journal/*"))
    parquet = (folder / "index.parquet").stat().st_size
    print(f"  index: {parquet / len(index):.0f} bytes a run, journals {journals / len(index):.0f}")
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"  memory: {peak:.0f} MiB at most in a worker")


def efficiency(replicates: int, folder: Path) -> None:
    """One worker against two, three times in turn."""
    ratios = []
    for n in range(3):
        plan = plan_sweep("src-dish", AXES, runs=replicates, seed=100 + n, detail="full")
        one_s = timed(plan, folder / f"one{n}", 1)[1]
        two_s = timed(plan, folder / f"two{n}", 2)[1]
        ratios.append(one_s / two_s / 2)
        print(f"  1 worker {one_s:.1f} s, 2 workers {two_s:.1f} s: efficiency {ratios[-1]:.2f}")
    print(f"efficiency of 2 workers: {statistics.median(ratios):.2f}, starting them included")


def memo(folder: Path) -> None:
    """One replicate with and without the memo, a fifth of the cells."""
    plan = plan_sweep("src-dish", AXES | {"--uplink": "380bps"}, runs=1, seed=7)
    spent_s = []
    for wanted in (True, False):
        started_s = time.thread_time()
        run_sweep(plan, folder / f"memo {wanted}", Here(), memo=wanted)
        spent_s.append(time.thread_time() - started_s)
    with_s, without_s = spent_s
    faster = without_s / with_s
    print(f"memo: {len(plan.cells)} cells of a replicate {with_s:.1f} s, without {without_s:.1f} s: {faster:.1f} times")


def main() -> None:
    """Print all of it."""
    replicates = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    compared = int(sys.argv[2]) if len(sys.argv) > 2 else 10
    warm_up()
    with tempfile.TemporaryDirectory() as folder:
        memo(Path(folder))
        efficiency(compared, Path(folder))
        whole(replicates, Path(folder) / "whole")


if __name__ == "__main__":
    main()
