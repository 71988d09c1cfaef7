"""The rebuilt plant is the run's own, and stands where the run's stood."""

import dataclasses

import mujoco
import numpy as np
import pytest

from teleop_sim.core.errors import LogDamaged
from teleop_sim.core.records import PlantNames, PlantSample, RunStarted, TransitionTaken
from teleop_sim.log.load import load
from teleop_sim.log.writer import LogWriter
from teleop_sim.replay.scene import Scene
from teleop_sim.scenarios.files import list_scenarios
from teleop_sim.world.plant import Plant


def model_bytes(plant: Plant) -> bytes:
    buffer = np.empty(mujoco.mj_sizeModel(plant.model), np.uint8)
    mujoco.mj_saveModel(plant.model, None, buffer)
    return buffer.tobytes()


@pytest.mark.parametrize("name", list_scenarios())
def test_the_plant_of_every_shipped_scenario_is_rebuilt_to_the_byte(runs, name):
    """Robot, hands, drawn world, plates, masses and friction: all that MuJoCo knows of."""
    run = runs(name, 0.5)
    assert model_bytes(Scene.of(run.log).plant) == model_bytes(run.body.plant)


@pytest.mark.parametrize("which", ["dish", "door", "valve"])
def test_bodies_are_where_physics_had_them_at_the_end_of_every_episode(which, request):
    run = request.getfixturevalue(which)
    scene, original = Scene.of(run.log), run.body.plant
    moved = 0
    for start_s, episode in run.watched.episodes:
        at_s = start_s + episode.duration_s
        if at_s > run.log.end_s:
            continue
        original.load(episode.end.plant)
        scene.at(at_s)
        for name, place in scene.bodies().items():
            body = original.data.body(name)
            # The log keeps doubles; what remains is the order of sums in forward kinematics.
            np.testing.assert_allclose(place[:3], body.xpos, atol=1e-9)
            assert abs(place[3:] @ body.xquat) == pytest.approx(1.0, abs=1e-9)
        moved += episode.physics_s > 0
    assert moved >= 3


def test_feet_and_hands_are_where_they_were_in_the_middle_of_a_walk(dish):
    """Between episodes' ends too, at every sample that the log has of it."""
    scene, original = Scene.of(dish.log), dish.body.plant
    start_s, walk = max(dish.watched.episodes, key=lambda e: e[1].physics_s)
    sole = dish.body.spec.model.description.sole
    compared = 0
    for k, t_s in enumerate(walk.samples.t_s):
        if start_s + t_s not in scene.track.t_s:
            continue
        original.data.qpos[:7] = walk.samples.pelvis[k]
        for name, value in zip(original.joint_names, walk.samples.joints[k], strict=True):
            original.set_angle(name, value)
        mujoco.mj_forward(original.model, original.data)
        scene.at(start_s + t_s)
        for site in (f"{sole.left}_sole", f"{sole.right}_sole", "leftTcp", "rightTcp"):
            np.testing.assert_allclose(scene.plant.site(site).position, original.site(site).position, atol=1e-9)
        compared += 1
    assert compared > 50


def test_the_thing_is_where_the_run_had_it(dish, door):
    at = door.body.plant.data.body("doorLever").xpos
    door.body.load(door.body.standing())
    np.testing.assert_allclose(Scene.of(door.log).thing[:2], at[:2], atol=0.05)  # its axis is a standoff away
    dish.body.load(dish.body.standing())
    wheels = [dish.body.plant.data.body(name).xpos for name in ("yawWheel", "pitchWheel")]
    np.testing.assert_allclose(Scene.of(dish.log).thing, np.mean(wheels, axis=0), atol=0.1)


def test_a_scene_is_anywhere_in_any_order(door):
    one, other = Scene.of(door.log), Scene.of(door.log)
    end_s = door.log.end_s
    one.at(end_s)
    one.at(0.3 * end_s)
    other.at(0.3 * end_s)
    assert all(np.array_equal(a, b) for a, b in zip(one.bodies().values(), other.bodies().values(), strict=True))


STARTED = RunStarted(0.0, "x", "", 1, 0, 10.0, "teleop-sim 0.1.0")
TAKEN = TransitionTaken(1.0, "A", "go", "B", 0.0, "autonomous", "normal", 0, 0, 3, 0.0, "")


def log_of(path, *records):
    with LogWriter(path) as write:
        for record in records:
            write(record)
    return load(path)


def test_a_log_in_which_nothing_moved_is_refused(tmp_path):
    with pytest.raises(LogDamaged, match="nothing moved"):
        Scene.of(log_of(tmp_path / "a.mcap", STARTED, TAKEN))


def test_a_log_that_does_not_say_what_was_run_is_refused(tmp_path):
    motion = PlantNames(0.0, "a b"), PlantSample(0.0, (0.0,) * 7, (0.0, 0.0))
    with pytest.raises(LogDamaged, match="does not say what was run"):
        Scene.of(log_of(tmp_path / "a.mcap", *motion))


def test_motion_of_another_plant_is_refused(tmp_path, dish):
    started = next(dish.log.records("run/started"))
    motion = PlantNames(0.0, "a b"), PlantSample(0.0, (0.0,) * 7, (0.0, 0.0))
    with pytest.raises(LogDamaged, match="not those of today's plant"):
        Scene.of(log_of(tmp_path / "a.mcap", dataclasses.replace(started), *motion))


def test_a_sample_of_another_width_is_refused(tmp_path):
    motion = PlantNames(0.0, "a b"), PlantSample(0.0, (0.0,) * 7, (0.0,))
    with pytest.raises(LogDamaged, match="does not fit"):
        Scene.of(log_of(tmp_path / "a.mcap", STARTED, *motion))
