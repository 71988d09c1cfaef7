"""What the episode memo spares: one replicate, eight links, four levels of autonomy.

``python benchmarks/memo.py [seed] [cells to check]``. Times are thread CPU time on one core. Some cells are run again
without the memo: their logs must have the same bytes. Machines are noisy: compare only figures of one call.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from pathlib import Path

from teleop_sim import load_scenario
from teleop_sim.log.load import load
from teleop_sim.log.writer import LogWriter
from teleop_sim.robot.memo import Memo
from teleop_sim.robot.warm_up import main as warm_up
from teleop_sim.run import RunResult, run_scenario

LEVELS = ("off", "low", "high", "full")
LINKS: dict[str, dict[str, object]] = {
    "no delay": {},
    "1.3 s": {"link.up.delay_s": 1.3, "link.down.delay_s": 1.3},
    "5 s": {"link.up.delay_s": 5.0, "link.down.delay_s": 5.0},
    "10 s": {"link.up.delay_s": 10.0, "link.down.delay_s": 10.0},
    "64 bit/s up": {"link.up.rate_bps": 64.0},
    "4 kbit/s down": {"link.down.rate_bps": 4000.0},
    "loss": {"link.up.loss": {"model": "bernoulli", "p": 0.2}},
    "dark at times": {"link.up.blackouts": [[30.0, 60.0], [120.0, 150.0]]},
}


def run(level: str, link: str, seed: int, folder: Path, memo: Memo | None) -> tuple[RunResult, float]:
    """One run, and its thread CPU time [s]."""
    scenario = load_scenario("src-dish", {"autonomy": level} | LINKS[link])
    started_s = time.thread_time()
    result = run_scenario(scenario, seed, folder, memo=memo)
    return result, time.thread_time() - started_s


def writing_s(log: Path, folder: Path) -> float:
    """Thread CPU time [s] of writing a log's records once more: no part of what a memo could spare."""
    records = list(load(log).records())
    started_s = time.thread_time()
    with LogWriter(folder / "again.mcap") as writer:
        for record in records:
            writer.write(record)
    return time.thread_time() - started_s


def main() -> None:
    """Print a row a cell and the sums; fail if a byte differs."""
    seed = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    checked = int(sys.argv[2]) if len(sys.argv) > 2 else 4
    warm_up()
    with tempfile.TemporaryDirectory() as folder:
        report(seed, checked, Path(folder))


def report(seed: int, checked: int, folder: Path) -> None:
    """Run all cells, ``checked`` of them without the memo too."""
    cells = [(link, level) for link in LINKS for level in LEVELS]
    # An odd stride meets every level.
    again = {(1 + 7 * k) % len(cells) for k in range(checked)}
    memo = Memo()
    physical_s, found_s, log_s, fresh_s = [], [], [], []
    print("link           level  outcome    simulated s  episodes made  found   CPU ms  without memo")
    for k, (link, level) in enumerate(cells):
        before = memo.tally()
        result, spent_s = run(level, link, seed, folder / "memo", memo)
        made = memo.tally().episodes_made - before.episodes_made
        found = memo.tally().episodes_found - before.episodes_found
        (physical_s if made else found_s).append(spent_s)
        log_s.append(writing_s(result.log, folder))
        print(
            f"{link:14} {level:5}  {result.outcome:10} {result.completion_time_s:10.1f} {made:14d} {found:6d}"
            f" {spent_s * 1e3:8.0f}",
            end="",
        )
        if k in again:
            other, other_s = run(level, link, seed, folder / "fresh", None)
            fresh_s.append(other_s)
            if other.log.read_bytes() != result.log.read_bytes():
                sys.exit(f"\n{link}, {level}: the memo changed the log")
            print(f" {other_s * 1e3:8.0f} ms, same bytes", end="")
        print()
    print(memo.tally())
    summary(physical_s, found_s, log_s, fresh_s)


def summary(physical_s: list[float], found_s: list[float], log_s: list[float], fresh_s: list[float]) -> None:
    """Print what it comes to."""
    cells, all_s = len(log_s), sum(physical_s) + sum(found_s)
    print(f"{len(physical_s)} of {cells} runs computed an episode, {len(found_s)} found all of theirs")
    if found_s:
        run_s, write_s = statistics.median(found_s), statistics.median(log_s)
        print(f"a run that finds all: median {run_s * 1e3:.0f} ms, of which writing the log {write_s * 1e3:.0f} ms")
    if fresh_s:
        each_s = statistics.median(fresh_s)
        print(f"a run without memo: median {each_s * 1e3:.0f} ms")
        print(f"{cells} cells: {all_s:.1f} s, {each_s * cells / all_s:.1f} times as fast as without memo")


if __name__ == "__main__":
    main()
