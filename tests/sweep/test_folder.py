"""Journals that were cut, locks, manifests."""

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.core.errors import BadInput
from teleop_sim.sweep.folder import SweepBroken, SweepFolder, append
from teleop_sim.sweep.planning import plan_sweep
from teleop_sim.sweep.study import resumed_plan
from teleop_sim.sweep.versions import code_digest, versions


def filled(path: Path, rows: list[dict]) -> bytes:
    folder = SweepFolder(path)
    with folder.journalling(0) as journal:
        for row in rows:
            append(journal, row)
    return folder.journal(0).read_bytes()


ROWS = [{"cell": n, "replicate": 0, "cause": "a\nb é" * n, "time_s": 0.1 * n} for n in range(5)]


@given(st.data())
def test_a_journal_cut_anywhere_has_its_whole_lines_and_goes_on(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("cut")
    whole = filled(path, ROWS)
    cut = data.draw(st.integers(0, len(whole)))
    folder = SweepFolder(path)
    folder.journal(0).write_bytes(whole[:cut])
    # A line counts if all of it but its end is there.
    ends = [n for n, c in enumerate(whole) if c == ord("\n")]
    there = sum(cut >= end for end in ends)
    assert folder.finished(0) == {row["cell"]: row for row in ROWS[:there]}
    with folder.journalling(0) as journal:
        for row in ROWS[there:]:
            append(journal, row)
    assert folder.finished(0) == {row["cell"]: row for row in ROWS}


@given(st.integers(0, 10_000), st.integers(0, 255))
def test_a_damaged_byte_loses_its_line_alone(tmp_path_factory, at, byte):
    path = tmp_path_factory.mktemp("hurt")
    whole = bytearray(filled(path, ROWS))
    at %= len(whole)
    whole[at] = byte
    SweepFolder(path).journal(0).write_bytes(bytes(whole))
    found = SweepFolder(path).finished(0)
    # A line end within a line makes two bad ones; one that is lost joins two.
    assert len(found) >= len(ROWS) - 2
    assert all(found[row["cell"]] == row for row in ROWS if row["cell"] in found)


def test_two_sweeps_in_one_directory_are_refused(tmp_path: Path):
    with SweepFolder(tmp_path).alone(), pytest.raises(BadInput, match="under way"), SweepFolder(tmp_path).alone():
        pass


def begun(path: Path) -> SweepFolder:
    folder = SweepFolder(path)
    folder.create(plan_sweep("src-dish", {"--uplink": "64bps,1kbps"}, runs=2))
    return folder


def test_a_sweep_is_resumed_with_the_plan_that_it_was_begun_with(tmp_path: Path):
    folder = begun(tmp_path)
    plan, _ = folder.read()
    assert resumed_plan(tmp_path, lambda _: plan.scenario) == plan
    assert resumed_plan(tmp_path, lambda _: None) == plan


def test_a_changed_scenario_is_noticed_and_can_be_forced(tmp_path: Path):
    plan, _ = begun(tmp_path).read()
    with pytest.raises(SweepBroken, match="scenario src-dish has changed"):
        resumed_plan(tmp_path, lambda _: plan.scenario + "# new")
    assert resumed_plan(tmp_path, lambda _: plan.scenario + "# new", force=True) == plan


def test_a_changed_version_is_noticed_and_can_be_forced(tmp_path: Path):
    folder = begun(tmp_path)
    values = json.loads(folder.manifest.read_text())
    values["versions"]["mujoco"] = "1.50"
    folder.manifest.write_text(json.dumps(values))
    with pytest.raises(SweepBroken, match=r"mujoco was 1\.50"):
        resumed_plan(tmp_path, lambda _: None)
    resumed_plan(tmp_path, lambda _: None, force=True)
    assert folder.read()[1] == versions()


@pytest.mark.parametrize("text", ["", "[]", "{", '{"format": 99}', "null"])
def test_a_broken_manifest_is_named(tmp_path: Path, text: str):
    (tmp_path / "sweep.json").write_text(text)
    with pytest.raises(SweepBroken, match=r"sweep\.json"):
        resumed_plan(tmp_path, lambda _: None)


def test_the_digest_of_the_code_sees_every_folder():
    # The folders behind links hold most of the program.
    from teleop_sim.sweep import versions as module

    root = Path(module.__file__).resolve().parent.parent
    names = {path.name for path in module._folders(root)}
    assert {"channel", "machines", "operators", "scenarios", "reports", "robot", "world"} <= names
    assert len(code_digest()) == 16
