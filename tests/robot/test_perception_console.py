"""How often the detectors are right, in a scene of the console with clutter, light and look-alikes drawn at random.

The rates that they are held to are those of docs/perception.md; 250 cases each were measured there (``slow`` below).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import mujoco
import numpy as np
import pytest

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Look
from teleop_sim.robot.episode import NoiseKey, perform
from teleop_sim.robot.perception import camera, coarse, console_model, fine, lidar
from teleop_sim.robot.perception.rays import SensorPose, upright
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.world import console, dish, dish_draw
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.disturbances import CALM
from teleop_sim.world.plant import Plant
from teleop_sim.world.sense_errors import (
    CalibrationSpread,
    Misalignment,
    SenseErrors,
    draw_sense_errors,
)

RIGHT_COARSE_M = 0.45  # level; fine detection looks 0.65 m around
RIGHT_KNOB_M = 0.04


def add_look_alike(spec, world, rng, colours):
    """Handwheels on posts beside the console, as large and as high as its own."""
    yaw, aside = world.console[2], rng.choice([-1, 1]) * rng.uniform(0.8, 1.8)
    ahead = rng.uniform(-0.3, 1.2)
    for i, rgb in enumerate(colours):
        u, v = ahead, aside - console.WHEEL_SEPARATION_M * i
        x = world.console[0] + np.cos(yaw) * u - np.sin(yaw) * v
        y = world.console[1] + np.sin(yaw) * u + np.cos(yaw) * v
        post = spec.worldbody.add_body(pos=[x, y, dish.SOIL_Z_M], quat=[np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)])
        kind, lean = mujoco.mjtGeom.mjGEOM_CYLINDER, rng.uniform(0.3, 1.2) / 2
        post.add_geom(type=kind, size=[0.03, 0.42, 0], pos=[0, 0, 0.42], rgba=[0.5, 0.5, 0.5, 1])
        flat = {"size": [0.16, 0.012, 0], "pos": [0, 0, 0.86], "quat": [np.cos(lean), 0, -np.sin(lean), 0]}
        post.add_geom(type=kind, rgba=[*rgb, 1], **flat)


LOOK_ALIKES = {"none": (), "red": (console.RED,), "pair": (console.RED, console.BLUE)}


@dataclass
class Scene:
    """A drawn world of task 1, with the knobs anywhere on their circles. Implements ``Rays``."""

    world: dish_draw.DishWorld
    model: mujoco.MjModel
    data: mujoco.MjData

    def cast(self, origin, directions, cutoff_m):
        n = len(directions)
        geoms, distance, normal = np.empty(n, np.int32), np.empty(n), np.empty(3 * n)
        flat = np.ascontiguousarray(directions).ravel()
        mujoco.mj_multiRay(self.model, self.data, origin, flat, None, 1, -1, geoms, distance, normal, n, cutoff_m)
        return distance, geoms, normal.reshape(-1, 3)

    def colour(self, geoms):
        return self.model.geom_rgba[geoms, :3].astype(float)

    def textured(self, geoms):
        return self.model.geom_matid[geoms] >= 0

    @property
    def light(self):
        return self.world.light

    @property
    def foot(self):
        return np.array([*self.world.console[:2], dish.SOIL_Z_M])

    def place(self, x, y, z):
        """From the console's frame to the odometry frame."""
        c, s = np.cos(self.world.console[2]), np.sin(self.world.console[2])
        return self.foot + np.array([c * x - s * y, s * x + c * y, z])

    def knobs(self):
        angles = zip((True, False), self.world.wheel_start_rad, strict=True)
        return [self.place(*console.knob_centre(left, angle)) for left, angle in angles]


def build(rng, look_alike="none"):
    # Every drawn value from one stream: only this file reads them.
    world = dish_draw.draw_dish_world(lambda _: rng, dish_draw.DishSettings(wheel_start_spread_rad=np.pi))
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    dish.add_dish_world(spec, world)
    add_look_alike(spec, world, rng, LOOK_ALIKES[look_alike])
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return Scene(world, model, data)


def turned(yaw, pitch):
    cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    return np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])


def head(scene, rng, level_m, bearing=0.5, aim=0.15):
    """A head ``level_m`` before the wheels, 1.6 to 1.7 m over the walkway, its aim at them up to ``aim`` wrong."""
    b = rng.uniform(-bearing, bearing)
    eye = scene.place(-level_m * np.cos(b), level_m * np.sin(b), rng.uniform(1.7, 1.8))
    way = scene.place(0, 0, console.WHEEL_HEIGHT_M) - eye
    yaw = np.arctan2(way[1], way[0]) + rng.uniform(-aim, aim)
    return SensorPose(turned(yaw, np.arctan2(-way[2], level_m) + rng.uniform(-aim, aim)), eye)


