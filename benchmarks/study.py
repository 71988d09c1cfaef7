"""Many seeds of one scenario: outcomes, completion times, per-state means beside the paper's.

``python benchmarks/study.py --seeds 1:21 --workers 2 --autonomy full --set link.up.delay_s=10.0``. A study for
validation, not the sweep that users will get: no resuming, no intervals but the simplest.
"""

from __future__ import annotations

import argparse
import math
import statistics
import tempfile
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

from rich.console import Console

from teleop_sim import load, load_scenario
from teleop_sim.core.records import PlantSample
from teleop_sim.reports.table import state_table
from teleop_sim.reports.terminal import rich_table
from teleop_sim.run import RunResult, run_scenario


def one(seed: int, overrides: dict[str, object], scenario: str, folder: str) -> RunResult:
    """One run in a worker."""
    return run_scenario(load_scenario(scenario, overrides), seed, Path(folder))


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenario", default="src-dish")
    parser.add_argument("--seeds", default="1:21", help="first:last+1")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--autonomy", default="full")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=NUMBER", help="override of the scenario")
    parser.add_argument("--keep", default="", help="folder for the logs")
    return parser.parse_args()


def value(text: str) -> object:
    """A number or a range such as 0.1:0.2, else the text."""
    parts = text.split(":")
    try:
        numbers = tuple(float(part) for part in parts)
    except ValueError:
        return text
    return numbers[0] if len(numbers) == 1 else numbers


def main() -> None:
    """Run the study and print it."""
    told = arguments()
    first, last = (int(x) for x in told.seeds.split(":"))
    overrides: dict[str, object] = {"autonomy": told.autonomy}
    overrides |= {key: value(text) for key, text in (item.split("=") for item in told.set)}
    with tempfile.TemporaryDirectory() as spare, ProcessPoolExecutor(told.workers) as pool:
        work = partial(one, overrides=overrides, scenario=told.scenario, folder=told.keep or spare)
        results = list(pool.map(work, range(first, last)))
        runs = [[r for r in load(x.log).records() if not isinstance(r, PlantSample)] for x in results]
    done = [r.completion_time_s for r in results if r.outcome == "completed"]
    n = len(results)
    share = len(done) / n
    # Wilson's interval for a share (J. Am. Stat. Assoc. 22 (1927), 209-212).
    z = 1.96
    middle = (share + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * math.sqrt(share * (1 - share) / n + z * z / (4 * n * n))
    console = Console(width=120)
    console.print(rich_table(state_table(runs)))
    print(f"completed {len(done)} of {n}: {share:.1%}, 95 % interval {middle - half:.1%} to {middle + half:.1%}")
    if len(done) > 1:
        mean, sd = statistics.fmean(done), statistics.stdev(done)
        print(
            f"completion time of those: mean {mean:.1f} s (95 % +- {1.96 * sd / math.sqrt(len(done)):.1f} s), "
            f"sd {sd:.1f} s, {min(done):.1f} to {max(done):.1f} s; the paper's rows sum to 285.4 s"
        )
    print(f"round trips: mean {statistics.fmean(r.round_trips for r in results):.2f}")
    print(f"wall time a run: median {statistics.median(r.wall_s for r in results):.2f} s")
    for cause, count in Counter(f"{r.outcome}: {r.cause}" for r in results if r.outcome != "completed").most_common():
        print(f"{count:4d}  {cause}")


if __name__ == "__main__":
    main()
