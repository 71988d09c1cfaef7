"""Whole runs at door and valve: the same bytes whatever is remembered of physics and of what eyes saw."""

from __future__ import annotations

from pathlib import Path

import pytest

from teleop_sim import load_scenario
from teleop_sim.log.writer import LogWriter
from teleop_sim.operators.memo import EyeMemo
from teleop_sim.robot.memo import Memo
from teleop_sim.run import simulate

NAMES = ("drc-door-lab-operator", "drc-valve-lab-behaviour")
CELLS = ({}, {"operator.expertise": 1.3}, {"link.up.delay_s": 2.0, "link.down.delay_s": 2.0})


def written(name: str, cell: dict[str, object], path: Path, memo: Memo | None, eyes: EyeMemo | None) -> bytes:
    """A run's log."""
    with LogWriter(path) as write:
        simulate(load_scenario(name, cell), 5, 0, write, memo=memo, eyes=eyes)
    return path.read_bytes()


@pytest.mark.parametrize("name", NAMES)
def test_what_is_remembered_of_physics_and_of_what_eyes_saw_changes_no_byte(name, tmp_path):
    memo, eyes = Memo(), EyeMemo()
    for k, cell in enumerate((*CELLS, CELLS[0])):
        fresh = written(name, cell, tmp_path / f"fresh{k}.mcap", None, None)
        assert written(name, cell, tmp_path / f"memo{k}.mcap", memo, eyes) == fresh
    assert eyes.found > 0
    assert memo.tally().episodes_found > 0