def see_coarse(seed, level_m, look_alike="none"):
    """-> right, wrong or the reason of nothing."""
    rng = np.random.default_rng(seed)
    scene = build(rng, look_alike)
    level_m = rng.uniform(*level_m)
    found, why = coarse.detect(scene, head(scene, rng, level_m), scene.light, rng)
    if found is None:
        return why
    middle = (np.array(found.yaw_wheel) + np.array(found.pitch_wheel)) / 2
    return "right" if np.linalg.norm((middle - scene.foot)[:2]) < RIGHT_COARSE_M else "wrong"


def see_fine(seed, level_m, look_alike="red", off_m=0.07):
    """-> right, wrong or the reason of nothing; and the worse knob's error [m], yaw error [rad], foot's error [m]."""
    rng = np.random.default_rng(seed)
    scene = build(rng, look_alike)
    pose = head(scene, rng, level_m)
    region = scene.place(*rng.normal(0, off_m, 2), console.WHEEL_HEIGHT_M)
    points = lidar.half_turn(scene, pose, rng, tuple(region))
    fix, why = fine.detect(points, tuple(region), tuple(pose.position), rng)
    if fix is None:
        return why, np.nan, np.nan, np.nan
    knob = max(
        np.linalg.norm(knob_of(h) - true)
        for h, true in zip((fix.yaw_handle, fix.pitch_handle), scene.knobs(), strict=True)
    )
    yaw = abs((fix.pose[2] - scene.world.console[2] + np.pi) % (2 * np.pi) - np.pi)
    foot = np.linalg.norm(np.array([*fix.pose[:2], fix.ground_z_m]) - scene.foot)
    return ("right" if knob < RIGHT_KNOB_M else "wrong"), knob, yaw, foot


def knob_of(handle):
    axis, zero = np.array(handle.axis), np.array(handle.zero)
    around = np.cos(handle.angle_rad) * zero + np.sin(handle.angle_rad) * np.cross(axis, zero)
    return np.array(handle.centre) + handle.height_m * axis + handle.radius_m * around


# Cases are fixed by their seeds. The floors are those that a detector as good as docs/perception.md says would miss
# once in a thousand draws of the cases (binomial), so that a change of the scene does not break the tests by chance.
CASES = 40


def count(kinds, what):
    return sum(kind == what for kind in kinds)


@pytest.mark.parametrize("look_alike", ["none", "red"])
def test_coarse_is_right_from_one_and_a_half_to_three_metres(look_alike):
    kinds = [see_coarse(100 + i, (1.5, 3.0), look_alike) for i in range(CASES)]
    assert count(kinds, "right") >= 35  # 0.97 of 40, less three standard deviations
    assert count(kinds, "wrong") <= 2


def test_coarse_depth_gets_vague_at_four_metres():
    kinds = [see_coarse(200 + i, (3.0, 4.0)) for i in range(CASES)]
    assert count(kinds, "right") >= 32  # 0.93 of 40, less three standard deviations


def test_a_second_pair_is_left_when_it_is_to_be_avoided():
    settled = 0
    for seed in range(300, 312):
        rng = np.random.default_rng(seed)
        scene = build(rng, "pair")
        pose = head(scene, rng, 2.4)
        avoid = []
        for _ in range(3):
            found, _ = coarse.detect(scene, pose, scene.light, rng, tuple(avoid))
            if found is None:
                break
            middle = (np.array(found.yaw_wheel) + np.array(found.pitch_wheel)) / 2
            if np.linalg.norm((middle - scene.foot)[:2]) < RIGHT_COARSE_M:
                settled += 1
                break
            avoid.append(tuple(middle))
    assert settled >= 9


def test_avoiding_the_console_itself_refuses_the_pair():
    rng = np.random.default_rng(2)
    scene = build(rng)
    pose = head(scene, rng, 2.4)
    place = tuple(scene.place(0, 0, console.WHEEL_HEIGHT_M))
    assert coarse.detect(scene, pose, scene.light, rng)[1] == "ok"
    assert coarse.detect(scene, pose, scene.light, rng, (place,)) == (None, "pair refused")


@pytest.mark.parametrize("level_m", [0.65, 1.1])
def test_fine_is_right_and_exact_near_the_console(level_m):
    seen = [see_fine(400 + i, level_m) for i in range(CASES)]
    assert count([s[0] for s in seen], "right") >= 35
    assert count([s[0] for s in seen], "wrong") == 0
    knob, yaw, foot = np.nanpercentile(np.array([s[1:] for s in seen]), 90, axis=0)
    assert knob < 0.01  # measured 0.5 cm; the cage hand needs 1 cm
    assert yaw < np.radians(1.0)
    assert foot < 0.015


