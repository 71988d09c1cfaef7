"""The tables [disturbances] of a scenario: what is read, what is refused and where, and that nothing stays nothing."""

import re
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import BaseModel

from teleop_sim.core.errors import BadInput
from teleop_sim.core.streams import stream
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.scenarios import disturbance_schema as tables
from teleop_sim.scenarios.disturbances import disturbance_ranges
from teleop_sim.scenarios.files import load_scenario, read_scenario, scenario_to_toml
from teleop_sim.scenarios.objects import TASKS, drawn_disturbances
from teleop_sim.world import dish_layout as lay
from teleop_sim.world.disturbance_ranges import (
    DisturbanceRanges,
    PayloadRanges,
    PlateRanges,
    PushRanges,
    SenseRanges,
)
from teleop_sim.world.disturbances import CALM

HEAD = """\
schema = 1
name = "rough"
[link]
preset = "mars-near"
"""


def read(text: str) -> tables.Disturbances:
    return read_scenario(HEAD + text, "a.toml").disturbances


def problems(text: str, robot: str = "valkyrie") -> list[str]:
    with pytest.raises(BadInput) as refused:
        read_scenario(f'robot = "{robot}"\n{HEAD}{text}', "a.toml")
    return [f"{p.where}: {p.what}" for p in refused.value.problems]


PAIRS: list[tuple[type[BaseModel], type[Any]]] = [
    (tables.Disturbances, DisturbanceRanges),
    (tables.Bumps, PlateRanges),
    (tables.Patches, PlateRanges),
    (tables.Pushes, PushRanges),
    (tables.Payload, PayloadRanges),
    (tables.Senses, SenseRanges),
]


@pytest.mark.parametrize(("table", "ranges"), PAIRS, ids=lambda x: x.__name__)
def test_every_key_is_a_range_of_the_world_and_every_number_has_a_source(
    table: type[BaseModel], ranges: type[Any]
) -> None:
    keys = {key for key in table.model_fields if not key.endswith("_source")}
    known = {field.name for field in fields(ranges)}
    # The floor's friction is the world's own key; a patch has no height that anyone could choose.
    assert known - keys <= {"floor_friction", "height_m"}
    assert keys <= known
    nested = {"bumps", "patches", "pushes", "payload", "senses", "link", "known"}
    sources = {key.removesuffix("_source") for key in table.model_fields if key.endswith("_source")}
    assert {key for key in keys - nested if not {key, key.rpartition("_")[0]} & sources} == set()
    for name, field in table.model_fields.items():
        assert name.endswith("_source") or field.description


def test_a_table_left_out_is_calm_and_writes_nothing() -> None:
    scenario = read_scenario(HEAD, "a.toml")
    assert disturbance_ranges(scenario.disturbances) == DisturbanceRanges()
    assert "disturbances" not in scenario_to_toml(scenario)
    assert read("[disturbances]\n[disturbances.senses]\n") == tables.Disturbances(senses=tables.Senses())


def test_an_empty_table_of_one_kind_is_mild() -> None:
    made = disturbance_ranges(read("[disturbances.bumps]\n[disturbances.pushes]\n"))
    assert (made.bumps, made.pushes) == (PlateRanges(), PushRanges())


