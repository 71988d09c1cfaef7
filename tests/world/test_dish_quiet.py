"""Samples that the scorer says it can be spared change nothing: scored with and without them, all is equal."""

import numpy as np
import pytest

from teleop_sim.world import dish_layout as lay
from teleop_sim.world.dish_scorer import TICK_S, DishTask, ScorerState, advance, quiet

LAYOUT = lay.layout(2)
TASK = DishTask(
    lay.checkpoint_1(LAYOUT.dish), LAYOUT.finish, yaw_target_rad=0.4, pitch_target_rad=-0.3, time_limit_s=90.0
)
SAMPLES = 5000


def story(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A robot that passes the console's square and the finish, wheels that pass their tolerances and stay in them."""
    rng = np.random.default_rng(seed)
    t_s = 1.3 + TICK_S * np.arange(1, SAMPLES + 1)
    console, finish = np.array(TASK.checkpoint_1[:2]), np.array(TASK.finish[:2])
    stops = np.array([[0.0, 0.0], console, console, finish, finish]) + rng.normal(0.0, 0.3, (5, 2))
    share = np.linspace(0.0, 4.0, SAMPLES)
    xy = np.stack([np.interp(share, np.arange(5), stops[:, i]) for i in (0, 1)], axis=1)
    # Between looks the wheels are anywhere within twice the tolerance of 5 degrees.
    knots = np.linspace(0.0, 4.0, 9)
    off = [np.interp(share, knots, np.repeat(rng.uniform(-0.17, 0.17, 3), 3)) for _ in range(2)]
    return t_s, xy, 0.4 + off[0], -0.3 + off[1]


@pytest.mark.parametrize("seed", range(12))
def test_spared_samples_change_nothing(seed):
    t_s, xy, yaw, pitch = story(seed)
    every, all_events = ScorerState(TASK), []
    few, few_events, asked, k = ScorerState(TASK), [], 0, 0
    for i in range(SAMPLES):
        every, seen = advance(every, float(t_s[i]), tuple(map(float, xy[i])), float(yaw[i]), float(pitch[i]))
        all_events += [(i, event) for event in seen]
    while True:
        k += quiet(few, t_s[k:], xy[k:], yaw[k:], pitch[k:])
        if k == SAMPLES:
            break
        few, seen = advance(few, float(t_s[k]), tuple(map(float, xy[k])), float(yaw[k]), float(pitch[k]))
        few_events += [(k, event) for event in seen]
        k, asked = k + 1, asked + 1
    assert (few, few_events) == (every, all_events)
    # Each sample that is asked about brings an event here: nothing else is not spared.
    assert asked <= len(few_events)


def test_a_sample_at_the_edge_of_a_square_is_not_spared():
    x, y, _ = lay.compose(TASK.checkpoint_1, (lay.CHECKPOINT_SIDE_M / 2, 0.0, 0.0))
    at = np.array([[x, y]])
    assert quiet(ScorerState(TASK), np.array([1.0]), at, np.zeros(1), np.zeros(1)) == 0


def test_no_samples_are_no_trouble():
    for checkpoint in range(4):
        empty = np.zeros(0)
        assert quiet(ScorerState(TASK, checkpoint=checkpoint), empty, np.zeros((0, 2)), empty, empty) == 0
