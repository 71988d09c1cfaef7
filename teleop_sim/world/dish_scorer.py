"""The scorer of SRC task 1: four checkpoints, a hold timer for each dish axis, a time limit. Pure functions.

Rules: 1 pelvis in the 1 m square before the console; 2 either dish axis held within 5 degrees for more than 5 s;
3 both held so at the same time; 4 pelvis in the finish square. A checkpoint once scored stays; an axis that leaves its
tolerance starts its 5 s again. The dish is not tested before checkpoint 1, and no longer after checkpoint 3.

Not modelled: penalties, skips and restarts; the free time inside the start square (the clock runs from 0).

Source: osrf/srcsim 0.8.0 (commit 2225f67), SatellitePlugin.cc and Task1.cc; limits: unique.world.erb.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from teleop_sim.world import dish_layout as lay
from teleop_sim.world.console import SQUARE_M
from teleop_sim.world.dish_draw import DishWorld
from teleop_sim.world.dish_layout import Planar

TOLERANCE_RAD = math.radians(5.0)
HOLD_S = 5.0
TIME_LIMIT_S = 1800.0
TICK_S = 0.02
"""Longest time between two samples of a robot that acts."""
LAST_CHECKPOINT = 4
# Times are sums of ticks: without it, rounding could make exactly 5 s look longer than 5 s.
_ROUNDING_S = 1e-6


@dataclass(frozen=True, slots=True)
class DishTask:
    """What is scored: the places, the dish angles to reach, the time limit."""

    checkpoint_1: Planar
    finish: Planar
    yaw_target_rad: float
    pitch_target_rad: float
    time_limit_s: float = TIME_LIMIT_S


@dataclass(frozen=True, slots=True)
class ScorerState:
    """Where the scoring stands.

    Attributes:
        task: what is scored.
        checkpoint: the last one scored, 0 to 4.
        yaw_since_s: since when the dish's yaw has been in tolerance (None: it is not).
        pitch_since_s: likewise for its pitch.
        outcome: how the task stands.

    """

    task: DishTask
    checkpoint: int = 0
    yaw_since_s: float | None = None
    pitch_since_s: float | None = None
    outcome: Literal["running", "completed", "timed_out"] = "running"


@dataclass(frozen=True, slots=True)
class ScoreEvent:
    """Something the scorer saw; ``checkpoint`` is the last one scored by then."""

    checkpoint: int
    text: str


def start(world: DishWorld, time_limit_s: float = TIME_LIMIT_S) -> ScorerState:
    """The scorer of a world before anything happened."""
    yaw, pitch = world.targets_rad
    return ScorerState(DishTask(lay.checkpoint_1(world.dish), world.finish, yaw, pitch, time_limit_s))


def advance(
    state: ScorerState, t_s: float, pelvis_xy: tuple[float, float], dish_yaw_rad: float, dish_pitch_rad: float
) -> tuple[ScorerState, tuple[ScoreEvent, ...]]:
    """Take one sample; samples must come in the order of time.

    Several checkpoints may be scored by one sample, in their order. At the time limit nothing is scored any more.
    """
    if state.outcome != "running":
        return state, ()
    if t_s >= state.task.time_limit_s:
        return replace(state, outcome="timed_out"), (ScoreEvent(state.checkpoint, "time limit"),)
    events: list[ScoreEvent] = []
    if state.checkpoint == 0 and lay.inside(state.task.checkpoint_1, lay.CHECKPOINT_SIDE_M, *pelvis_xy):
        state = _score(state, events, "in front of the console")
    if 1 <= state.checkpoint <= 2:
        state = _time_axes(state, t_s, dish_yaw_rad, dish_pitch_rad, events)
        yaw, pitch = _held(state.yaw_since_s, t_s), _held(state.pitch_since_s, t_s)
        if state.checkpoint == 1 and (yaw or pitch):
            state = _score(state, events, f"dish {'yaw' if yaw else 'pitch'} held")
        if state.checkpoint == 2 and yaw and pitch:
            state = _score(state, events, "dish yaw and pitch held")
    if state.checkpoint == 3 and lay.inside(state.task.finish, SQUARE_M, *pelvis_xy):
        state = replace(_score(state, events, "in the finish square"), outcome="completed")
    return state, tuple(events)


def quiet(
    state: ScorerState, t_s: np.ndarray, pelvis_xy: np.ndarray, dish_yaw_rad: np.ndarray, dish_pitch_rad: np.ndarray
) -> int:
    """How many of these samples, (n,), (n, 2), (n,), (n,), from the first on, ``advance`` can be spared.

    Each of them would leave the state equal and bring no event. Never too many: a sample at the very edge of a square,
    where rounding could decide, is not spared.
    """
    if state.outcome != "running":
        return len(t_s)
    told = t_s >= state.task.time_limit_s
    if state.checkpoint == 0:
        told = told | _near(state.task.checkpoint_1, lay.CHECKPOINT_SIDE_M, pelvis_xy)
    elif state.checkpoint <= 2:
        told = told | _axes_tell(state, t_s, dish_yaw_rad, dish_pitch_rad)
    else:
        told = told | _near(state.task.finish, SQUARE_M, pelvis_xy)
    return int(np.argmax(told)) if told.any() else len(t_s)


def _near(box: Planar, side_m: float, xy: np.ndarray) -> np.ndarray:
    """Whether points (n, 2) are in a square, edges and a hair's breadth more included."""
    c, s = math.cos(box[2]), math.sin(box[2])
    x, y = xy[:, 0] - box[0], xy[:, 1] - box[1]
    edge_m = 0.5 * side_m + 1e-6
    near: np.ndarray = (np.abs(c * x + s * y) <= edge_m) & (np.abs(c * y - s * x) <= edge_m)
    return near


