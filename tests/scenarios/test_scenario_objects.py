"""A scenario's values reach the parts of the simulator unchanged."""

import pytest

from teleop_sim.core.errors import BadInput, UnknownName
from teleop_sim.machines.declare import Autonomy
from teleop_sim.robot.hands import HANDS, robot_of
from teleop_sim.robot.programs.pacing import pacing
from teleop_sim.scenarios import names
from teleop_sim.scenarios.files import load_scenario, scenario_to_toml
from teleop_sim.scenarios.names import AUTONOMY, PACINGS, WORLDS
from teleop_sim.scenarios.objects import (
    autonomy_level,
    dish_settings,
    operator_policy,
    operator_timing,
)
from teleop_sim.scenarios.robots import robot_spec
from teleop_sim.scenarios.schema import World
from teleop_sim.world.dish_draw import DishSettings
from teleop_sim.world.dish_layout import LAYOUT_IDS


def test_a_scenario_that_says_nothing_of_the_world_gets_the_world_s_own_defaults() -> None:
    assert dish_settings(World()) == DishSettings()
    assert dish_settings(load_scenario("src-dish").world) == DishSettings()
    assert dish_settings(World(layout=3)).layout_id == 3


def test_the_layouts_are_those_of_the_world() -> None:
    assert WORLDS == LAYOUT_IDS


def test_the_operator_is_as_fast_as_asked() -> None:
    operator = load_scenario("src-dish", {"operator.expertise": 0.5}).operator
    assert operator_timing(operator).expertise == 0.5
    assert operator_policy(operator)


def test_levels_are_those_of_the_machine() -> None:
    assert {name.upper(): level for name, level in AUTONOMY.items()} == {a.name: a.value for a in Autonomy}
    assert autonomy_level(load_scenario("src-dish", {"autonomy": "high"})) == 2


def test_pacings_are_those_of_the_programs() -> None:
    with pytest.raises(UnknownName) as refused:
        pacing("")
    assert set(refused.value.args[2]) == set(PACINGS)


def test_hands_are_those_that_robots_can_have() -> None:
    assert set(HANDS) == set(names.HANDS)
    for robot in names.ROBOTS:
        plain = load_scenario("src-dish", {"robot": robot})
        assert robot_spec(plain) is robot_spec(plain)
        # A scenario that leaves the key out writes none: its hands are those of the robot's file.
        assert plain.hand is None
        assert "\nhand" not in scenario_to_toml(plain)
        for hand in HANDS:
            try:
                spec = robot_of(robot, hand)
            except UnknownName:
                with pytest.raises(BadInput, match=f"hand: {robot} has no {hand}"):
                    load_scenario("src-dish", {"robot": robot, "hand": hand})
            else:
                made = load_scenario("src-dish", {"robot": robot, "hand": hand})
                assert robot_spec(made).model.description.name == spec.model.description.name


def test_unknown_hands_are_refused_with_what_is_meant() -> None:
    with pytest.raises(BadInput, match="Did you mean 'fingers'"):
        load_scenario("src-dish", {"hand": "finger"})
