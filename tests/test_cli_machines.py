"""``teleop-sim machines``: machines listed, shown, checked and drawn; input refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from teleop_sim.cli_commands import app
from teleop_sim.machines.files import parse_machine
from teleop_sim.machines.library import MACHINES

GOOD = """\
name = "wave"
start = "up"
ends = ["rest"]
edges = [
    { state = "up", event = "raised", to = "down", threshold = "low" },
    { state = "down", event = "lowered", to = "rest", threshold = "off" },
]
states = [{ name = "up", program = "posture" }, { name = "down", program = "posture" }, { name = "rest" }]
"""


def call(*args: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, ("machines", *args), prog_name="teleop-sim")
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr


def output(*args: str) -> str:
    code, out, err = call(*args)
    assert (code, err) == (0, "")
    return out


def refusal(*args: str) -> str:
    code, out, err = call(*args)
    assert (code, out) == (2, "")
    return err


@pytest.fixture
def wave(tmp_path: Path) -> str:
    path = tmp_path / "wave.toml"
    path.write_text(GOOD, encoding="utf-8")
    return str(path)


def test_list_counts_what_is_there():
    head, *lines = (line.split() for line in output("list").splitlines())
    assert head == ["name", "states", "containers", "edges", "off", "low", "high", "full", "inherit"]
    assert [line[0] for line in lines] == list(MACHINES)
    counts = {line[0]: tuple(map(int, line[1:])) for line in lines}
    # 18 states and 63 outcomes: WPI's program, src_task1 (src_dish.py).
    assert counts["src-dish"][:3] == (18, 0, 63)
    assert all(sum(numbers[3:]) == numbers[2] for numbers in counts.values())


@pytest.mark.parametrize("name", sorted(MACHINES))
def test_show_tells_every_state_and_outcome(name: str):
    machine = MACHINES[name]()
    lines = [line.strip() for line in output("show", name).splitlines()]
    assert sum(line.startswith("- ") for line in lines) == len(machine.table)
    for path in machine.state_names:
        assert any(line == (own := path.split("/")[-1]) or line.startswith(f"{own}: ") for line in lines)


def test_show_tells_counters_and_thresholds():
    text = output("show", "src-dish")
    assert "- /DETECTED_PANEL       low      done       -> STATE_WALK_TO_SEE_PANEL" in text
    assert "then /DETECT_HANDLE_ERROR (at attempt 44)" in text


def test_show_prints_the_tuple_of_the_paper():
    text = output("show", "src-dish", "--tuple")
    parts = [line[0] for line in text.splitlines() if not line.startswith(" ")]
    assert parts == ["Σ", "S", "s", "δ", "D", "F", "U", "A"]
    assert "S, states (18):" in text
    assert "  (STATE_INIT, /REGULAR) -> STATE_DETECT_PANEL_COARSE" in text


def test_show_prints_a_file_that_is_the_machine():
    assert parse_machine(output("show", "src-dish", "--toml"), "x") == MACHINES["src-dish"]()
    assert "does not go with" in refusal("show", "src-dish", "--toml", "--tuple")


def test_a_file_of_ones_own_is_shown_checked_and_drawn(wave: str):
    assert output("show", wave).startswith("wave: checksum ")
    assert output("check", wave) == f"{wave}: good (3 states, 0 containers, 2 edges)\n"
    assert "raised" in output("draw", wave)


def test_check_tells_all_that_is_wrong_in_all(tmp_path: Path, wave: str):
    bad = tmp_path / "bad.toml"
    bad.write_text(GOOD.replace('"low"', '"lo"').replace("start", "begin"), encoding="utf-8")
    code, out, err = call("check", str(bad), wave, "src-dish", "none")
    assert code == 2
    assert [line.split(": good")[0] for line in out.splitlines()] == [wave, "src-dish"]
    assert f"{bad}:5: edges[0].threshold: unknown name 'lo'" in err
    assert "start: is missing" in err
    assert "machine: unknown name 'none'" in err


def test_draw_prints_dot_or_writes_a_file(tmp_path: Path):
    text = output("draw", "src-dish")
    assert text.startswith("digraph machine {")
    out = tmp_path / "dish.dot"
    assert output("draw", "src-dish", "--out", str(out)) == f"wrote {out}\n"
    assert out.read_text(encoding="utf-8") == text


def test_draw_highlights_and_leaves_out():
    text = output("draw", "src-dish", "--active", "STATE_INIT", "--level", "off", "--without-commands", "--all-lines")
    assert text.count("#f0e442") == 1
    assert "at level off" in text
    assert "(operator)" not in text
    assert 'shape="cds"' not in text


def test_an_active_container_is_in_what_it_begins_with():
    text = output("draw", "vigir-door-atlas", "--active", "Open_Door")
    machine = MACHINES["vigir-door-atlas"]()
    active = [machine.net.nodes[n].path for n in machine.net.nodes[machine.net.by_path["Open_Door"]].entry]
    assert text.count("#f0e442") == len(active) == 1


def test_what_is_unknown_is_guessed_at(tmp_path: Path):
    assert "Did you mean 'src-dish'?" in refusal("show", "src-dsh")
    assert "Did you mean 'STATE_INIT'?" in refusal("draw", "src-dish", "--active", "STATE_INITT")
    assert "Known: off, low, high, full" in refusal("draw", "src-dish", "--level", "some")
    assert "no kind of drawing" in refusal("draw", "src-dish", "--out", str(tmp_path / "x.bmp"))
    assert "cannot be read" in refusal("show", str(tmp_path / "none.toml"))
