"""Table 2 of the ViGIR paper, from many seeds of each of its seven rows, and of the other DRC scenarios.

``python benchmarks/table2.py --seeds 20 --workers 2 --csv runs.csv``; ``--from runs.csv`` prints the table of a study
that was run before; ``--only drc-door`` takes the scenarios whose names begin so. Exits with 1 if a check fails.
``--picture fig17.svg`` draws one run a row as the paper's Fig. 17 does (the first seed). ``--set KEY=VALUE`` changes
the scenarios, to ask what a row rests on.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from teleop_sim.core.records import Record
from teleop_sim.reports.drc_table import DrcRun, checks, drc_markdown, drc_rows, gaps, read_runs, runs_csv
from teleop_sim.reports.drc_times import drc_times, paper_rows
from teleop_sim.reports.timeline_layers import draw_layers
from teleop_sim.run import simulate
from teleop_sim.scenarios.files import load_scenario
from teleop_sim.scenarios.library import list_scenarios
from teleop_sim.scenarios.setting import read_setting

Done = tuple[DrcRun, list[Record]]


def one(scenario: str, changes: dict[str, object], seed: int, keep: bool) -> Done:
    """One run in a worker; its records only where they are to be drawn."""
    done = simulate(load_scenario(scenario, changes), seed, 0, lambda _: None)
    run = DrcRun(scenario, seed, done.ended.outcome, done.ended.cause, drc_times(done.records))
    return run, done.records if keep else []


def study(names: list[str], changes: dict[str, object], seeds: range, workers: int, picture: bool) -> Iterator[Done]:
    """All runs, as they are done."""
    with ProcessPoolExecutor(workers) as pool:
        # Seed by seed, so that a study cut short has some of every row.
        cells = [(name, seed) for seed in seeds for name in names]
        for future in as_completed(
            [pool.submit(one, name, changes, seed, picture and seed == seeds[0]) for name, seed in cells]
        ):
            yield future.result()


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20, help="how many of each scenario")
    parser.add_argument("--first", type=int, default=1, help="the first of them")
    parser.add_argument("--set", dest="settings", action="append", default=[], help="KEY=VALUE of the scenarios")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--only", default="drc-", help="scenarios whose names begin so")
    parser.add_argument("--csv", type=Path, help="file for one line a run, rewritten after each")
    parser.add_argument("--from", dest="given", type=Path, help="such a file: print its table, run nothing")
    parser.add_argument("--picture", type=Path, help="file for a figure like the paper's Fig. 17: .svg or .png")
    return parser.parse_args()


def main() -> None:
    """Run the study, or read it, and print it."""
    told = arguments()
    names = [name for name in _all() if name.startswith(told.only)]
    runs = [] if told.given is None else read_runs(told.given.read_text(encoding="utf-8"))
    kept: dict[str, list[Record]] = {}
    seeds = range(told.first, told.first + told.seeds)
    changes = dict(read_setting(text) for text in told.settings)
    for run, records in () if told.given else study(names, changes, seeds, told.workers, told.picture is not None):
        runs = sorted([*runs, run], key=lambda r: (r.scenario, r.seed))
        print(f"{run.scenario} seed {run.seed}: {run.outcome} {run.cause} {run.times.overall_s:.0f} s", file=sys.stderr)
        kept |= {run.scenario: records} if records else {}
        if told.csv is not None:
            told.csv.write_text(runs_csv(runs), encoding="utf-8")
    if told.picture is not None and kept:
        draw_layers([kept[name] for name in names if name in kept], told.picture)
    if not runs:
        sys.exit("no runs")
    rows = drc_rows(runs)
    print(drc_markdown(rows))
    print("\n".join(f"- {line}" for line in gaps(rows)), end="\n\n")
    found = checks(rows)
    for check in found:
        print(f"{'holds ' if check.holds else 'FAILS '} {check.what}: {check.measured}; wanted {check.wanted}")
    sys.exit(0 if all(check.holds for check in found) else 1)


def _all() -> list[str]:
    """The paper's rows, then the other DRC scenarios."""
    there = list_scenarios()
    missing = [name for name in paper_rows() if name not in there]
    if missing:
        print(f"no such scenario, left out: {', '.join(missing)}", file=sys.stderr)
    others = [name for name in there if name.startswith("drc-") and name not in paper_rows()]
    return [*(name for name in paper_rows() if name in there), *others]


if __name__ == "__main__":
    main()
