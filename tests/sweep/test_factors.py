"""Axes, settings and designs as text; plans there and back."""

import json
from pathlib import Path

import pytest

from teleop_sim.core.errors import BadInput
from teleop_sim.stats.factors import Range
from teleop_sim.sweep.factors import AXES, Factor, axis_factor, set_factor
from teleop_sim.sweep.plan import from_json, to_json
from teleop_sim.sweep.planning import plan_sweep


def wrong(**given) -> dict[str, str]:
    with pytest.raises(BadInput) as refused:
        plan_sweep("src-dish", **given)
    return {problem.where: problem.what for problem in refused.value.problems}


def test_lists_and_ranges_are_read_in_the_units_of_the_axis():
    assert axis_factor("--uplink", "64bps, 4kbps").levels == (64.0, 4000.0)
    assert axis_factor("--latency", "0s,250ms").levels == (0.0, 0.25)
    assert axis_factor("--uplink", "1kbps:4kbps:4").levels == Range(1000.0, 4000.0, 4)
    assert axis_factor("--uplink", "64bps:4096bps:4:log").levels == Range(64.0, 4096.0, 4, "log")
    assert axis_factor("--autonomy", "off,full").levels == ("off", "full")


def test_a_geometric_range_has_equal_ratios():
    plan = plan_sweep("src-dish", {"--uplink": "64bps:4096bps:4:log"}, runs=1)
    assert plan.cells == ((64.0,), (256.0,), (1024.0,), (4096.0,))


def test_any_key_of_a_scenario_is_a_factor():
    assert set_factor("world.layout=1,2").levels == (1, 2)
    assert set_factor("link.up.loss.p=0,0.05") == Factor("link.up.loss.p", ("link.up.loss.p",), (0, 0.05))
    assert set_factor("world.floor_friction=[0.2,0.2],[0.4,0.4]").levels == ((0.2, 0.2), (0.4, 0.4))
    assert set_factor("link.up.rate_bps=64bps,1kbps").levels == (64.0, 1000.0)
    assert set_factor("operator.policy=supervise").levels == ("supervise",)


def test_a_grid_crosses_everything_with_the_last_factor_fastest():
    plan = plan_sweep("src-dish", {"--uplink": "64bps,1kbps", "--autonomy": "off,full"}, ["world.layout=1,2"], runs=3)
    assert len(plan.cells) == 8
    assert plan.runs == 24
    assert plan.cells[:3] == ((64.0, "off", 1), (64.0, "off", 2), (64.0, "full", 1))


def test_each_cell_is_the_scenario_with_its_values():
    plan = plan_sweep("src-dish", {"--uplink": "64bps,1kbps", "--latency": "0s,7s"}, ["link.up.loss.p=0.05"], runs=1)
    for cell, (rate_bps, delay_s, p) in enumerate(plan.cells):
        link = plan.scenario_of(cell).link
        assert (link.up.rate_bps, link.up.delay_s, link.down.delay_s) == (rate_bps, delay_s, delay_s)
        assert link.up.loss.p == p
        assert link.down.rate_bps == 380_000.0


def test_a_preset_is_the_whole_link_and_other_axes_change_it():
    plan = plan_sweep("src-dish", {"--latency": "1s", "--preset": "drc-trials-2013"}, runs=1)
    link = plan.scenario_of(0).link
    assert link.preset == "drc-trials-2013"
    assert link.up.delay_s == 1.0


def test_a_sampled_design_fills_each_range_evenly():
    plan = plan_sweep("src-dish", {"--uplink": "64bps:4kbps", "--autonomy": "off,full"}, runs=1, design="lhs:10")
    rates = sorted(cell[0] for cell in plan.cells)
    # Latin hypercube: one point in each tenth.
    assert [int((rate - 64.0) / 393.6) for rate in rates] == list(range(10))
    assert sum(cell[1] == "off" for cell in plan.cells) == 5
    again = plan_sweep("src-dish", {"--uplink": "64bps:4kbps", "--autonomy": "off,full"}, runs=1, design="lhs:10")
    assert plan.cells == again.cells


def test_a_design_file_has_a_row_a_cell(tmp_path: Path):
    file = tmp_path / "cells.csv"
    file.write_text("uplink,world.layout,autonomy\n64bps,1,full\n1kbps,2,off\n")
    plan = plan_sweep("src-dish", runs=1, design=str(file))
    assert plan.cells == ((64.0, 1, "full"), (1000.0, 2, "off"))
    assert [factor.name for factor in plan.factors] == ["uplink_bps", "world.layout", "autonomy"]


def test_what_is_wrong_is_told_all_at_once_by_the_name_of_the_factor():
    found = wrong(axes={"--uplink": "64bs", "--latency": "0s:9s", "--autonomy": "off,ful"}, settings=["world.layout=9"])
    assert set(found) == {"--uplink", "latency_s", "autonomy", "world.layout"}


@pytest.mark.parametrize(
    ("given", "where"),
    [
        ({"runs": 0}, "--runs"),
        ({"detail": "some"}, "--detail"),
        ({"design": "cube"}, "--design"),
        ({"design": "lhs:x"}, "--design"),
        ({"design": "lhs:4"}, "--design"),
        ({"design": "nowhere.csv"}, "--design"),
        ({"until": "ci=0%"}, "--until"),
        ({"until": "ci=5%", "measure": "speed"}, "--measure"),
        ({"settings": ["world.layout"]}, "--set"),
        ({"settings": ["world.layout=1,1"]}, "--set world.layout"),
        ({"settings": ["link.up.rate_bps=64bps"], "axes": {"--uplink": "64bps"}}, "sweep"),
    ],
)
def test_bad_arguments_are_named(given: dict, where: str):
    assert where in wrong(**given)


def test_a_plan_survives_its_manifest():
    plan = plan_sweep(
        "src-dish",
        {"--uplink": "64bps:4kbps:3:log", "--preset": "drc-trials-2013"},
        ["world.floor_friction=[0.2,0.2],[0.4,0.4]"],
        runs=7,
        until="ci=5%",
        detail="events",
    )
    assert from_json(json.loads(json.dumps(to_json(plan)))) == plan


def test_every_axis_sets_keys_that_a_scenario_has():
    texts = {"--preset": "drc-trials-2013", "--delivery": "tcp", "--autonomy": "off", "--robot": "valkyrie"}
    texts |= {"--pacing": "eager", "--loss": "0.1", "--latency": "1s"}
    texts |= {"--policy": "adaptive", "--team": "1,4", "--expertise": "0.7", "--layer": "behaviour"}
    for option in AXES:
        # TCP brings its own headers.
        bare = ["link.up.header_bytes=0", "link.down.header_bytes=0"] if option == "--delivery" else []
        plan = plan_sweep("src-dish", {option: texts.get(option, "100bps")}, bare, runs=1)
        assert plan.scenario_of(0)
