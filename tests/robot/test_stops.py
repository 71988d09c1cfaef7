"""A robot that is stopped at any time comes to rest, stands, and can walk on from wherever its feet are."""

from collections.abc import Iterator

import numpy as np
import pytest

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Stop, Walk
from teleop_sim.robot.episode import REST_SPEED, Episode, NoiseKey, perform
from teleop_sim.robot.valkyrie import valkyrie
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import Plant

KEY = NoiseKey(1, 0, 1)


@pytest.fixture(scope="module")
def body() -> Body:
    spec = valkyrie()
    return Body(spec, Plant(spec.model, BareFloor(0.6)))


def walks_and_stops(body: Body, seed: int, count: int) -> Iterator[tuple[Walk, Episode, Episode]]:
    """Walks to places within 2.4 m, each cut at a random time and stopped; each begins where the last one stopped."""
    rng, state = np.random.default_rng(seed), body.standing()
    for _ in range(count):
        goal = (float(rng.uniform(0.0, 2.4)), float(rng.uniform(-0.3, 0.3)), float(rng.uniform(-3.0, 3.0)))
        cut = perform(body, Walk((goal,)), state, KEY, until_s=round(float(rng.uniform(0.2, 9.0)), 2))
        stopped = perform(body, Stop(), cut.end, KEY)
        yield Walk((goal,)), cut, stopped
        state = stopped.end


# Seed 4 fell in its third walk when the foot behind was not brought up first.
@pytest.mark.parametrize("seed", [2, 4])
def test_it_walks_on_from_every_stance_that_a_stop_leaves(body: Body, seed: int) -> None:
    for walk, cut, stopped in walks_and_stops(body, seed, 5):
        assert (cut.outcome, stopped.outcome) == ("cut", "stopped"), (walk, stopped.cause)
        body.load(stopped.end)
        assert body.speed() < REST_SPEED
    last = perform(body, walk, stopped.end, KEY)
    assert last.outcome == "reached"
    # A goal counts as reached within 10 cm (WPI: isGoalReached).
    assert last.data < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10, 30))
def test_stops_at_any_time(body: Body, seed: int) -> None:
    for walk, cut, stopped in walks_and_stops(body, seed, 8):
        assert (cut.outcome, stopped.outcome) in {("cut", "stopped"), ("reached", "stopped")}, (walk, stopped.cause)
