"""Sweeps that are killed at random instants, whole process group, and resumed."""

import json
import multiprocessing
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from distributed import Client, LocalCluster

from teleop_sim.log.load import load
from teleop_sim.sweep.cluster import Cluster
from teleop_sim.sweep.folder import SweepFolder
from teleop_sim.sweep.index import load_sweep
from teleop_sim.sweep.planning import plan_sweep
from teleop_sim.sweep.study import run_sweep
from teleop_sim.sweep.workers import Here, Processes

COMMAND = str(Path(sys.executable).with_name("teleop-sim"))
OPTIONS = ["--uplink", "64bps,4kbps", "--autonomy", "off,full", "--set", "time_limit_s=60.0"]


def start(*arguments: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [COMMAND, "sweep", *arguments], start_new_session=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )


def killed(sweep: subprocess.Popen[bytes], after_s: float) -> bool:
    """Kill the whole group after so long; false: it was done before."""
    try:
        sweep.wait(timeout=after_s)
    except subprocess.TimeoutExpired:
        os.killpg(sweep.pid, signal.SIGKILL)
        sweep.communicate()
        return True
    finish(sweep)
    return False


def finish(sweep: subprocess.Popen[bytes]) -> None:
    _, said = sweep.communicate(timeout=600)
    assert sweep.returncode == 0, said.decode()


def check_all_listed_are_whole(path: Path) -> int:
    index = load_sweep(path)
    for row in index.to_dict("records"):
        log = load(path / row["log"])
        assert log.whole
        assert not log.interrupted
        assert row["log_bytes"] == (path / row["log"]).stat().st_size
    return len(index)


def disturbed(path: Path, kills: int, runs: int, seed: int) -> None:
    """A sweep that is killed so often, and its undisturbed twin beside it."""
    rng = np.random.default_rng(seed)
    plan = plan_sweep(
        "src-dish", {"--uplink": "64bps,4kbps", "--autonomy": "off,full"}, ["time_limit_s=60.0"], runs=runs
    )
    run_sweep(plan, path / "whole", Here())
    out, done = path / "cut", 0
    sweep = start("src-dish", *OPTIONS, "--runs", str(runs), "--out", str(out), "--workers", "2")
    struck = 0
    while struck < kills:
        # From before the first line is written to the middle of several runs.
        hit = killed(sweep, float(rng.uniform(1.0, 8.0)))
        struck += hit
        if SweepFolder(out).manifest.exists():
            there = check_all_listed_are_whole(out)
            assert there >= done
            done = there
            if not hit:
                # All is done: begin the last replicate anew, so that there is something left to kill.
                SweepFolder(out).journal(runs - 1).unlink()
                done = len(load_sweep(out)) if not SweepFolder(out).index.exists() else done - 4
                SweepFolder(out).index.unlink(missing_ok=True)
            arguments = ["--resume", str(out), "--workers", "2"]
        else:
            arguments = ["src-dish", *OPTIONS, "--runs", str(runs), "--out", str(out), "--workers", "2"]
        sweep = start(*arguments)
    finish(sweep)
    pd.testing.assert_frame_equal(load_sweep(out), load_sweep(path / "whole"), check_exact=True)
    assert SweepFolder(out).index.exists()


def test_a_sweep_killed_again_and_again_ends_as_if_undisturbed(tmp_path: Path):
    disturbed(tmp_path, kills=4, runs=4, seed=1)


@pytest.mark.slow
def test_a_sweep_killed_fifty_times_ends_as_if_undisturbed(tmp_path: Path):
    disturbed(tmp_path, kills=50, runs=12, seed=2)


class KillOne:
    """Watches a sweep and kills the first worker that has finished a run."""

    def __init__(self, workers: list[int] | None = None) -> None:
        self.workers = workers
        self.victim = 0

    def __call__(self, at) -> None:
        if at.done and not self.victim:
            found = self.workers or [child.pid for child in multiprocessing.active_children() if child.pid]
            if found:
                self.victim = found[0]
                os.kill(self.victim, signal.SIGKILL)


def small(runs: int):
    return plan_sweep("src-dish", {"--uplink": "64bps,1kbps,4kbps"}, ["time_limit_s=60.0"], runs=runs)


def test_a_killed_worker_is_replaced_and_its_replicate_run_again(tmp_path: Path):
    run_sweep(small(6), tmp_path / "whole", Here())
    kill = KillOne()
    at = run_sweep(small(6), tmp_path / "cut", Processes(2), watch=kill)
    assert kill.victim
    assert (at.done, at.lost) == (18, [])
    pd.testing.assert_frame_equal(load_sweep(tmp_path / "cut"), load_sweep(tmp_path / "whole"), check_exact=True)


def test_a_dask_worker_may_be_killed_in_the_middle(tmp_path: Path):
    run_sweep(small(6), tmp_path / "whole", Here())
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        kill = KillOne(list(client.run(os.getpid).values()))
        at = run_sweep(small(6), tmp_path / "cut", Cluster(cluster.scheduler_address), watch=kill)
    assert kill.victim
    assert (at.done, at.lost) == (18, [])
    pd.testing.assert_frame_equal(load_sweep(tmp_path / "cut"), load_sweep(tmp_path / "whole"), check_exact=True)


def test_an_interrupted_sweep_says_how_to_go_on_and_does(tmp_path: Path):
    out = tmp_path / "sweep"
    sweep = start("src-dish", *OPTIONS, "--runs", "6", "--out", str(out), "--workers", "1")
    with pytest.raises(subprocess.TimeoutExpired):
        sweep.wait(timeout=6.0)
    os.killpg(sweep.pid, signal.SIGINT)
    _, said = sweep.communicate(timeout=60)
    assert sweep.returncode == 130
    assert f"teleop-sim sweep --resume {out}" in said.decode()
    assert "Traceback" not in said.decode()
    done = subprocess.run([COMMAND, "sweep", "--resume", str(out), "--json"], capture_output=True, check=True)
    assert json.loads(done.stdout)["runs"] == 24
