"""An episode is a function: one command, from a state to rest, computed with physics.

``perform(body, command, state, key)`` has no other inputs than its arguments: equal inputs give equal episodes, bit
for bit. It runs as long as the robot acts and settles; between episodes the plant is frozen. Cut at ``until_s`` it
gives exactly the first part.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from teleop_sim.core.streams import stream
from teleop_sim.robot.body import Body, RobotState
from teleop_sim.robot.commands import Command
from teleop_sim.robot.falls import FallWatch
from teleop_sim.robot.skill import Done, Tick
from teleop_sim.robot.skills import SKILLS

REST_SPEED = 0.01
"""An episode ends when no degree of freedom is faster [rad/s or m/s] (docs/physics.md: error of freezing)."""

REST_TICKS = 3
"""So many ticks in a row (assumed)."""

SETTLE_LIMIT_S = 3.0
"""Longest wait for rest; then the plant is frozen as it is."""

AFTERMATH_S = 1.0
"""How long a fall is simulated after it is certain."""


@dataclass(frozen=True)
class NoiseKey:
    """Names the noise of one episode: the n-th of its skill in a replicate."""

    seed: int
    replicate: int
    count: int


@dataclass(frozen=True)
class Samples:
    """The plant at the end of every control tick: times from the start (n,), pelvis (n, 7), joints (n, k), status."""

    t_s: np.ndarray
    pelvis: np.ndarray
    joints: np.ndarray


@dataclass(frozen=True)
class Episode:
    """One command from start to rest.

    Attributes:
        duration_s: simulated time it takes. physics_s: the part of it that was stepped.
        outcome, cause: of the skill, ``fell`` if the robot fell, ``cut`` if it was cut.
        data: what the sensors made of it.
        samples: for observers. end: the state afterwards.
    """

    command: Command
    duration_s: float
    physics_s: float
    outcome: str
    cause: str
    data: Any
    samples: Samples
    end: RobotState


class _Recorder:
    def __init__(self, body: Body) -> None:
        self._body = body
        self._positions: list[np.ndarray] = []

    def note(self) -> None:
        self._positions.append(self._body.plant.positions())

    @property
    def ticks(self) -> int:
        return len(self._positions)

    def samples(self) -> Samples:
        n, body = self.ticks, self._body
        t_s = np.arange(1, n + 1) * body.tick_s
        return Samples(t_s, *body.plant.pelvis_and_angles(self._positions))


def perform(
    body: Body, command: Command, state: RobotState, key: NoiseKey, until_s: float = np.inf, start_s: float = 0.0
) -> Episode:
    """Carry out a command.

    Args:
        body: the robot in its plant; scratch, loaded from ``state``.
        command: what to do. state: where to begin. key: names the sensors' noise.
        until_s: cut the episode there (rounded down to whole control ticks).
        start_s: time of the one clock, so that MuJoCo's time equals it; has no effect on what happens.
    """
    body.load(state, start_s)
    name = type(command).__name__.lower()
    rng = stream(key.seed, key.replicate, f"robot.{name}.{key.count}")
    recorder, watch = _Recorder(body), FallWatch(body)
    if state.fallen:
        return _episode(body, command, recorder, Done("fell", "already on the ground"), np.inf)
    limit = np.floor(until_s / body.tick_s + 1e-9)
    skill = SKILLS[type(command)](body, command, rng)
    done: Done | None = None
    while done is None and recorder.ticks < limit:
        try:
            reference = next(skill)
        except StopIteration as end:
            done = end.value
            break
        upright = body.tick(reference)
        recorder.note()
        watch.look(reference)
        if not upright:
            done = Done("fell", watch.cause())
            _aftermath(body, recorder, limit)
    if recorder.ticks:
        body.torque = None if done is None else done.torque
    if done is None:
        skill.close()
        return _episode(body, command, recorder, Done("cut", f"stopped after {until_s:.2f} s"), until_s)
    body.walking = None
    if done.outcome != "fell" and not _settle(body, recorder, watch, limit):
        done = Done("fell", watch.cause())
    return _episode(body, command, recorder, done, until_s)


def _settle(body: Body, recorder: _Recorder, watch: FallWatch, limit: float) -> bool:
    """Stand until at rest, if anything has moved. Returns False when the robot fell instead."""
    if recorder.ticks == 0:
        return True
    body.set_stand()
    patience, still = round(SETTLE_LIMIT_S / body.tick_s), 0
    # A skill may end at rest, but off the stand that the law now takes up: the first tick of that tells.
    while still < REST_TICKS and patience > 0 and recorder.ticks < limit:
        patience -= 1
        reference = Tick(body.posture, torque=body.torque, jaws=body.jaws)
        upright = body.tick(reference)
        recorder.note()
        watch.look(reference)
        if not upright:
            _aftermath(body, recorder, limit)
            return False
        still = still + 1 if body.speed() <= REST_SPEED else 0
    return True


def _aftermath(body: Body, recorder: _Recorder, limit: float) -> None:
    """Let the fallen robot come down with its servos as they were."""
    for _ in range(round(AFTERMATH_S / body.tick_s)):
        if recorder.ticks >= limit:
            return
        body.plant.begin_tick()
        body.plant.end_tick()
        recorder.note()
    body.fallen = True


def _episode(body: Body, command: Command, recorder: _Recorder, done: Done, until_s: float) -> Episode:
    moved_s = recorder.ticks * body.tick_s
    duration_s = min(moved_s + done.takes_s, until_s) if done.outcome != "cut" else until_s
    return Episode(command, duration_s, moved_s, done.outcome, done.cause, done.data, recorder.samples(), body.save())