def test_fine_finds_nothing_where_nothing_is():
    for seed in range(500, 510):
        rng = np.random.default_rng(seed)
        scene = build(rng, "red")
        pose = head(scene, rng, 1.5)
        region = tuple(scene.place(-0.2, rng.choice([-1.3, 1.3]), console.WHEEL_HEIGHT_M))
        fix, why = fine.detect(lidar.half_turn(scene, pose, rng, region), region, tuple(pose.position), rng)
        assert fix is None
        assert why != "ok"


def test_handles_keep_the_convention_of_the_console():
    rng = np.random.default_rng(7)
    scene = build(rng)
    pose = head(scene, rng, 1.0)
    region = tuple(scene.place(0, 0, console.WHEEL_HEIGHT_M))
    fix, _ = fine.detect(lidar.half_turn(scene, pose, rng, region), region, tuple(pose.position), rng)
    for handle, left, angle in zip(
        (fix.yaw_handle, fix.pitch_handle), (True, False), scene.world.wheel_start_rad, strict=True
    ):
        zero, _, axis = console.wheel_axes()
        turn = scene.place(0, 0, 0)
        # 1 cm, 0.02 and 0.06 rad: twice the 90 % errors of docs/perception.md
        assert np.linalg.norm(handle.centre - scene.place(*console.wheel_centre(left))) < 0.01
        assert np.linalg.norm(handle.axis - (scene.place(*axis) - turn)) < 0.02
        assert np.linalg.norm(handle.zero - (scene.place(*zero) - turn)) < 0.02
        assert abs((handle.angle_rad - angle + np.pi) % (2 * np.pi) - np.pi) < 0.06


def test_same_generator_same_fix_and_fresh_noise_for_a_retry():
    def look(rng):
        scene = build(np.random.default_rng(9))
        pose = head(scene, np.random.default_rng(9), 2.0)
        return coarse.detect(scene, pose, scene.light, rng)[0]

    rng = np.random.default_rng(1)
    first, again = look(rng), look(rng)
    assert first == look(np.random.default_rng(1))
    assert first != again


def test_the_known_shape_is_the_real_one():
    # Rays that hit the console's solid parts end on the surface of the known shape.
    rng = np.random.default_rng(3)
    scene = build(rng)
    pose = head(scene, rng, 1.2)
    rays = camera.pixel_directions(320, 170) @ pose.rotation.T
    distance, geoms, _ = scene.cast(pose.position, rays, 30.0)
    solid = [f"console{i}" for i in range(len(console.BLOCKS))] + ["yawWheelDisc", "pitchWheelDisc"]
    hit = np.isin(geoms, [scene.model.geom(name).id for name in solid])
    points = pose.position + rays[hit] * distance[hit, None]
    off = console_model.distance(np.array([[*scene.foot, scene.world.console[2]]]), points)[0]
    assert hit.sum() > 2000
    assert np.abs(off).max() < 1e-6


def seen_from(name, scene, level_m, pitch_rad):
    """Camera and LIDAR of a robot that stands ``level_m`` before the wheels and looks down by ``pitch_rad``."""
    spec = ROBOTS[name]()
    body = Body(spec, Plant(spec.model, BareFloor()))
    perform(body, Look(pitch_rad), body.standing(), NoiseKey(1, 0, 1))
    turn, foot = turned(scene.world.console[2], 0.0), scene.place(-level_m, 0.0, console.WALKWAY_HEIGHT_M)
    poses = []
    for frame in (spec.camera_frame, spec.lidar_frame):
        site = body.plant.site(frame)
        poses.append(SensorPose(turn @ upright(site.rotation), foot + turn @ site.position))
    return poses


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_every_robot_finds_the_console_with_its_own_head(name):
    coarse_right = fine_right = 0
    for seed in range(600, 606):
        rng = np.random.default_rng(seed)
        scene = build(rng)
        middle = scene.place(0.0, 0.0, console.WHEEL_HEIGHT_M)
        eye, _ = seen_from(name, scene, 2.2, 0.35)
        assert eye.rotation[2, 2] > 0.7  # up is up
        found, _ = coarse.detect(scene, eye, scene.light, rng)
        if found is not None:
            off = (np.array(found.yaw_wheel) + np.array(found.pitch_wheel)) / 2 - middle
            coarse_right += np.linalg.norm(off[:2]) < RIGHT_COARSE_M
        _, spinning = seen_from(name, scene, 1.1, 0.35)
        points = lidar.half_turn(scene, spinning, rng, tuple(middle))
        fix, _ = fine.detect(points, tuple(middle), tuple(spinning.position), rng)
        if fix is not None:
            off = [knob_of(h) - true for h, true in zip((fix.yaw_handle, fix.pitch_handle), scene.knobs(), strict=True)]
            fine_right += np.linalg.norm(off, axis=1).max() < RIGHT_KNOB_M
    # 0.97 of six fails more than one time in 1.5 % of draws; these are fixed.
    assert coarse_right >= 5
    assert fine_right >= 5


