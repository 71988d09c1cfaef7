"""Camera and LIDAR against closed forms, in worlds made of a plane and a ball."""

from __future__ import annotations

import colorsys
import json
from dataclasses import dataclass
from importlib import resources

import numpy as np
import pytest

from teleop_sim.robot.perception import camera, coarse, colours, lidar
from teleop_sim.robot.perception.rays import Light, SensorPose, upright

NOON = Light((0.0, 0.0, 1.0), (0.6, 0.6, 0.6), 0.3)


@dataclass
class Ball:
    """A ball over a plain floor at z = 0 (left out when ``floor`` is false). Implements ``Rays``."""

    centre: tuple[float, float, float]
    radius: float
    floor: bool = True
    speckled: bool = False

    def cast(self, origin, directions, cutoff_m):
        to = origin - np.array(self.centre)
        b, c = directions @ to, to @ to - self.radius**2
        root = np.sqrt(np.maximum(b * b - c, 0.0))
        near = np.where(-b - root > 1e-9, -b - root, -b + root)
        ball = np.where((b * b >= c) & (near > 0), near, np.inf)
        fall = np.where(directions[:, 2] < 0, -origin[2] / np.minimum(directions[:, 2], -1e-12), np.inf)
        floor = fall if self.floor else np.full(len(directions), np.inf)
        distance = np.minimum(ball, floor)
        geoms = np.where(ball < floor, 1, 0).astype(np.int32)
        missed = distance > cutoff_m
        normal = np.where(
            (geoms == 1)[:, None],
            (origin + directions * np.where(missed, 1, distance)[:, None]) - self.centre,
            [0, 0, 1],
        )
        normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        return np.where(missed, -1.0, distance), np.where(missed, -1, geoms).astype(np.int32), normal

    def colour(self, geoms):
        return np.array([[0.5, 0.5, 0.5], [0.8, 0.1, 0.1]])[geoms]

    def textured(self, geoms):
        return (geoms == 0) & self.speckled


def looking(pitch, height=2.0):
    c, s = np.cos(pitch), np.sin(pitch)
    return SensorPose(np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]), np.array([0.0, 0.0, height]))


def test_field_of_view_is_the_cameras():
    d = camera.pixel_directions(320, 170).reshape(170, 320, 3)
    half = np.arctan(-d[0, -1, 1] / d[0, -1, 0] * 320 / 319)  # to the image's edge, half a pixel on
    assert 2 * half == pytest.approx(camera.FIELD_RAD, abs=1e-12)
    assert d[0, 0, 1] > 0  # the first pixel is up and on the left
    assert d[0, 0, 2] > 0
    assert np.linalg.norm(d, axis=-1) == pytest.approx(1.0)


def test_floor_sky_and_shadow_have_the_brightness_of_the_light():
    rays = Ball((4.0, 0.0, 1.0), 0.5)
    pose = looking(0.2)
    rng = np.random.default_rng(0)
    image = np.mean([camera.take(rays, pose, NOON, rng) for _ in range(8)], axis=0) / 255.0

    def at(point):
        way = (np.array(point) - pose.position) @ pose.rotation
        f = camera.focal_px(320)
        return image[int(85 - f * way[2] / way[0]), int(160 - f * way[1] / way[0])]

    # Noise 0.007 over 8 images, and rounding to 1/255: four standard deviations are 0.012.
    assert at((4.0, 1.5, 0.0)) == pytest.approx([0.5 * (0.3 + 0.6)] * 3, abs=0.012)
    assert at((4.0, 0.47, 0.0)) == pytest.approx([0.5 * 0.3] * 3, abs=0.012)  # shaded by the ball
    assert at((4.0, 0.0, 1.5)) == pytest.approx(0.9 * np.array([0.8, 0.1, 0.1]), abs=0.012)
    assert at((50.0, 10.0, 8.0)) == pytest.approx(0.6 * np.array(camera.SKY), abs=0.012)


