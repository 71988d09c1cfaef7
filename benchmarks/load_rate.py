"""How fast logs are read into DataFrames: ``make bench`` or ``python benchmarks/load_rate.py``.

Two figures, from ``teleop_sim.load`` until every frame is built; the median of some rounds in one process, after one
that loads what numba has compiled:

- one big log: the records of a real run again and again, times shifted, to a million messages and more;
- a directory of some hundred logs of real runs (``--logs DIR``; left out: copies of the runs that this makes).

``--run LOG`` takes another run for the big log. Exit code 1 if the big log is read at less than a million messages/s.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from dataclasses import fields, replace
from pathlib import Path
from shutil import copyfile

import teleop_sim
from teleop_sim.core.records import Record, RunEnded, RunStarted
from teleop_sim.log.load import Log
from teleop_sim.log.many import Logs, load_many
from teleop_sim.log.meanings import EVERY_FRAME
from teleop_sim.log.writer import LogWriter

MESSAGES = 1_000_000
BOUND_PER_S = 1e6
ROUNDS = 7
COPIES = 100
SCENARIOS = ("src-dish", "drc-door-day2", "src-dish-rough")
TIMES = frozenset({"start_s", "entered_s", "sent_s", "service_s", "arrived_s", "delivered_s"})


def repeated(log: Log, path: Path, count: int) -> int:
    """A log of a run's records again and again; return how many there are."""
    records = [r for r in log.records() if not isinstance(r, RunStarted | RunEnded)]
    started, ended = next(log.records("run/started")), next(log.records("run/ended"))
    n = 0
    with LogWriter(path) as write:
        write(started)
        while n < count:
            shift_s = n / len(records) * log.end_s
            for record in records:
                write(shifted(record, shift_s))
            n += len(records)
        write(replace(ended, t_s=n / len(records) * log.end_s))
    return n + 2


def shifted(record: Record, by_s: float) -> Record:
    """A record at another time."""
    names = [f.name for f in fields(record) if f.name == "t_s" or f.name in TIMES]
    return replace(record, **{name: getattr(record, name) + by_s for name in names})


def every_frame(log: Log | Logs) -> int:
    """Build all frames; return the rows."""
    assert len(log.joints) == len(log.plant)
    return sum(len(getattr(log, name)) for name in EVERY_FRAME if name != "joints")


def timed(path: Path, rounds: int) -> float:
    """Seconds from ``load`` to all frames, median."""
    taken = []
    for _ in range(rounds + 1):
        began_s = time.perf_counter()
        every_frame(load_many(path) if path.is_dir() else teleop_sim.load(path))
        taken.append(time.perf_counter() - began_s)
    return statistics.median(taken[1:])


def made(name: str, folder: Path) -> Path:
    """A real run's log."""
    return teleop_sim.run_scenario(teleop_sim.load_scenario(name), 1, folder).log


def main() -> None:
    """Print both figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", type=Path, help="log of a run, to repeat")
    parser.add_argument("--logs", type=Path, help="directory of logs")
    parser.add_argument("--messages", type=int, default=MESSAGES)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        runs = [] if asked.run and asked.logs else [made(name, Path(folder) / "real") for name in SCENARIOS]
        big = Path(folder) / "big.mcap"
        count = repeated(teleop_sim.load(asked.run or runs[0]), big, asked.messages)
        took_s = timed(big, asked.rounds)
        rate = count / took_s
        print(f"one log: {count:,} messages, {big.stat().st_size / 1e6:.0f} MB: {took_s:.2f} s, {rate / 1e6:.2f} M/s")
        if not asked.logs:
            for number in range(COPIES):
                for run in runs:
                    copyfile(run, Path(folder) / "real" / f"{number:03}_{run.name}")
        folder_of_logs = asked.logs or Path(folder) / "real"
        logs = load_many(folder_of_logs)
        took_s, rows = timed(folder_of_logs, asked.rounds), every_frame(logs)
        told = f"{len(logs)} logs, {rows:,} rows"
        print(f"{told}: {took_s:.2f} s, {rows / took_s / 1e6:.2f} M/s, {len(logs) / took_s:.0f} logs/s")
    sys.exit(rate < BOUND_PER_S)


if __name__ == "__main__":
    main()