def test_a_camera_that_is_turned_sees_the_console_aside_by_that_angle():
    rng = np.random.default_rng(2)
    scene = build(rng)
    pose = head(scene, rng, 2.0)
    middles = []
    for turn_rad in (0.0, 0.05):
        wrong = SenseErrors(camera=Misalignment((0.0, 0.0, turn_rad)))
        seen = [coarse.detect(scene, pose, scene.light, np.random.default_rng(k), errors=wrong)[0] for k in range(6)]
        way = [(np.array(s.yaw_wheel) + np.array(s.pitch_wheel)) / 2 - pose.position for s in seen]
        middles.append(np.mean([np.arctan2(*(w @ pose.rotation)[[1, 0]]) for w in way]))
    # A camera that truly looks 0.05 rad further left sees all 0.05 rad further right; a pixel is 0.005 rad.
    assert middles[1] - middles[0] == pytest.approx(-0.05, abs=0.005)


def test_stereo_with_a_wrong_baseline_is_wrong_in_proportion():
    rng = np.random.default_rng(2)
    scene = build(rng)
    pose = head(scene, rng, 2.0)
    ranges = []
    for baseline in (1.0, 1.1):
        found = coarse.detect(
            scene, pose, scene.light, np.random.default_rng(3), errors=SenseErrors(baseline=baseline)
        )[0]
        ranges.append(np.linalg.norm(np.array(found.yaw_wheel) - pose.position))
    # True baseline 10 % longer than believed: disparity 10 % larger, depth 1/1.1, and noise alike.
    assert ranges[1] / ranges[0] == pytest.approx(1 / 1.1, rel=0.01)


def test_a_lidar_that_sits_elsewhere_moves_the_cloud_rigidly():
    rng = np.random.default_rng(4)
    scene = build(rng)
    pose = head(scene, rng, 1.1)
    quiet = SenseErrors(range_noise=0.0)
    region = tuple(scene.place(0, 0, console.WHEEL_HEIGHT_M))
    shift = SenseErrors(lidar=Misalignment(shift_m=(0.0, 0.0, 0.02)), range_noise=0.0)
    exact, shifted = (lidar.half_turn(scene, pose, np.random.default_rng(0), region, e) for e in (quiet, shift))
    # Believed lower than it is: the floor seems 2 cm times the cosine of the head's pitch too low.
    low = [points[np.abs(points[:, 2]) < 0.05][:, 2].mean() for points in (exact, shifted)]
    assert low[1] - low[0] == pytest.approx(-0.02 * pose.rotation[2, 2], abs=2e-3)
    off = SenseErrors(spindle_rad=0.1, range_noise=0.0)
    rolled = lidar.half_turn(scene, pose, np.random.default_rng(0), region, off)
    assert abs(len(rolled) - len(exact)) < 0.1 * len(exact)
    assert rolled.shape != exact.shape or not np.allclose(rolled, exact)


def test_nothing_wrong_changes_nothing_and_draws_have_their_spread():
    rng = np.random.default_rng(4)
    scene = build(rng)
    pose = head(scene, rng, 1.1)
    plain = lidar.half_turn(scene, pose, np.random.default_rng(0))
    assert (plain == lidar.half_turn(scene, pose, np.random.default_rng(0), errors=SenseErrors())).all()
    assert CALM.senses == SenseErrors()
    drawn = [draw_sense_errors(lambda _, k=k: np.random.default_rng(k), CalibrationSpread()) for k in range(400)]
    turns = np.array([d.camera.turn_rad + d.lidar.turn_rad for d in drawn])
    # 2400 draws: a standard deviation is known to 1.4 %; four times that.
    assert turns.std() == pytest.approx(CalibrationSpread().turn_rad, rel=0.06)
    assert np.mean([d.focal for d in drawn]) == pytest.approx(1.0, abs=4 * 0.003 / 20)


@pytest.mark.slow
def test_study_of_the_table_in_the_docs(capsys):
    """Prints the table of docs/perception.md."""
    with capsys.disabled():
        for level_m in ((1.5, 2.0), (2.0, 3.0), (3.0, 4.0)):
            for look_alike in LOOK_ALIKES:
                kinds = Counter(see_coarse(1000 + i, level_m, look_alike) for i in range(250))
                print("\ncoarse", level_m, look_alike, dict(kinds), end="")
        for level in (0.6, 0.7, 1.1, 1.5, 2.0, 3.0):
            seen = [see_fine(5000 + i, level) for i in range(250)]
            errors = np.nanpercentile(np.array([s[1:] for s in seen]), [50, 90], axis=0) * [100, 57.3, 100]
            print("\nfine", level, dict(Counter(s[0] for s in seen)), "knob cm, yaw deg, foot cm", errors.round(2))
