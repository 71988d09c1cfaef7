"""What a half turn of the LIDAR has on a hand: a ball with known surfaces, seen by sensors that sit otherwise."""

from __future__ import annotations

import numpy as np
import pytest

from teleop_sim.robot.perception.lidar import MODELS, NOISE_SD_M, hand_points
from teleop_sim.robot.perception.rays import SensorPose
from teleop_sim.world.sense_errors import Misalignment, SenseErrors

POSE = SensorPose(np.eye(3), np.array([0.0, 0.0, 1.7]))
TOOL_M = (0.6, 0.2, 1.1)
BALL_M = 0.08
QUIET = SenseErrors(range_noise=0.0)


class Ball:
    """A robot that is nothing but a ball for a hand, and perhaps a board in front of it, which is of the world."""

    def __init__(self, board_x_m: float = np.inf) -> None:
        self.board_x_m = board_x_m

    def cast_robot(self, origin, directions, _cutoff_m, _frame, alone):
        to = np.array(TOOL_M) - origin
        along = directions @ to
        inside = BALL_M**2 - (to @ to - along**2)
        distance = np.where((inside > 0.0) & (along > 0.0), along - np.sqrt(np.maximum(inside, 0.0)), -1.0)
        surface = np.where(distance > 0.0, 7, -1)
        with np.errstate(divide="ignore"):
            board = (self.board_x_m - origin[0]) / directions[:, 0]
        hidden = (distance > board) & (board > 0.0) & (not alone)
        return np.where(hidden, board, distance), np.where(hidden, 3, surface)

    def on_hand(self, geoms, side):
        return (geoms == 7) & (side == "left")


def points(errors=QUIET, ball=None, side="left", seed=1):
    return hand_points(ball or Ball(), "lidar", POSE, TOOL_M, side, np.random.default_rng(seed), errors)


def test_a_sensor_that_sits_where_it_is_believed_to_sees_the_surface_that_the_model_has():
    found = points()
    assert found.model.shape == (MODELS, *found.seen.shape)
    np.testing.assert_allclose(np.linalg.norm(found.seen - TOOL_M, axis=1), BALL_M, atol=1e-9)
    # Eight draws of a centimetre for each point: 3.5 mm left along the ray, four standard deviations.
    assert np.abs(np.linalg.norm(found.model.mean(axis=0) - found.seen, axis=1)).max() < 5 * NOISE_SD_M / MODELS**0.5


@pytest.mark.parametrize("shift_m", [(0.03, 0.0, 0.0), (0.0, 0.04, 0.0), (0.0, -0.02, 0.03)])
def test_a_sensor_that_sits_elsewhere_shows_the_hand_as_far_off_the_other_way(shift_m):
    found = points(SenseErrors(lidar=Misalignment(shift_m=shift_m), range_noise=0.0))
    offset = found.seen.mean(axis=0) - found.model.mean(axis=(0, 1))
    # It sees another part of the ball, turned by 4 cm over 0.9 m: 4 mm of the ball's radius.
    assert offset == pytest.approx(-np.array(shift_m), abs=0.004)


def test_a_sensor_that_is_turned_shows_it_turned_back():
    turn = np.array([0.0, 0.0, 0.05])
    found = points(SenseErrors(lidar=Misalignment(turn_rad=tuple(turn)), range_noise=0.0))
    offset = found.seen.mean(axis=0) - found.model.mean(axis=(0, 1))
    want = -np.cross(turn, np.array(TOOL_M) - POSE.position)
    # Second order in the angle, 1 mm, and the model's noise.
    assert offset == pytest.approx(want, abs=0.003)


def test_what_is_in_front_of_the_hand_hides_it_and_the_model_does_not_know():
    whole, hidden = points(), points(ball=Ball(board_x_m=0.4))
    half = points(ball=Ball(board_x_m=0.56))
    assert len(hidden.seen) == 0
    assert hidden.model.shape == whole.model.shape
    assert 0 < len(half.seen) < len(whole.seen)


def test_the_other_hand_is_another_hand():
    assert points(side="right").seen.size == points(side="right").model.size == 0


def test_noise_is_a_function_of_the_stream():
    noisy = SenseErrors()
    a, b, c = points(noisy), points(noisy), points(noisy, seed=2)
    assert a.seen.tobytes() == b.seen.tobytes()
    assert a.model.tobytes() == b.model.tobytes()
    assert a.seen.tobytes() != c.seen.tobytes()
