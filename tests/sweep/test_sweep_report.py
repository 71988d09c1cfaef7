"""Reports of sweeps that were run: what their directories keep, and what is said of broken ones."""

import json
import shutil
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from teleop_sim.cli_commands import app
from teleop_sim.log.load import load
from teleop_sim.reports.drc_times import COLUMNS as TIMES
from teleop_sim.reports.drc_times import drc_times
from teleop_sim.reports.state_counts import state_counts, table_of_counts
from teleop_sim.reports.sweep_cells import cells
from teleop_sim.reports.sweep_page import verdict
from teleop_sim.reports.sweep_states import states
from teleop_sim.reports.table import state_table, table_of
from teleop_sim.reports.visits import state_rows
from teleop_sim.sweep.folder import SweepBroken, SweepFolder, append
from teleop_sim.sweep.index import load_sweep, load_sweep_states, load_sweep_times
from teleop_sim.sweep.planning import plan_sweep
from teleop_sim.sweep.report import sweep_runs, write_sweep
from teleop_sim.sweep.run_pages import linked_logs, write_pages
from teleop_sim.sweep.study import run_sweep
from teleop_sim.sweep.workers import Here

AXES = {"--latency": "0s,5s", "--autonomy": "off,full"}


def call(*args: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, args, prog_name="teleop-sim")
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture(scope="module")
def swept(tmp_path_factory) -> Path:
    """Two replicates of four cells: whole runs of the dish."""
    path = tmp_path_factory.mktemp("report") / "dish"
    run_sweep(plan_sweep("src-dish", AXES, runs=2, detail="events"), path, Here())
    return path


