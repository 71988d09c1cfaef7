"""Sweeps that run: whoever computes, with or without the memo, killed or not, the results are the same."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from teleop_sim.log.load import load
from teleop_sim.stats.decision import decision_map
from teleop_sim.stats.runs import Measure
from teleop_sim.sweep.cluster import Cluster
from teleop_sim.sweep.folder import SweepFolder
from teleop_sim.sweep.index import load_sweep
from teleop_sim.sweep.plan import Plan
from teleop_sim.sweep.planning import plan_sweep
from teleop_sim.sweep.study import run_sweep
from teleop_sim.sweep.workers import Here, Processes

AXES = {"--uplink": "64bps,4kbps", "--autonomy": "off,full"}


def short(runs: int = 2, **given: str) -> Plan:
    """Half a minute of the dish task: a walk and a look, and requests that cross the link."""
    return plan_sweep("src-dish", AXES, ["time_limit_s=30.0"], runs=runs, **given)


@pytest.fixture(scope="module")
def swept(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("swept")
    run_sweep(short(), path, Here())
    return path


def logs(path: Path) -> dict[str, bytes]:
    return {
        log.relative_to(path).as_posix(): log.read_bytes() for log in sorted(path.glob("runs/**/*")) if log.is_file()
    }


@pytest.mark.parametrize(
    ("crew", "memo"),
    [(Here(), False), (Processes(1), True), (Processes(2), True), (Cluster("local", 2), True)],
    ids=["no memo", "one process", "two processes", "dask"],
)
def test_results_do_not_depend_on_who_computed_them(swept: Path, tmp_path: Path, crew, memo: bool):
    at = run_sweep(short(), tmp_path, crew, memo=memo)
    assert (at.done, at.lost) == (8, [])
    pd.testing.assert_frame_equal(load_sweep(tmp_path), load_sweep(swept), check_exact=True)
    assert logs(tmp_path) == logs(swept)


def test_the_index_agrees_with_the_logs(swept: Path):
    index = load_sweep(swept)
    assert list(zip(index["cell"], index["replicate"], strict=True)) == [(c, r) for c in range(4) for r in range(2)]
    for row in index.to_dict("records"):
        log = load(swept / row["log"])
        run = log.runs.iloc[0]
        assert (run["outcome"], run["replicate"], run["seed"]) == (row["outcome"], row["replicate"], 1)
        assert row["time_s"] == run["end_s"]
        assert row["log_bytes"] == (swept / row["log"]).stat().st_size
        up = log.packets.query("direction == 'up'")
        assert row["up_packets"] == len(up)
        assert row["up_bits"] == up.query("outcome == 'delivered'")["size_bits"].sum()
        spent = [row[name] for name in ("robot_s", "pacing_s", "link_s", "operator_s", "other_s")]
        assert np.isclose(sum(spent), row["time_s"], rtol=0, atol=1e-9)  # float sums of some hundred parts
        assert np.isclose(row["normal_s"] + row["auto_s"] + row["manual_s"], row["time_s"], rtol=0, atol=1e-9)


def test_cells_of_a_replicate_share_their_world_and_their_physics(tmp_path: Path):
    # At level full nobody is asked, so the link changes nothing that the robot does.
    plan = plan_sweep("src-dish", {"--uplink": "64bps,1kbps,4kbps"}, ["time_limit_s=30.0"], runs=2)
    at = run_sweep(plan, tmp_path, Here())
    assert (at.computed, at.remembered) == (2, 4)
    assert at.found == 2 * at.made


def test_what_is_finished_is_not_run_again(swept: Path, tmp_path: Path):
    plan = short()
    run_sweep(plan, tmp_path, Here())
    folder = SweepFolder(tmp_path)
    # As a kill between two runs of replicate 1 leaves it.
    lines = folder.journal(1).read_bytes().splitlines(keepends=True)
    folder.journal(1).write_bytes(b"".join(lines[:2]) + lines[2][:40])
    folder.index.unlink()
    assert len(load_sweep(tmp_path)) == 6
    at = run_sweep(plan, tmp_path, Here())
    assert (at.resumed, at.computed + at.remembered) == (6, 2)
    pd.testing.assert_frame_equal(load_sweep(tmp_path), load_sweep(swept), check_exact=True)


def test_a_log_that_is_gone_or_short_is_made_again(swept: Path, tmp_path: Path):
    run_sweep(short(), tmp_path, Here())
    folder = SweepFolder(tmp_path)
    folder.log(0, 1).unlink()
    folder.log(3, 0).write_bytes(folder.log(3, 0).read_bytes()[:1000])
    at = run_sweep(short(), tmp_path, Here())
    assert at.computed + at.remembered == 2
    assert logs(tmp_path) == logs(swept)
    pd.testing.assert_frame_equal(load_sweep(tmp_path), load_sweep(swept), check_exact=True)


@pytest.mark.parametrize("detail", ["events", "summary"])
def test_less_detail_changes_no_figure(swept: Path, tmp_path: Path, detail: str):
    run_sweep(short(detail=detail), tmp_path, Here())
    ours = ["log", "log_bytes", "log_digest"]
    pd.testing.assert_frame_equal(load_sweep(tmp_path).drop(columns=ours), load_sweep(swept).drop(columns=ours))
    if detail == "events":
        log = load(tmp_path / load_sweep(tmp_path)["log"][0])
        assert not list(log.records("field/plant"))
        assert list(log.records("link/packet"))
    else:
        assert not (tmp_path / "runs").exists()


def test_a_link_that_nothing_can_cross_is_a_refused_run_not_a_crash(tmp_path: Path):
    # One light of some 7 s: whether a packet of 5 s gets out is known when it is drawn.
    dark = ["dark.mean_light_s=7.0", "dark.mean_dark_s=86400.0", "on_dark=restart", "rate_bps=64bps"]
    settings = ["time_limit_s=20.0", *(f"link.up.{key}" for key in dark)]
    plan = plan_sweep("src-dish", {}, settings, runs=6, seed=0)
    at = run_sweep(plan, tmp_path, Here())
    assert at.done == 6
    index = load_sweep(tmp_path)
    refused = index[index["outcome"] == "refused"]
    assert len(refused)
    assert set(refused["status"]) == {"failed"}
    assert refused["cause"].str.contains("light").all()
    assert set(refused["log"]) == {""}


def test_a_cell_stops_when_its_interval_is_narrow(tmp_path: Path):
    # In 5 s nobody scores, so the interval of the score is a point at the first look.
    given = {"until": "ci=5%", "measure": "score"}
    plan = plan_sweep("src-dish", {"--uplink": "64bps,4kbps"}, ["time_limit_s=5.0"], runs=40, **given)
    at = run_sweep(plan, tmp_path, Here())
    assert at.done == 2 * plan.until.rule.minimum
    assert at.runs == at.done


def test_a_decision_map_comes_straight_from_the_index(swept: Path):
    found = decision_map(load_sweep(swept), ["uplink_bps"], "autonomy", Measure("time", 30.0))
    assert list(found["uplink_bps"]) == [64.0, 4000.0]
