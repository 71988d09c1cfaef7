"""The command line at door and valve: runs, reports, options, and what is said of wrong ones."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

import teleop_sim
from teleop_sim.cli_complete import complete_layer
from teleop_sim.cli_options import scenario_from
from teleop_sim.core.errors import BadInput
from teleop_sim.reports.drc_marks import MARKS
from teleop_sim.reports.drc_times import COLUMNS
from teleop_sim.sweep.planning import plan_sweep

COMMAND = Path(sys.executable).with_name("teleop-sim")
NAME = "drc-door-lab-behaviour"
ROOT = Path(__file__).parents[1]


def call(*args: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([COMMAND, *map(str, args)], cwd=cwd, capture_output=True, text=True, check=False, timeout=300)


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("door")


@pytest.fixture(scope="module")
def ran(home: Path) -> subprocess.CompletedProcess[str]:
    return call("run", NAME, "--seed", "1", cwd=home)


def test_a_run_tells_the_columns_of_table_2_and_not_those_of_another_paper(
    ran: subprocess.CompletedProcess[str],
) -> None:
    assert ran.returncode in (0, 1)
    assert "Columns of the ViGIR paper's Table 2 [s]" in ran.stdout
    assert "Lab Door Behaviors │   132.0 │" in ran.stdout
    assert "Where the time went" in ran.stdout
    assert "longest states: " in ran.stdout
    assert "WPI" not in ran.stdout
    assert len(ran.stdout.splitlines()) < 40
    # one line each, with the state's own name
    assert not [line for line in ran.stderr.splitlines() if "/" in line]


def test_its_report_has_the_layers(home: Path, ran: subprocess.CompletedProcess[str]) -> None:
    assert ran.returncode in (0, 1)
    done = call("report", f"runs/{NAME}_seed1.mcap", "--format", "all", cwd=home)
    assert done.returncode == 0
    wrote = [line.removeprefix("wrote ") for line in done.stdout.splitlines() if line.startswith("wrote ")]
    assert wrote[0] == f"runs/{NAME}_seed1.html"
    assert {f"runs/{NAME}_seed1.{end}" for end in ("layers.png", "layers.svg", "timeline.svg")} <= set(wrote)
    assert all((home / path).stat().st_size > 0 for path in wrote)
    assert "Lab Door Behaviors" in (home / f"runs/{NAME}_seed1.times.md").read_text()
    assert "paper" not in (home / f"runs/{NAME}_seed1.states.md").read_text()
    log = teleop_sim.load(home / f"runs/{NAME}_seed1.mcap")
    assert {"t_s", "start_s", "layer", "text"} <= set(log.layers.columns)
    assert set(log.layers["layer"]) <= {"alignment", "template", "teleoperation"}
    assert "alignment" in set(log.layers["layer"])


def test_json_has_the_columns_and_what_the_crew_did(home: Path) -> None:
    done = call("run", NAME, "--layer", "template", "--team", 1, "--autonomy", "off", "--json", "--out", "j", cwd=home)
    made = json.loads(done.stdout)
    assert set(made["times"]) == set(COLUMNS)
    assert set(made["crew"]) == set(MARKS)
    assert made["times"]["template_s"] > 0.0
    assert made["times"]["behaviour_s"] == 0.0


@pytest.mark.parametrize(
    ("scenario", "given", "settings", "where", "what"),
    [
        ("src-dish", {"--layer": "template"}, (), "--layer", "src-dish has no templates to work with"),
        (NAME, {"--layer": "tempalte"}, (), "--layer", "unknown name 'tempalte'"),
        (NAME, {"--robot": "valkyrie"}, (), "--robot", "valkyrie has no place to stand at drc-door"),
        (NAME, {}, ("world.layout=1",), "--set world.layout", "is no table of task drc-door"),
        (NAME, {}, ("valve.ahead_m=0",), "--set valve.ahead_m", "is no table of task drc-door"),
        (NAME, {}, ("door.closer=1",), "--set door.closer", "unknown key"),
        (NAME, {}, ("door.closer_rad=9",), "--set door.closer_rad", "9 is above 0.2"),
        (NAME, {"--team": "5"}, (), "--team", "5 is above 4"),
    ],
)
def test_what_does_not_fit_a_task_is_refused_with_a_way_out(
    tmp_path: Path, scenario: str, given: dict[str, str], settings: tuple[str, ...], where: str, what: str
) -> None:
    with pytest.raises(BadInput) as refused:
        scenario_from(scenario, given, tmp_path, settings)
    (problem,) = refused.value.problems
    assert (problem.where, problem.what) == (where, what)
    assert problem.hint


def test_a_layer_is_an_option_and_a_factor(tmp_path: Path) -> None:
    made = scenario_from(NAME, {"--layer": "template", "--robot": "thormang3"}, tmp_path, ("door.closer_rad=0.1",))
    assert (made.layer, made.robot) == ("template", "thormang3")
    plan = plan_sweep(NAME, {"--layer": "behaviour,template", "--team": "1,3"}, (), runs=1)
    assert [(plan.scenario_of(n).layer, plan.scenario_of(n).operator.team) for n in range(4)] == [
        ("behaviour", 1), ("behaviour", 3), ("template", 1), ("template", 3)]  # fmt: skip
    assert complete_layer("t") == ["template"]


def test_the_example_compares_people_with_a_behaviour(tmp_path: Path) -> None:
    example = ROOT / "examples/drc_door.py"
    done = subprocess.run([sys.executable, example, "1"], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "drc-door-lab-operator (paper)" in done.stdout
    assert "alignment" in done.stdout
    alone = subprocess.run([sys.executable, example], capture_output=True, text=True, check=False)
    assert alone.stderr.startswith("usage: ")
