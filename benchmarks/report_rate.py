"""How long reports take: the page of a run, the page of a sweep of 5,000 runs, and its index as a DataFrame.

``make bench`` or ``python benchmarks/report_rate.py [directory of a sweep]``. The sweep's runs are drawn from those of
a small sweep that is run first, so that it has the real columns, causes and states at a minute's cost; a directory
given is reported on as it is. Commands are timed as a user waits for them, imports included, best of three. What is
held to a bound is CPU time, user and system: on a machine with a core to spare it is what passes on the wall, which
stands beside it; on a busy one the wall says how busy. Exits with 1 above a bound.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from teleop_sim.run import run_scenario
from teleop_sim.scenarios.files import load_scenario
from teleop_sim.sweep.folder import SweepFolder, append
from teleop_sim.sweep.index import frame, load_sweep, write_index
from teleop_sim.sweep.planning import plan_sweep
from teleop_sim.sweep.study import run_sweep
from teleop_sim.sweep.workers import Here

COMMAND = str(Path(sys.executable).with_name("teleop-sim"))
ROUNDS = 3
RUN_S, SWEEP_S, INDEX_S = 4.0, 20.0, 1.0
RUN_BYTES, SWEEP_BYTES = 3_000_000, 6_000_000
AXES = {
    "--uplink": "64bps,200bps,380bps,1kbps,4kbps",
    "--latency": "0s,2s,5s,10s,20s",
    "--autonomy": "off,low,high,full",
}
REPLICATES, TAKEN = 50, 2


Times = tuple[float, float]
"""CPU time and wall time [s]."""


def best(do: Callable[[], object], who: int = resource.RUSAGE_CHILDREN) -> Times:
    """The least CPU time of some rounds, and the least wall time."""
    times = []
    for _ in range(ROUNDS):
        before, started_s = resource.getrusage(who), time.monotonic()
        do()
        after, ended_s = resource.getrusage(who), time.monotonic()
        spent_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        times.append((spent_s, ended_s - started_s))
    return min(cpu for cpu, _ in times), min(wall for _, wall in times)


def command(*arguments: str) -> Callable[[], object]:
    """A command line, to be called."""
    return lambda: subprocess.run([COMMAND, *arguments], check=True, capture_output=True)


def large_sweep(folder: Path) -> Path:
    """A finished sweep of 5,000 runs; every replicate is one of the few that were run, its times a little longer."""
    small, large = folder / "small", SweepFolder(folder / "sweep")
    run_sweep(plan_sweep("src-dish", AXES, runs=TAKEN, detail="summary"), small, Here())
    plan = plan_sweep("src-dish", AXES, runs=REPLICATES, detail="summary")
    large.create(plan)
    for replicate in range(REPLICATES):
        with large.journalling(replicate) as journal:
            for row in SweepFolder(small).finished(replicate % TAKEN).values():
                later = 1.0 + 0.002 * replicate
                stretched = {
                    key: value * later for key, value in row.items() if key.endswith("_s") and isinstance(value, float)
                }
                append(journal, {**row, **stretched, "limit_s": row["limit_s"], "replicate": replicate,
                                 "latency_s": row["latency_s"]})  # fmt: skip
    write_index(large, plan, large.rows(plan.replicates))
    return large.path


def main() -> None:
    """Print the times and sizes; exit 1 above a bound."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        log = run_scenario(load_scenario("src-dish", {"autonomy": "low"}), 1, folder).log
        sweep = Path(sys.argv[1]) if len(sys.argv) > 1 else large_sweep(folder)
        out = folder / "out"
        of_run = best(command("report", str(log), "--out", str(out)))
        of_sweep = best(command("report", str(sweep), "--out", str(out)))
        runs = len(load_sweep(sweep))
        of_index = best(lambda: load_sweep(sweep), resource.RUSAGE_SELF)
        kept = SweepFolder(sweep)
        plan, _ = kept.read()
        of_journals = best(lambda: frame(plan, kept.rows(plan.replicates)), resource.RUSAGE_SELF)
        sizes = [(out / f"{path.stem}.html").stat().st_size for path in (log, sweep)]
        rows = [
            ("page of a run", of_run, RUN_S, sizes[0], RUN_BYTES),
            (f"page of a sweep of {runs:,} runs", of_sweep, SWEEP_S, sizes[1], SWEEP_BYTES),
            ("its index", of_index, INDEX_S, 0, 0),
            ("the same from journals alone", of_journals, INDEX_S, 0, 0),
        ]
    for words, (cpu_s, wall_s), bound_s, size, most in rows:
        pages = f"  {size / 1e6:.2f} MB (bound {most / 1e6:.0f})" if size else ""
        print(f"{words:34s} {cpu_s:7.3f} s CPU (bound {bound_s:.0f} s), {wall_s:.3f} s wall{pages}")
    if any(cpu_s > bound_s or size > most for _, (cpu_s, _), bound_s, size, most in rows):
        sys.exit("slower or larger than the bound")


if __name__ == "__main__":
    main()
