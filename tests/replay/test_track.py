"""Where everything is between samples: for display, on a straight line."""

import numpy as np
import pytest

from teleop_sim.replay.track import PERIOD_S, Track

Z90 = [np.cos(np.pi / 4), 0.0, 0.0, np.sin(np.pi / 4)]
LEVEL = [1.0, 0.0, 0.0, 0.0]


def track(*rows):
    """Rows of time, x, quaternion, angle."""
    t_s = np.array([row[0] for row in rows])
    pelvis = np.array([[row[1], 0.0, 1.0, *row[2]] for row in rows])
    return Track(("j",), t_s, pelvis, np.array([[row[3]] for row in rows]))


MOVES = track((0.0, 0.0, LEVEL, 0.0), (PERIOD_S, 1.0, Z90, 0.4), (2 * PERIOD_S, 1.0, Z90, 0.4))


def test_a_sample_is_as_it_was_logged():
    for k, t_s in enumerate(MOVES.t_s):
        at = MOVES.at(t_s)
        assert np.array_equal(at.pelvis, MOVES.pelvis[k])
        assert np.array_equal(at.joints, MOVES.joints[k])


def test_half_way_between_two_samples_is_half_way():
    at = MOVES.at(PERIOD_S / 2)
    assert at.pelvis[0] == pytest.approx(0.5)
    assert at.joints[0] == pytest.approx(0.2)
    # By symmetry a normalised mean of two quaternions is the exact middle: 45 degrees.
    assert at.pelvis[3:] == pytest.approx([np.cos(np.pi / 8), 0.0, 0.0, np.sin(np.pi / 8)])


def test_quaternions_take_the_shorter_way_and_stay_of_length_one():
    other = track((0.0, 0.0, LEVEL, 0.0), (PERIOD_S, 0.0, [-q for q in Z90], 0.0))
    for share in np.linspace(0.0, 0.99, 12):
        quat = other.at(share * PERIOD_S).pelvis[3:]
        assert np.linalg.norm(quat) == pytest.approx(1.0)
        assert quat[0] >= Z90[0] - 1e-12


def test_a_waiting_robot_stays_until_one_period_before_its_next_sample():
    waits = track((0.0, 0.0, LEVEL, 0.0), (10.0, 1.0, LEVEL, 1.0))
    assert waits.at(10.0 - PERIOD_S).joints[0] == 0.0
    assert waits.at(10.0 - PERIOD_S / 2).joints[0] == pytest.approx(0.5)


def test_before_the_first_and_after_the_last_sample_nothing_moves():
    assert MOVES.at(-5.0).joints[0] == 0.0
    assert MOVES.at(99.0).joints[0] == 0.4


def test_two_samples_of_one_time_the_later_counts():
    twice = track((0.0, 0.0, LEVEL, 0.0), (1.0, 1.0, LEVEL, 1.0), (1.0, 2.0, LEVEL, 2.0))
    assert twice.at(1.0).joints[0] == 2.0


def test_stirring_is_where_something_changes_and_no_more():
    run = track(
        (0.0, 0.0, LEVEL, 0.0),
        (5.0, 0.0, LEVEL, 0.0),
        (20.0, 0.0, LEVEL, 0.1),
        (20.0 + PERIOD_S, 0.0, LEVEL, 0.2),
        (40.0, 0.0, LEVEL, 0.3),
    )
    assert run.stirring() == [
        pytest.approx((20.0 - PERIOD_S, 20.0 + PERIOD_S)),
        pytest.approx((40.0 - PERIOD_S, 40.0)),
    ]
    assert run.stirring(1.0) == [
        pytest.approx((20.0 - PERIOD_S, 21.0 + PERIOD_S)),
        pytest.approx((40.0 - PERIOD_S, 41.0)),
    ]
    assert len(run.stirring(30.0)) == 1


def test_headings_are_those_of_the_pelvis_until_it_falls():
    down = [np.cos(np.pi / 4), 0.0, np.sin(np.pi / 4), 0.0]  # on its face
    run = track((0.0, 0.0, LEVEL, 0.0), (1.0, 0.0, Z90, 0.0), (2.0, 0.0, down, 0.0))
    assert run.headings_rad == pytest.approx([0.0, np.pi / 2, np.pi / 2])


def test_means_are_those_of_what_is_shown():
    """Against a sum over many times of what ``at`` says."""
    run = track((0.0, 0.0, LEVEL, 0.0), (3.0, 1.0, LEVEL, 0.0), (3.0 + PERIOD_S, 3.0, Z90, 0.0), (9.0, 2.0, LEVEL, 0.0))
    for from_s, to_s in ((-1.0, 1.0), (2.5, 3.1), (0.0, 9.5), (8.9, 12.0)):
        times_s = np.linspace(from_s, to_s, 20_001)
        expected = np.mean([run.at(t).pelvis[0] for t in times_s])
        # A mean of n points of what jumps in slope alone errs by less than its range over n.
        assert run.mean(from_s, to_s)[0] == pytest.approx(expected, abs=2e-4)


def test_a_turn_through_half_a_circle_is_followed_without_a_jump():
    angles = np.linspace(2.8, 3.6, 9)
    rows = [(k * PERIOD_S, 0.0, [np.cos(a / 2), 0.0, 0.0, np.sin(a / 2)], 0.0) for k, a in enumerate(angles)]
    headings = [track(*rows).mean(t, t + 0.2)[3] for t in np.arange(0.0, 1.4, 0.1)]
    assert np.abs(np.diff(headings)).max() < 0.06