@pytest.fixture(scope="module")
def door(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("report") / "door"
    plan = plan_sweep("drc-door-lab-behaviour", {"--autonomy": "low,full"}, runs=1, detail="events")
    run_sweep(plan, path, Here())
    return path


@pytest.fixture
def copied(swept: Path, tmp_path: Path) -> SweepFolder:
    shutil.copytree(swept, tmp_path / "dish")
    return SweepFolder(tmp_path / "dish")


def records(path: Path):
    return list(load(path).records())


def test_the_states_of_each_run_are_those_of_its_log(swept: Path):
    kept = load_sweep_states(swept)
    for run in load_sweep(swept).to_dict("records"):
        rows = kept[(kept["cell"] == run["cell"]) & (kept["replicate"] == run["replicate"])]
        ours = rows.groupby("state", sort=False, observed=True)[
            ["visits", "normal", "auto", "manual", "retries", "time_s"]
        ].sum()
        theirs = pd.DataFrame(state_rows(records(swept / run["log"]))).set_index("state")
        assert set(ours.index) == set(theirs.index)
        for name in ours.columns:
            assert ours[name].to_dict() == pytest.approx(theirs[name].to_dict())


def test_table_ii_of_a_sweep_is_that_of_its_logs(swept: Path):
    logs = [records(swept / log) for log in load_sweep(swept)["log"]]
    wanted = state_table(logs)
    for ours in (table_of_counts([state_counts(log) for log in logs]), _table(swept)):
        for row, theirs in zip(ours, wanted, strict=True):
            assert (row.name, row.runs, row.retries, row.normal_pct) == (
                theirs.name,
                theirs.runs,
                theirs.retries,
                theirs.normal_pct,
            )
            assert row.time_s == pytest.approx(theirs.time_s)


def _table(path: Path):
    return table_of(list(sweep_runs(path).entries.values()))


def test_table_2_of_a_sweep_is_that_of_its_logs(door: Path):
    kept = load_sweep_times(door)
    for row, log in zip(kept.to_dict("records"), load_sweep(door)["log"], strict=True):
        times = drc_times(records(door / log))
        assert {name: row[name] for name in TIMES} == pytest.approx(
            {name: getattr(times, name) for name in TIMES}, nan_ok=True
        )
    assert "times" in {part.split(".")[1] for part in map(str, names(write_sweep(door, door / "out", ["csv"])))}


def names(paths: list[Path]) -> list[str]:
    return [path.name for path in paths]


def test_a_dish_has_no_table_2(swept: Path):
    assert load_sweep_times(swept) is None


def test_a_killed_sweep_keeps_its_states_and_reports_what_is_finished(copied: SweepFolder):
    whole, kept = load_sweep(copied.path), load_sweep_states(copied.path)
    lines = copied.journal(1).read_bytes().splitlines(keepends=True)
    copied.journal(1).write_bytes(b"".join(lines[:2]) + lines[2][:50])
    copied.index.unlink()
    # States of a sweep that went on are old: what counts is the journal.
    sweep = sweep_runs(copied.path)
    assert (len(sweep.runs), sweep.finished) == (6, False)
    assert verdict(sweep) == "not finished: 6 of 8 runs so far, 100% completed"
    there = {(row["cell"], row["replicate"]) for row in sweep.runs.to_dict("records")}
    wanted = kept[[pair in there for pair in zip(kept["cell"], kept["replicate"], strict=True)]]
    pd.testing.assert_frame_equal(
        sweep.states.astype({"state": str, "during": str}),
        wanted.astype({"state": str, "during": str}).reset_index(drop=True),
    )
    page = write_sweep(copied.path)[0].read_text(encoding="utf-8")
    assert "teleop-sim sweep --resume" in page
    assert len(whole) == 8


def test_a_sweep_of_an_earlier_version_loads_and_says_what_it_lacks(copied: SweepFolder):
    before = load_sweep(copied.path)
    for replicate in range(2):
        rows = copied.finished(replicate).values()
        copied.journal(replicate).unlink()
        with copied.journalling(replicate) as journal:
            for row in rows:
                append(journal, {key: value for key, value in row.items() if key != "states"})
    copied.states.unlink()
    for index in (True, False):
        if not index:
            copied.index.unlink()
        pd.testing.assert_frame_equal(load_sweep(copied.path), before)
        assert load_sweep_states(copied.path) is None
        sheet = states(sweep_runs(copied.path))
        assert not sheet.rows
        assert "Sweep again" in sheet.note
        assert write_sweep(copied.path)


def test_a_sweep_without_a_finished_run_reports_so(tmp_path: Path):
    SweepFolder(tmp_path / "s").create(plan_sweep("src-dish", AXES, runs=2))
    sweep = sweep_runs(tmp_path / "s")
    assert verdict(sweep) == "no run is finished"
    assert load_sweep_states(tmp_path / "s").empty
    assert write_sweep(tmp_path / "s") == [tmp_path / "s" / "s.html"]


def test_the_same_directory_gives_the_same_bytes(swept: Path, tmp_path: Path):
    formats = ["html", "svg", "csv", "latex", "markdown"]
    one, two = (write_sweep(swept, tmp_path / name, formats) for name in ("a", "b"))
    assert names(one) == names(two)
    assert [path.read_bytes() for path in one] == [path.read_bytes() for path in two]


def test_links_lead_to_logs_from_wherever_the_report_is(swept: Path, tmp_path: Path):
    for out in (swept, tmp_path / "far" / "off"):
        links = cells(sweep_runs(swept, out)).links
        assert len(links) == 12
        assert all((out / address).resolve().is_file() for address in links.values() if out.is_dir())
    assert all(address.startswith("../") for address in links.values())


def test_pages_of_runs_are_written_and_linked(copied: SweepFolder):
    sweep = sweep_runs(copied.path)
    logs = linked_logs(sweep)
    assert len(logs) == len(set(logs)) <= 8
    told: list[tuple[int, int]] = []
    pages = write_pages(copied.path, logs[:1], 1, lambda done, of: told.append((done, of)))
    assert pages == [copied.path / logs[0].replace(".mcap", ".html")]
    assert told == [(1, 1)]
    assert logs[0].replace(".mcap", ".html") in cells(sweep_runs(copied.path)).links.values()


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda f: f.manifest.unlink(), "no sweep"),
        (lambda f: f.manifest.write_text("{"), "does not read"),
        (lambda f: f.manifest.write_text("[]"), "does not read"),
        (lambda f: f.index.write_bytes(b"PAR1"), "does not read"),
        (lambda f: f.states.write_bytes(b""), "does not read"),
        (lambda f: pd.DataFrame({"cell": [0]}).to_parquet(f.index), "has no column"),
    ],
)
def test_broken_directories_are_answered(copied: SweepFolder, spoil, said: str):
    spoil(copied)
    with pytest.raises(SweepBroken, match=said):
        write_sweep(copied.path)
    code, _, told = call("report", str(copied.path))
    assert code == 2
    assert "Traceback" not in told


def test_a_manifest_whose_scenario_does_not_read_is_answered(copied: SweepFolder):
    values = json.loads(copied.manifest.read_text())
    copied.manifest.write_text(json.dumps(values | {"scenario": "seed = ="}))
    with pytest.raises(SweepBroken, match="its scenario does not read"):
        sweep_runs(copied.path)


def test_the_command_writes_a_page_and_files(swept: Path, tmp_path: Path):
    out = tmp_path / "o"
    code, said, _ = call("report", str(swept), "--out", str(out), "--format", "html,csv", "--choose", "latency_s")
    assert code == 0
    assert f"wrote {out / 'dish.html'}" in said
    assert (out / "dish.cells.csv").read_text().startswith("latency_s,autonomy,runs,")
    assert call("report", str(swept), "--choose", "uplink_bps")[0] == 2
    log = swept / load_sweep(swept)["log"][0]
    code, _, told = call("report", str(log), "--pages")
    assert code == 2
    assert "belongs to a sweep" in told