def test_one_number_is_a_range_without_width() -> None:
    one = read("[disturbances]\nmass_factor = 1.02\ncom_error_m = 0.01\n[disturbances.bumps]\ncount = 2\n")
    both = "mass_factor = [1.02, 1.02]\ncom_error_m = [0.01, 0.01]"
    two = read(f"[disturbances]\n{both}\n[disturbances.bumps]\ncount = [2, 2]\n")
    assert one == two
    assert one.mass_factor == (1.02, 1.02)
    assert one.mass_factor_source == "assumed"
    assert one.joint_friction_source is None


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("mass_factor = 3", "disturbances.mass_factor: 3 is above 2"),
        ("mass_factor = [0.9, 3]", "a.toml:7:21: disturbances.mass_factor[1]: 3 is above 2"),
        ("mass_factor = [1.1, 0.9]", "disturbances.mass_factor: the range runs backwards from 1.1 to 0.9"),
        ("mass_factor = [1.0]", "disturbances.mass_factor[1]: is missing"),
        ("mass_factor = nan", "disturbances.mass_factor: nan is not finite"),
        ("mass_factor = true", "disturbances.mass_factor: true is not a number"),
        ('mass_factor = "heavy"', "disturbances.mass_factor: 'heavy' is not a number"),
        ("com_error_m = [0.1]", "disturbances.com_error_m: 1 numbers are neither a size nor a vector"),
        ("com_error_m = -0.1", "disturbances.com_error_m: no vector is -0.1 long"),
        ("com_error_m = [0, 0, 0.6]", "a.toml:7:22: disturbances.com_error_m[2]: 0.6 is above 0.5"),
        ("mas_factor = 1", "disturbances.mas_factor: unknown key"),
        ("delay_s = 1", "disturbances.delay_s: 1 is above 0.5"),
        ("bumps = 3", "disturbances.bumps: 3 is not a table"),
        ("bumps = { count = 1.5 }", "a.toml:7:11: disturbances.bumps.count: 1.5 is not a whole number"),
        ("bumps = { height_m = -1 }", "a.toml:7:11: disturbances.bumps.height_m: -1 is below 0"),
        ("bumps = { at_m = [[1, 2], [3]] }", "a.toml:7:27: disturbances.bumps.at_m[1][1]: is missing"),
        (
            "bumps = { at_m = [[1, 2]], count = 2 }",
            "a.toml:7:28: disturbances.bumps.count: stands beside at_m",
        ),
        ("pushes = { every_s = 0 }", "a.toml:7:12: disturbances.pushes.every_s: 0 is below 0.1"),
        ("payload = { mass_kg = 1 }", "a.toml:7:1: disturbances.payload.link: is missing"),
        ('payload = { link = "leftPlam" }', "a.toml:7:13: disturbances.payload.link: unknown name 'leftPlam'"),
        ('strength = { "*Knie*" = 0.5 }', "a.toml:7:14: disturbances.strength.*Knie*: unknown name '*Knie*'"),
        ('strength = { "left*" = 0 }', "a.toml:7:14: disturbances.strength.left*: 0 is not above 0"),
        ('strength = { "a b" = 0.5 }', "disturbances.strength: 'a b' is no joint's name"),
        ("senses = { focal = 0.4 }", "a.toml:7:12: disturbances.senses.focal: 0.4 is below 0.5"),
        ("senses = { camera_turn = 0.4 }", "a.toml:7:12: disturbances.senses.camera_turn: unknown key"),
    ],
)
def test_a_wrong_line_is_named_with_its_place(line: str, error: str) -> None:
    (found,) = problems(f"[disturbances]\n{line}\n")
    assert found == (error if error.startswith("a.toml") else f"a.toml:7:1: {error}")


def test_all_that_is_wrong_comes_at_once() -> None:
    text = "[disturbances]\nmass_factor = 9\n[disturbances.pushes]\nforce_n = -1\nevery = 2\n"
    text += "[disturbances.payload]\nlink = 3\n"
    assert [line.split(":")[1] for line in problems(text)] == ["7", "9", "10", "12"]
    text = '[disturbances]\nstrength = { x = 0.5, y = 0.5 }\n[disturbances.payload]\nlink = "z"\n'
    assert [line.split(": ")[1] for line in problems(text)] == [
        "disturbances.strength.x",
        "disturbances.strength.y",
        "disturbances.payload.link",
    ]


@pytest.mark.parametrize("robot", sorted(ROBOTS))
def test_names_are_those_of_the_robot(robot: str) -> None:
    description = ROBOTS[robot]().model.description
    joint, link = description.joints[0].name, description.links[-1].name
    line = f'disturbances = {{ strength = {{ {joint} = 0.5 }}, payload = {{ link = "{link}" }} }}\n'
    made = read_scenario(f'robot = "{robot}"\n{line}{HEAD}', "a.toml")
    assert made.disturbances.payload is not None
    other = "atlas" if robot != "atlas" else "valkyrie"
    with pytest.raises(BadInput) as refused:
        read_scenario(f'robot = "{other}"\n{line}{HEAD}', "a.toml")
    assert [p.where.split(": ")[1] for p in refused.value.problems] == [
        f"disturbances.strength.{joint}",
        "disturbances.payload.link",
    ]


