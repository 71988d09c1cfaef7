"""Drums beside the walkway, and what a log is told of where things truly are."""

import math
from dataclasses import replace
from functools import partial

import mujoco
import numpy as np
import pytest

from teleop_sim.core.streams import stream
from teleop_sim.robot.hands import robot_of
from teleop_sim.world import console
from teleop_sim.world.dish_draw import DishSettings, draw_dish_world
from teleop_sim.world.dish_scenery import DishScenery
from teleop_sim.world.plant import HasPlaces, Plant


def drawn(seed: int, **settings: object):
    return draw_dish_world(partial(stream, seed, 0), DishSettings(**settings))


@pytest.mark.parametrize("seed", range(1, 6))
def test_drums_change_nothing_else_in_a_world(seed):
    calm, other = drawn(seed), drawn(seed, drums=(1, 1))
    assert other.clutter[: len(calm.clutter)] == calm.clutter
    assert replace(other, clutter=calm.clutter) == calm


def test_drums_stand_in_pairs_where_they_are_said_to_stand():
    pairs = 0
    for seed in range(1, 31):
        world = drawn(seed, drums=(1, 1))
        drums = [thing for thing in world.clutter if thing.kind.startswith("drum")]
        assert [d.kind for d in drums] in ([], ["drum_red", "drum_blue"])
        if not drums:
            continue
        pairs += 1
        (red, blue), at = (np.array(d.pose[:2]) for d in drums), np.array(world.console[:2])
        assert np.linalg.norm(red - blue) == pytest.approx(console.WHEEL_SEPARATION_M)
        # The console is shifted by a few centimetres after they are placed.
        assert 1.4 < np.linalg.norm((red + blue) / 2 - at) < 3.1
        # Red on the left as seen from the start.
        assert red[0] * blue[1] - red[1] * blue[0] < 0.0
    # A crowded world may have no room; most have.
    assert pairs >= 20


@pytest.mark.parametrize("turned_rad", [0.0, 0.7])
def test_true_places_are_those_of_mujoco(turned_rad):
    world = drawn(3)
    scenery = DishScenery(world)
    assert isinstance(scenery, HasPlaces)
    plant = Plant(robot_of("valkyrie").model, scenery)
    for wheel in ("yawWheel", "pitchWheel"):
        plant.set_angle(wheel, turned_rad)

    mujoco.mj_forward(plant.model, plant.data)
    places = scenery.places(plant)
    for name, geom in {
        "yaw_wheel": "yawWheelDisc",
        "pitch_wheel": "pitchWheelDisc",
        "yaw_handle": "yawWheelKnob",
        "pitch_handle": "pitchWheelKnob",
    }.items():
        assert math.dist(places[name], plant.data.geom(geom).xpos) < 1e-9
