"""The robot and its task on the clock: episodes unrolled, cut and scored; frozen in between."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import simpy

from teleop_sim.core.records import Emit, PlantNames, PlantSample, Record, Scored
from teleop_sim.core.streams import stream
from teleop_sim.robot.body import Body, RobotState
from teleop_sim.robot.commands import Command, PlanarPose, Stop
from teleop_sim.robot.episode import Episode, NoiseKey
from teleop_sim.robot.gait import Gait, body_between
from teleop_sim.robot.memo import Fresh, Sight
from teleop_sim.world.description import Vector
from teleop_sim.world.plant import HasPlaces
from teleop_sim.world.scoring import Score

SAMPLE_EVERY_TICKS = 10
"""The log keeps the plant five times a second; observers see every tick."""


class Interrupted(Exception):
    """What the robot did was ended from outside; it has come to rest."""


class RobotOnSite:
    """A robot that is told one command at a time.

    Args:
        env: the clock. body: the robot in its plant. score: the task's scorer before the start.
        seed, replicate: name the noise. emit: to the log.
        physics: computes what the robot does, or remembers it.
    """

    def __init__(
        self,
        env: simpy.Environment,
        body: Body,
        score: Score,
        seed: int,
        replicate: int,
        emit: Emit,
        physics: Fresh | None = None,
    ) -> None:
        self._env, self._body, self._emit = env, body, emit
        self._physics = Fresh() if physics is None else physics
        self._seed, self._replicate = seed, replicate
        self._counts: dict[str, int] = {}
        self._state, self._rest_s = body.standing(), float(env.now)
        body.load(self._state, float(env.now))
        self._names = body.plant.joint_names
        self._pelvis, self._joints = body.plant.pelvis(), body.plant.angles()
        self.score = score
        self.checkpoint = score.checkpoint
        self._told = 0
        self.busy = False
        self.fall_cause = ""
        self._changed, self._rest = env.event(), env.event()
        emit(PlantNames(float(env.now), " ".join(self._names)))
        self._log_plant()
        env.process(self._score_at_rest())

    @property
    def fallen(self) -> bool:
        """Whether the robot is down."""
        return self._state.fallen

    @property
    def gait(self) -> Gait:
        """How it walks."""
        return self._body.spec.gait

    def rng(self, name: str) -> np.random.Generator:
        """A named stream of this replicate."""
        return stream(self._seed, self._replicate, name)

    def seen(self) -> Body:
        """The body as it stands now, for taking pictures."""
        self._body.load(self._now(), float(self._env.now))
        return self._body

    def look(self, name: str, make: Callable[[Body, np.random.Generator], Any], *options: object) -> Any:
        """What the robot sees as it stands now: ``make`` of the body and the stream ``name`` (``memo.Sight``)."""
        sight = Sight(name, make, options)
        return self._physics.look(self._body, self._now(), sight, self._seed, self._replicate, float(self._env.now))

    def true_places(self) -> Mapping[str, Vector]:
        """Where the things truly are that the robot may claim to see: for the log, not for robot or operator."""
        body = self.seen()
        scenery = body.plant.scenery
        return scenery.places(body.plant) if isinstance(scenery, HasPlaces) else {}

    def pose(self) -> PlanarPose:
        """Where the middle of the feet is, by odometry."""
        # Asked before every command: a memo need not put the robot there again.
        at: PlanarPose = self.look("robot.pose", _pose)
        return at

    def status(self) -> dict[str, float]:
        """The task's status message now."""
        self._catch_up()
        return self.score.status(float(self._env.now), self._joints)

    def until(self, checkpoint: int) -> Generator[simpy.Event, Any, None]:
        """Process: ends when a checkpoint has been scored and the robot stands, at rest."""
        while self.checkpoint < checkpoint or self.busy or self.fallen:
            yield self._rest

    # Acting --------------------------------------------------------------------------------------------------------

    def do(self, command: Command) -> Generator[simpy.Event, Any, Episode]:
        """Process part: carry out a command, to rest.

        An interrupt with cause ``stop`` ends it early with outcome ``stopped``; any other raises ``Interrupted``, both
        when the robot has come to rest.
        """
        key = self._key(command)
        before, start_s = self._now(), float(self._env.now)
        episode = self._physics.perform(self._body, command, before, key, start_s=start_s)
        try:
            yield from self._unroll(episode, start_s)
        except simpy.Interrupt as interrupt:
            # The robot obeys at its next control tick, and what happens up to it is what would have happened anyway.
            ticks = np.ceil((float(self._env.now) - start_s) / self._body.tick_s - 1e-9)
            until_s = min(float(ticks) * self._body.tick_s, episode.duration_s)
            cut = self._physics.perform(self._body, command, before, key, until_s=until_s, start_s=start_s)
            yield from self._finish(self._end_of(cut, start_s))
            stopped = yield from self._come_to_rest()
            if interrupt.cause != "stop":
                raise Interrupted(str(interrupt.cause)) from interrupt
            outcome = "fell" if stopped.outcome == "fell" else "stopped"
            return _renamed(cut, outcome, stopped)
        return episode

    def _key(self, command: Command) -> NoiseKey:
        name = type(command).__name__
        self._counts[name] = self._counts.get(name, 0) + 1
        return NoiseKey(self._seed, self._replicate, self._counts[name])

    def _come_to_rest(self) -> Generator[simpy.Event, Any, Episode]:
        start_s = float(self._env.now)
        episode = self._physics.perform(self._body, Stop(), self._state, self._key(Stop()), start_s=start_s)
        yield from self._finish(self._unroll(episode, start_s))
        return episode

    def _finish(self, part: Generator[simpy.Event, Any, None]) -> Generator[simpy.Event, Any, None]:
        """Run a part to its end whatever interrupts it: a robot cannot stop stopping."""
        event = next(part, None)
        while event is not None:
            try:
                yield event
            except simpy.Interrupt:
                continue
            event = next(part, None)

    # Unrolling -----------------------------------------------------------------------------------------------------

    def _unroll(self, episode: Episode, start_s: float) -> Generator[simpy.Event, Any, None]:
        """Let an episode's time pass, with its samples scored and logged as they come."""
        self.busy = True
        self._poke()
        self._told = 0
        score, events = self._scored(episode, start_s)
        for at_s, records in self._timeline(episode, start_s, events):
            yield self._env.timeout(max(0.0, at_s - float(self._env.now)))
            for record in records:
                self._emit(record)
                self._count(record)
        yield self._env.timeout(max(0.0, start_s + episode.duration_s - float(self._env.now)))
        self._take_over(episode, score)

    def _end_of(self, cut: Episode, start_s: float) -> Generator[simpy.Event, Any, None]:
        """The rest of the control tick in which an episode was cut."""
        yield self._env.timeout(max(0.0, start_s + cut.duration_s - float(self._env.now)))
        score, events = self._scored(cut, start_s)
        # What the tick of the cut brought to light has not been told yet.
        for _, scored in events[self._told :]:
            self._emit(replace(scored, t_s=float(self._env.now)))
            self._count(scored)
        self._take_over(cut, score)

    def _count(self, record: Record) -> None:
        """Keep up with what has been told of the score."""
        if isinstance(record, Scored):
            self._told += 1
            self.checkpoint = record.checkpoint

    def _take_over(self, episode: Episode, score: Score) -> None:
        self.score, self._state, self._rest_s = score, episode.end, float(self._env.now)
        if len(episode.samples.t_s):
            self._pelvis, self._joints = episode.samples.pelvis[-1], episode.samples.joints[-1]
            self._log_plant()
        if episode.end.fallen and not self.fall_cause:
            self.fall_cause = episode.cause
        self.busy = False
        self._poke()

    def _timeline(
        self, episode: Episode, start_s: float, events: list[tuple[int, Scored]]
    ) -> list[tuple[float, list[Record]]]:
        samples = episode.samples
        timeline: dict[int, list[Record]] = {}
        for k, scored in events:
            timeline.setdefault(k, []).append(scored)
        for k in range(SAMPLE_EVERY_TICKS - 1, len(samples.t_s) - 1, SAMPLE_EVERY_TICKS):
            at_s = start_s + float(samples.t_s[k])
            timeline.setdefault(k, []).append(self._sample(at_s, samples.pelvis[k], samples.joints[k]))
        return [(start_s + float(samples.t_s[k]), timeline[k]) for k in sorted(timeline)]

    def _scored(self, episode: Episode, start_s: float) -> tuple[Score, list[tuple[int, Scored]]]:
        score, samples = self.score, episode.samples
        events: list[tuple[int, Scored]] = []
        times_s, k = start_s + samples.t_s, 0
        while True:
            k += score.quiet(times_s[k:], samples.pelvis[k:], samples.joints[k:])
            if k == len(times_s):
                return score, events
            at_s = float(times_s[k])
            score, seen = score.at(at_s, samples.pelvis[k], samples.joints[k])
            events += [(k, Scored(at_s, checkpoint, text)) for checkpoint, text in seen]
            k += 1

    def _sample(self, at_s: float, pelvis: np.ndarray, joints: np.ndarray) -> PlantSample:
        return PlantSample(at_s, tuple(pelvis.tolist()), tuple(joints.tolist()))

    def _log_plant(self) -> None:
        self._emit(self._sample(float(self._env.now), self._pelvis, self._joints))

    # Frozen --------------------------------------------------------------------------------------------------------

    def _poke(self) -> None:
        """Something began or ended: look again when to score."""
        if not self._changed.triggered:
            self._changed.succeed()
        if not self.busy:
            done, self._rest = self._rest, self._env.event()
            done.succeed()

    def _now(self) -> RobotState:
        """The state now; while the robot acts, as it was before."""
        if self.busy:
            return self._state
        return self._physics.stood(self._body, self._state, float(self._env.now) - self._rest_s)

    def _catch_up(self) -> None:
        """Bring what is scored up to date; nothing to do for a frozen robot."""
        state = self._now()
        if state is not self._state:
            self._body.load(state, float(self._env.now))
            self._pelvis, self._joints = self._body.plant.pelvis(), self._body.plant.angles()

    def _score_at_rest(self) -> Generator[simpy.Event, Any, None]:
        """Process: a frozen robot's hold timers run on; sample exactly when one is due."""
        while True:
            self._changed = self._env.event()
            due_s = np.inf if self.busy else self.score.next_s(float(self._env.now))
            if not np.isfinite(due_s):
                yield self._changed
                continue
            yield self._changed | self._env.timeout(max(0.0, due_s - float(self._env.now)))
            if not self.busy and not self._changed.triggered:
                now_s = float(self._env.now)
                self._catch_up()
                self.score, seen = self.score.at(now_s, self._pelvis, self._joints)
                for checkpoint, text in seen:
                    self._emit(Scored(now_s, checkpoint, text))
                    self.checkpoint = checkpoint


def _pose(body: Body, _: np.random.Generator) -> PlanarPose:
    return body_between(body.feet())


def _renamed(episode: Episode, outcome: str, stopped: Episode) -> Episode:
    return Episode(
        episode.command,
        episode.duration_s + stopped.duration_s,
        episode.physics_s + stopped.physics_s,
        outcome,
        # Down before the stop: what threw the robot is the cause, not that it already lay there.
        episode.cause if episode.outcome == "fell" else stopped.cause or "stopped by the operator",
        None,
        stopped.samples,
        stopped.end,
    )
