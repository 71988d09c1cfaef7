"""Rules of the scorer: osrf/srcsim 0.8.0, SatellitePlugin.cc and Task1.cc."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.core.streams import stream
from teleop_sim.world import dish_layout as lay
from teleop_sim.world import dish_scorer as scorer
from teleop_sim.world.dish_draw import DishSettings, draw_dish_world
from teleop_sim.world.dish_scorer import DishTask, ScorerState, advance, next_event_s, status

LAYOUT = lay.layout(1)
AT_CONSOLE = lay.checkpoint_1(LAYOUT.dish)[:2]
AWAY = (0.0, 0.0)
TASK = DishTask(lay.checkpoint_1(LAYOUT.dish), LAYOUT.finish, yaw_target_rad=1.0, pitch_target_rad=0.5)
ONE = ScorerState(TASK, checkpoint=1)
TICK = scorer.TICK_S
HOLD_TICKS = 250


def play(state, stretches):
    """Feed stretches of (ticks, yaw, pitch) from time 0 on, a sample a tick; what was scored at which tick."""
    tick, scored = 0, {}
    for ticks, yaw, pitch in stretches:
        for _ in range(ticks):
            before = state.checkpoint
            state, _ = advance(state, tick * TICK, AT_CONSOLE, yaw, pitch)
            scored |= dict.fromkeys(range(before + 1, state.checkpoint + 1), tick)
            tick += 1
    return state, scored


def test_a_whole_task_in_order():
    state = ScorerState(TASK)
    assert status(state, 0.0, 0.0, 0.0) == {}
    state, events = advance(state, 0.0, AWAY, 1.0, 0.5)
    assert (state.checkpoint, events, state.yaw_since_s) == (0, (), None)
    state, events = advance(state, 1.0, AT_CONSOLE, 0.0, 0.5)
    assert [e.text for e in events] == ["checkpoint 1: in front of the console", "dish pitch came into tolerance"]
    state, events = advance(state, 6.0, AT_CONSOLE, 1.0, 0.5)
    assert state.checkpoint == 1, "exactly 5 s is not longer than 5 s"
    state, events = advance(state, 6.02, AT_CONSOLE, 1.0, 0.5)
    assert events == (scorer.ScoreEvent(2, "checkpoint 2: dish pitch held"),)
    told = status(state, 6.02, 1.0, 0.5)
    assert (told["yaw_ok"], told["yaw_done"], told["pitch_done"], told["checkpoint"]) == (1.0, 0.0, 1.0, 2.0)
    state, events = advance(state, 11.02, AT_CONSOLE, 1.0, 0.5)
    assert state.checkpoint == 3
    # The dish is not tested any more.
    state, events = advance(state, 12.0, AWAY, 0.0, 0.0)
    assert (state.checkpoint, events) == (3, ())
    state, events = advance(state, 30.0, LAYOUT.finish[:2], 0.0, 0.0)
    assert (state.checkpoint, state.outcome) == (4, "completed")
    assert advance(state, 31.0, AWAY, 1.0, 0.5) == (state, ())
    assert next_event_s(state, 31.0) == math.inf


def test_the_finish_counts_only_after_the_dish():
    state, events = advance(ONE, 0.0, LAYOUT.finish[:2], 0.0, 0.0)
    assert (state.checkpoint, events) == (1, ())


def test_both_axes_must_be_held_at_the_same_time():
    # Each was done once, never together: flags are not latched, checkpoints are.
    state, scored = play(ONE, [(300, 0.0, 0.5), (300, 1.0, 0.0), (300, 0.0, 0.5)])
    assert (state.checkpoint, scored) == (2, {2: HOLD_TICKS + 1})


def test_both_axes_held_from_the_start_score_two_checkpoints_at_once():
    # World 2 of the finals: both targets within 5 degrees of zero.
    state, scored = play(ONE, [(300, 1.0, 0.5)])
    assert (state.checkpoint, scored) == (3, {2: HOLD_TICKS + 1, 3: HOLD_TICKS + 1})


@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(0, HOLD_TICKS + 1), st.integers(1, 20), st.booleans()), max_size=6))
def test_holding_less_than_five_seconds_never_scores(stretches):
    held = [(ticks, 1.0 if yaw else 0.0, 0.0 if yaw else 0.5) for ticks, _, yaw in stretches]
    left = [(gap, 0.0, 0.0) for _, gap, _ in stretches]
    # HOLD_TICKS + 1 samples span exactly 5 s.
    state, scored = play(ONE, [part for pair in zip(held, left, strict=True) for part in pair])
    assert (state.checkpoint, scored) == (1, {})


@settings(deadline=None)
@given(st.integers(0, 400), st.integers(HOLD_TICKS + 2, 400))
def test_leaving_starts_the_hold_again(before, after):
    _, scored = play(ONE, [(min(before, HOLD_TICKS), 1.0, 0.0), (1, 0.0, 0.0), (after, 1.0, 0.0)])
    assert scored == {2: min(before, HOLD_TICKS) + 1 + HOLD_TICKS + 1}


@given(st.floats(-0.3, 0.3))
def test_tolerance_is_five_degrees(error):
    state, _ = advance(ONE, 0.0, AT_CONSOLE, 1.0 + error, 0.0)
    assert (state.yaw_since_s is not None) == (abs((1.0 + error) - 1.0) < math.radians(5.0))


@given(st.floats(0.0, 1000.0), st.floats(0.0, 6.0), st.booleans())
def test_a_frozen_robot_scores_as_if_every_tick_were_sampled(start_s, frozen_after_s, both):
    pose = (1.0, 0.5 if both else 0.0)
    state, _ = advance(ONE, start_s, AT_CONSOLE, *pose)
    now = start_s + min(frozen_after_s, 4.9)
    due = next_event_s(state, now)
    assert due == pytest.approx(start_s + 5.02, abs=1e-9)
    early, _ = advance(state, due - 2 * TICK, AT_CONSOLE, *pose)
    on_time, _ = advance(state, due, AT_CONSOLE, *pose)
    assert (early.checkpoint, on_time.checkpoint) == (1, 3 if both else 2)
    # What is done brings no further event but the time limit.
    assert next_event_s(on_time, due) == 1800.0


def test_nothing_is_scored_at_the_time_limit():
    late = replace(ONE, yaw_since_s=1790.0)
    state, events = advance(late, 1800.0, AT_CONSOLE, 1.0, 0.5)
    assert (state.checkpoint, state.outcome, [e.text for e in events]) == (1, "timed_out", ["time limit"])
    assert next_event_s(state, 1800.0) == math.inf
    assert next_event_s(ScorerState(TASK), 3.0) == 1800.0


def test_the_scorer_knows_the_drawn_world():
    world = draw_dish_world(lambda name: stream(1, 0, name), DishSettings(layout_id=3))
    task = scorer.start(world).task
    assert (task.yaw_target_rad, task.pitch_target_rad) == world.targets_rad
    assert task.finish[:2] == lay.layout(3).finish[:2]
    # The console is moved by up to 3 cm each way and turned by 2 degrees: 2.4 m away that is 13 cm at most.
    assert math.dist(task.checkpoint_1[:2], lay.checkpoint_1(lay.layout(3).dish)[:2]) < 0.13