def test_pixel_noise_has_the_cameras_standard_deviation():
    rays, rng = Ball((4.0, 0.0, 1.0), 0.5), np.random.default_rng(1)
    pair = [camera.take(rays, looking(1.2), NOON, rng).astype(float) for _ in range(2)]
    sd = np.std(pair[0] - pair[1]) / np.sqrt(2) / 255.0
    # Rounding adds a variance of 1/12 of a step; 163,200 samples: 0.2 %.
    assert sd == pytest.approx(np.hypot(camera.NOISE_SD, 1 / 255 / np.sqrt(12)), rel=0.01)


def test_speckles_stay_on_the_ground_and_within_their_range():
    rays = Ball((9.0, 9.0, 1.0), 0.1, speckled=True)
    a, b = (camera.take(rays, looking(1.5), NOON, np.random.default_rng(s)).astype(int) for s in (1, 2))
    assert np.abs(a - b).max() < 20  # noise only: eleven standard deviations of a difference
    assert 0.45 * 0.75 * 255 - 10 < a.min() < a.max() < 0.45 * 1.15 * 255 + 10
    assert a.std() > 8  # uniform over 0.4 of 115: 13, less what pixels of one grain share


def test_upright_turns_the_heads_frames_over():
    text = resources.files("teleop_sim.robot").joinpath("valkyrie.json").read_text()
    frames = {f["name"]: f for f in json.loads(text)["frames"]}
    for name in ("left_camera_frame", "head_hokuyo_frame"):
        roll, pitch, yaw = frames[name]["rpy"]
        assert yaw == 0.0
        about_x = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
        level = upright(looking(pitch).rotation @ about_x)
        # The frames' roll is pi to five digits.
        assert level == pytest.approx(looking(pitch).rotation, abs=1e-5)
        assert np.linalg.det(level) == pytest.approx(1.0)


def test_half_a_turn_is_the_spindles():
    assert pytest.approx(lidar.HALF_TURN_S, abs=1e-3) == 3.927  # half of 2 pi over the 0.8 rad/s of init.py
    d = lidar.half_turn_directions()
    assert len(d) == 157 * 1081
    assert np.linalg.norm(d, axis=1) == pytest.approx(1.0)
    assert d[:, 0].min() == pytest.approx(np.cos(np.radians(135.0)))


def test_half_a_turn_leaves_no_gap_in_front():
    d = lidar.half_turn_directions()
    rng = np.random.default_rng(0)
    probe = rng.normal(size=(300, 3))
    probe /= np.linalg.norm(probe, axis=1, keepdims=True)
    probe = probe[probe[:, 0] > np.cos(np.radians(134.0))]
    # Scans are 0.02 rad apart, samples 0.0044: half their diagonal is 0.0102. Where the half turn closes, a fan's
    # end has turned on by 0.015 rad since its beginning: half of 0.036 there.
    nearest = np.arccos((probe @ d.T).max(axis=1))
    assert np.quantile(nearest, 0.9) < 0.0125
    assert nearest.max() < 0.0185


def test_the_spindle_turns_while_the_mirror_sweeps():
    d = lidar.half_turn_directions().reshape(157, 1081, 3)
    roll = np.arctan2(d[:, :, 2], d[:, :, 1])
    # Samples 100 and 980 are on opposite sides: half a turn apart but for what the spindle has done in between.
    between = (roll[0, 980] - roll[0, 100] + np.pi) % (2 * np.pi)
    seconds = 0.75 / 40 * 880 / 1080  # the mirror needs 3/4 of a period for its 270 degrees
    assert min(between, 2 * np.pi - between) == pytest.approx(0.8 * seconds, rel=1e-9)
    assert (roll[7, 900] - roll[6, 900]) == pytest.approx(0.8 / 40, rel=1e-9)


def test_thinning_keeps_a_quarter_and_shrinks_no_direction_to_nothing():
    keep = lidar.thinned()
    # 40 of 157 scans are kept near the axis, 271 of 1081 samples elsewhere: 0.2548 and 0.2507.
    assert keep.mean() == pytest.approx(0.25, abs=0.005)
    d, rng = lidar.half_turn_directions()[keep], np.random.default_rng(0)
    probe = rng.normal(size=(300, 3))
    probe /= np.linalg.norm(probe, axis=1, keepdims=True)
    probe = probe[probe[:, 0] > np.cos(np.radians(134.0))]
    # Near the axis scans are 0.08 rad apart, but 30 degrees off it only half as much.
    assert np.arccos((probe @ d.T).max(axis=1)).max() < 0.025


