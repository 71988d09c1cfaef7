"""The page on the machine: what it declares, a newcomer can run."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from teleop_sim.machines.analysis import analyse
from teleop_sim.machines.files import parse_machine

PAGE = (Path(__file__).parents[2] / "docs" / "machine.md").read_text(encoding="utf-8")


def block(language):
    [found] = re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)
    return found


def test_the_machine_of_the_page_runs_and_prints_what_the_page_says(capsys):
    names: dict[str, Any] = {}
    exec(compile(block("python"), "fetch.py", "exec"), names)
    [said] = re.findall(r"It prints `(.*?)`", PAGE)
    assert capsys.readouterr().out.strip() == said
    assert len(names["FETCH"].states) == 3


def test_the_file_of_the_page_is_the_same_machine():
    names: dict[str, Any] = {}
    exec(compile(block("python"), "fetch.py", "exec"), names)
    assert parse_machine(block("toml"), "fetch.toml") == names["FETCH"]
    report = analyse(names["FETCH"])
    assert (report.unreachable, report.dead_ends) == ((), ())
