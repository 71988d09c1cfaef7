"""Keys of the viewer, and its time."""

import pytest

from teleop_sim.replay.play import words
from teleop_sim.replay.player import END, FASTEST, HOME, LEFT, RIGHT, SEEK_S, SLOWEST, SPACE, Player
from teleop_sim.replay.telling import Telling

PLAYER = Player(10.0, 100.0, 50.0)
PLUS, MINUS = ord("="), ord("-")


def test_time_goes_on_with_the_speed_and_stops_at_the_end():
    assert PLAYER.after(2.0).t_s == 52.0
    assert Player(10.0, 100.0, 50.0, speed=4.0).after(2.0).t_s == 58.0
    assert PLAYER.after(1e6).t_s == 100.0


def test_space_pauses_and_goes_on():
    paused = PLAYER.pressed(SPACE)
    assert paused.after(2.0).t_s == 50.0
    assert paused.pressed(SPACE).after(2.0).t_s == 52.0


def test_space_at_the_end_begins_again():
    over = PLAYER.after(1e6).pressed(SPACE)
    assert (over.t_s, over.paused) == (10.0, False)


def test_arrows_go_back_and_ahead_within_what_is_played():
    assert PLAYER.pressed(RIGHT).t_s == 50.0 + SEEK_S
    assert PLAYER.pressed(LEFT).t_s == 50.0 - SEEK_S
    assert PLAYER.at(98.0).pressed(RIGHT).t_s == 100.0
    assert (PLAYER.pressed(HOME).t_s, PLAYER.pressed(END).t_s) == (10.0, 100.0)


def test_plus_and_minus_double_and_halve_within_limits():
    assert PLAYER.pressed(PLUS).speed == 2.0
    assert PLAYER.pressed(MINUS).speed == 0.5
    fast, slow = PLAYER, PLAYER
    for _ in range(20):
        fast, slow = fast.pressed(PLUS), slow.pressed(MINUS)
    assert (fast.speed, slow.speed) == (FASTEST, SLOWEST)


@pytest.mark.parametrize("key", [0, ord("A"), 256, 290])
def test_other_keys_do_nothing(key):
    assert PLAYER.pressed(key) == PLAYER


def test_the_window_tells_time_speed_and_keys(door):
    left, right = words(PLAYER, Telling.of(door.log).at(50.0))
    assert left.split("\n") == ["time", "state", "robot", "crew", "link", "log", "keys"]
    assert len(right.split("\n")) == 7
    assert right.startswith("0:50.0 (1x)")
    assert "space: pause" in right