def test_range_noise_in_a_hollow_ball():
    hollow, pose = Ball((0.0, 0.0, 2.0), 3.0, floor=False), looking(0.3)
    points = lidar.half_turn(hollow, pose, np.random.default_rng(3))
    assert len(points) == 157 * 1081
    off = np.linalg.norm(points - pose.position, axis=1) - 3.0
    # 169,717 draws: mean to 1e-4 (four standard deviations), spread to 0.7 %.
    assert off.mean() == pytest.approx(0.0, abs=1e-4)
    assert off.std() == pytest.approx(lidar.NOISE_SD_M, rel=0.007)


def test_nothing_nearer_or_farther_than_the_range():
    pose, rng = looking(0.0), np.random.default_rng(0)
    assert len(lidar.half_turn(Ball((0.0, 0.0, 2.0), 0.05, floor=False), pose, rng)) == 0
    assert len(lidar.half_turn(Ball((0.0, 0.0, 2.0), 31.0, floor=False), pose, rng)) == 0


def test_a_region_is_seen_as_densely_as_without_it():
    rays, pose, region = Ball((1.5, 0.0, 0.9), 0.3), looking(0.5), (1.5, 0.0, 0.9)

    def near(points):
        return int((np.linalg.norm(points - np.array(region), axis=1) < lidar.REGION_RADIUS_M - 0.05).sum())

    whole = lidar.half_turn(rays, pose, np.random.default_rng(0))
    part = lidar.half_turn(rays, pose, np.random.default_rng(0), region)
    assert near(part) == near(whole)
    assert len(part) < 0.6 * len(whole)


def test_stereo_depth_follows_the_formula():
    f, z = camera.focal_px(320), np.array([1.0, 2.0, 4.0])
    assert coarse.depth_error(z, f, np.zeros(3)) == pytest.approx(z)
    small = 1e-6
    slope = (coarse.depth_error(z, f, np.full(3, small)) - z) / small
    # The next term of the series is z e / (f B): 3e-7 of the first.
    assert slope == pytest.approx(-(z**2) / (f * camera.BASELINE_M), rel=1e-5)
    # A disparity lost altogether leaves a point far away, not behind the camera.
    assert (coarse.depth_error(z, f, np.full(3, -1e3)) == f * camera.BASELINE_M / coarse.LEAST_DISPARITY_PX).all()


def test_colours_equal_the_standard_librarys():
    rgb = np.random.default_rng(0).random((200, 3)).round(1)
    ours = np.stack(colours.hue_saturation_value(rgb), axis=1) / [360.0, 1.0, 1.0]
    assert ours == pytest.approx(np.array([colorsys.rgb_to_hsv(*c) for c in rgb]), abs=1e-12)


@pytest.mark.parametrize("light", [1.0, 0.35, 0.15])
def test_bands_take_the_wheels_and_leave_soil_and_walkway(light):
    # Colours of console and soil as the world draws them, bright to shaded, under a white and a warm sun.
    def seen(rgb, band):
        for sun in ((1.0, 1.0, 1.0), (1.0, 0.86, 0.65)):
            shade = np.clip(255 * light * np.array(rgb) * sun, 0, 255).astype(np.uint8)
            yield bool(colours.mask_of(np.full((9, 9, 3), shade, np.uint8), band).all())

    assert all(seen((0.75, 0.05, 0.05), colours.RED))
    assert all(seen((0.06, 0.10, 0.75), colours.BLUE))
    for rgb in ((0.55, 0.36, 0.24), (0.62, 0.62, 0.60), (0.42, 0.43, 0.45)):
        assert not any(seen(rgb, colours.RED))
        assert not any(seen(rgb, colours.BLUE))


def test_no_wheels_no_glimpse():
    rng = np.random.default_rng(0)
    assert coarse.detect(Ball((9.0, 9.0, 1.0), 0.1), looking(0.8), NOON, rng) == (None, "no red")
    assert coarse.detect(Ball((3.0, 0.0, 1.0), 0.3), looking(0.3), NOON, rng) == (None, "no blue")