def numbers(low: float, high: float) -> st.SearchStrategy[object]:
    one = st.floats(low, high)
    return st.one_of(one, st.tuples(one, one).map(lambda pair: sorted(pair)))


@st.composite
def disturbances(draw: st.DrawFn) -> dict[str, object]:
    parts: dict[str, st.SearchStrategy[Any]] = {
        "mass_factor": numbers(0.9, 1.1),
        "com_error_m": st.one_of(numbers(0.0, 0.1), st.tuples(*3 * [st.floats(-0.1, 0.1)]).map(list)),
        "strength": st.dictionaries(st.sampled_from(["*", "*Knee*", "left*"]), numbers(0.5, 1.0), min_size=1),
        "strength_source": st.text(),
        "bumps": st.fixed_dictionaries({"height_m": numbers(0.0, 0.15)}, optional={"friction": numbers(0.1, 1.0)}),
        "pushes": st.fixed_dictionaries({}, optional={"force_n": numbers(0.0, 50.0), "count": st.integers(0, 9)}),
        "payload": st.fixed_dictionaries({"link": st.sampled_from(["left_hand", "pelvis"])}),
        "senses": st.fixed_dictionaries({}, optional={"focal": numbers(0.9, 1.1), "camera_turn_rad": numbers(0, 0.1)}),
    }
    return {key: draw(parts[key]) for key in sorted(draw(st.sets(st.sampled_from(sorted(parts)))))}


@given(disturbances())
@settings(max_examples=60, deadline=None)
def test_disturbances_survive_being_written_and_read(given_: dict[str, object]) -> None:
    scenario = load_scenario("src-dish", {"disturbances": given_})
    text = scenario_to_toml(scenario)
    again = read_scenario(text, "again")
    assert disturbance_ranges(again.disturbances) == disturbance_ranges(scenario.disturbances)
    assert scenario_to_toml(again) == text


def test_bumps_of_the_dish_task_lie_on_the_walkway_with_the_floor_s_friction() -> None:
    for layout in (1, 2, 3, 4, 5):
        settings_ = {"world.layout": layout, "disturbances.bumps.count": 20, "disturbances.bumps.along": [0, 1]}
        scenario = load_scenario("src-dish", settings_)
        streams = partial(stream, 1, 0)
        site = TASKS["src-dish"].site(scenario, streams)
        world = site.scenery.world
        what = drawn_disturbances(scenario, streams, site, ROBOTS["valkyrie"]().model)
        for plate in what.plates:
            assert plate.friction == world.floor_friction
            assert any(
                abs(u) <= slab.half_along_m and abs(v) <= slab.half_across_m
                for slab in lay.layout(layout).slabs
                for u, v, _ in [lay.compose(lay.inverse(slab.pose), (plate.x_m, plate.y_m, 0.0))]
            )
    assert drawn_disturbances(load_scenario("src-dish"), streams, site, ROBOTS["valkyrie"]().model) == CALM


def test_the_page_of_the_world_names_every_key() -> None:
    page = (Path(__file__).parents[2] / "docs" / "world.md").read_text(encoding="utf-8")
    told = set(re.findall("`[^`\n]+`", page))
    nested = {"bumps": tables.Bumps, "patches": tables.Patches, "pushes": tables.Pushes, "payload": tables.Payload}
    parts = {"": tables.Disturbances, **nested, "senses": tables.Senses}
    for name, part in parts.items():
        for key in part.model_fields:
            if key not in parts and not key.endswith("_source"):
                assert {f"`{name}.{key}`".replace("`.", "`"), f"`….{key}`"} & told, key