def _axes_tell(state: ScorerState, t_s: np.ndarray, yaw_rad: np.ndarray, pitch_rad: np.ndarray) -> np.ndarray:
    """Whether an axis comes into its tolerance or leaves it, or a hold is full, at samples (n,)."""
    off = np.abs(np.stack([yaw_rad - state.task.yaw_target_rad, pitch_rad - state.task.pitch_target_rad]))
    since = np.array([math.nan if x is None else x for x in (state.yaw_since_s, state.pitch_since_s)])[:, None]
    turns = (off < TOLERANCE_RAD) == np.isnan(since)
    # An axis that is not in tolerance has no start of its hold: NaN compares false.
    held = t_s - since > HOLD_S + _ROUNDING_S
    full = held.any(axis=0) if state.checkpoint == 1 else held.all(axis=0)
    tell: np.ndarray = turns.any(axis=0) | full
    return tell


def next_event_s(state: ScorerState, t_s: float) -> float:
    """When a robot that stays frozen from ``t_s`` on must be sampled next for the score to be right.

    A hold is found one tick after its 5 s are full, as it would be if every tick were sampled.
    """
    if state.outcome != "running":
        return math.inf
    times = [state.task.time_limit_s]
    if 1 <= state.checkpoint <= 2:
        since = (state.yaw_since_s, state.pitch_since_s)
        times += [start_s + HOLD_S + TICK_S for start_s in since if start_s is not None]
    return min((time_s for time_s in times if time_s > t_s), default=math.inf)


def status(state: ScorerState, t_s: float, dish_yaw_rad: float, dish_pitch_rad: float) -> dict[str, float]:
    """The message that the dish sends to the robot; empty before checkpoint 1. Truth values are 0 and 1."""
    if state.checkpoint < 1:
        return {}
    task = state.task
    return {
        "dish_yaw": dish_yaw_rad,
        "dish_pitch": dish_pitch_rad,
        "yaw_target": task.yaw_target_rad,
        "pitch_target": task.pitch_target_rad,
        "yaw_ok": float(abs(dish_yaw_rad - task.yaw_target_rad) < TOLERANCE_RAD),
        "pitch_ok": float(abs(dish_pitch_rad - task.pitch_target_rad) < TOLERANCE_RAD),
        "yaw_done": float(_held(state.yaw_since_s, t_s)),
        "pitch_done": float(_held(state.pitch_since_s, t_s)),
        "tolerance_rad": TOLERANCE_RAD,
        "checkpoint": float(state.checkpoint),
    }


def _score(state: ScorerState, events: list[ScoreEvent], text: str) -> ScorerState:
    events.append(ScoreEvent(state.checkpoint + 1, f"checkpoint {state.checkpoint + 1}: {text}"))
    return replace(state, checkpoint=state.checkpoint + 1)


def _time_axes(
    state: ScorerState, t_s: float, yaw_rad: float, pitch_rad: float, events: list[ScoreEvent]
) -> ScorerState:
    yaw = _time_axis("yaw", yaw_rad - state.task.yaw_target_rad, state.yaw_since_s, t_s, state.checkpoint, events)
    pitch = _time_axis(
        "pitch", pitch_rad - state.task.pitch_target_rad, state.pitch_since_s, t_s, state.checkpoint, events
    )
    return replace(state, yaw_since_s=yaw, pitch_since_s=pitch)


def _time_axis(
    name: str, error_rad: float, since_s: float | None, t_s: float, checkpoint: int, events: list[ScoreEvent]
) -> float | None:
    if abs(error_rad) < TOLERANCE_RAD:
        if since_s is None:
            events.append(ScoreEvent(checkpoint, f"dish {name} came into tolerance"))
            return t_s
        return since_s
    if since_s is not None:
        events.append(ScoreEvent(checkpoint, f"dish {name} left its tolerance"))
    return None


def _held(since_s: float | None, t_s: float) -> bool:
    return since_s is not None and t_s - since_s > HOLD_S + _ROUNDING_S
