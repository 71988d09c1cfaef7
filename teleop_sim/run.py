"""One run: two sites and a link on one clock, into one log.

A run is a function of scenario, seed and replicate. Only ``wall_s`` and ``physics_s`` of the result depend on the
machine it ran on.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, partial
from importlib import metadata
from pathlib import Path

import simpy

from teleop_sim.core.records import Disturbed, Emit, PlantSample, Record, RunEnded, RunStarted
from teleop_sim.core.streams import stream
from teleop_sim.core.views import Show
from teleop_sim.field import FieldSite
from teleop_sim.field_things import Onboard, Work
from teleop_sim.log.writer import LogWriter
from teleop_sim.machines.executive import Result
from teleop_sim.machines.mirror import Mirror
from teleop_sim.onsite import RobotOnSite
from teleop_sim.operators.acts import Briefing
from teleop_sim.operators.crew import Crew
from teleop_sim.operators.memo import FreshEyes
from teleop_sim.operators.workload import acts_sent
from teleop_sim.reports.visits import StateRow, state_rows
from teleop_sim.robot.body import Body
from teleop_sim.robot.memo import Fresh
from teleop_sim.robot.programs.pacing import pacing
from teleop_sim.scenarios.crews import crew_tools
from teleop_sim.scenarios.links import Streams, link_plan
from teleop_sim.scenarios.objects import (
    TASKS,
    Site,
    autonomy_level,
    drawn_disturbances,
    machine_of,
    operator_criterion,
    operator_human,
    operator_policy,
    operator_timing,
)
from teleop_sim.scenarios.robots import robot_spec
from teleop_sim.scenarios.schema import Scenario
from teleop_sim.scenarios.writing import scenario_to_toml
from teleop_sim.shown import Onlooker
from teleop_sim.wiring import rates_by_state, sender, wire
from teleop_sim.world.disturbances import figures

Clock = Callable[[], float]
LIBRARIES = ("teleop-sim", "mujoco", "pin", "numpy", "numba", "simpy")


@dataclass(frozen=True)
class Progress:
    """Where a run stands. ``up_use``, ``down_use``: share of the time in which each direction was sending.

    ``note``: what holds it up, if anything.
    """

    t_s: float
    time_limit_s: float
    state: str
    mode: str
    up_use: float
    down_use: float
    note: str = ""


@dataclass(frozen=True)
class RunResult:
    """What came of a run. ``wall_s``: on the wall clock; ``physics_s``: the part of it inside MuJoCo."""

    scenario: str
    seed: int
    outcome: str
    cause: str
    completion_time_s: float
    round_trips: int
    operator_acts: int
    wall_s: float
    physics_s: float
    log: Path
    states: list[StateRow]


def run_scenario(
    scenario: Scenario,
    seed: int,
    out: Path,
    replicate: int = 0,
    progress: Callable[[Progress], None] | None = None,
    clock: Clock = time.perf_counter,
    memo: Fresh | None = None,
) -> RunResult:
    """Run a scenario once and log it to ``out/<scenario>_seed<seed>.mcap``.

    Args:
        scenario: what to run. seed, replicate: all chance follows from them.
        out: folder of the log; made if missing. A log of the same name is replaced when the new one is complete.
        progress: called about once a simulated second.
        clock: a wall clock [s] for the result's timings; the simulation never reads it.
        memo: of earlier runs in this process: what they computed is not computed again. The log's bytes do not depend
            on it. Or ``robot.stepped.Stepped()``, to measure what freezing costs.

    Raises:
        BadInput: nothing could ever get across the link that these draw; nothing is written then.
        KeyboardInterrupt: passed on after the log has been finished up to the interruption.
    """
    started_s = clock()
    # Whatever these draw that can never deliver is refused before a log is begun.
    link_plan(scenario, partial(stream, seed, replicate))
    path = out / f"{scenario.name}_seed{seed}.mcap"
    writer = LogWriter(path)
    try:
        done = simulate(scenario, seed, replicate, writer.write, progress, clock, memo, show=writer.show)
        writer.close()
    except KeyboardInterrupt:
        writer.interrupt()
        raise
    ended = done.ended
    return RunResult(
        scenario=scenario.name,
        seed=seed,
        outcome=ended.outcome,
        cause=ended.cause,
        completion_time_s=ended.completion_time_s,
        round_trips=ended.round_trips,
        operator_acts=ended.operator_acts,
        wall_s=clock() - started_s,
        physics_s=done.physics_s,
        log=path,
        states=state_rows(done.records),
    )


@dataclass(frozen=True)
class Simulated:
    """A run without its log.

    Attributes:
        ended: the last record.
        records: all but the plant's samples, in order.
        physics_s: time on the wall clock inside MuJoCo.

    """

    ended: RunEnded
    records: list[Record]
    physics_s: float


def simulate(
    scenario: Scenario,
    seed: int,
    replicate: int,
    emit: Emit,
    progress: Callable[[Progress], None] | None = None,
    clock: Clock = time.perf_counter,
    memo: Fresh | None = None,
    eyes: FreshEyes | None = None,
    show: Show | None = None,
) -> Simulated:
    """Run a scenario once and hand all its records to ``emit``; see ``run_scenario``.

    ``eyes``: what the crew's eyes have made of earlier runs' pictures and clouds, as ``memo`` is of physics. ``show``:
    takes the scene, pictures, clouds and lines for viewers; None: nobody looks, and none are made.

    Raises:
        BadInput: nothing could ever get across the link that these draw.

    """
    # The log's scenario repeats the run, whoever chose the seed.
    scenario = scenario.model_copy(update={"seed": seed})
    onlooker = None if show is None else Onlooker(show)
    watch = _Watch(scenario, emit, progress, onlooker)
    bench = _Bench(scenario, seed, replicate, watch, clock, memo, eyes, show)
    watch.look = bench.progress
    ended = bench.run()
    return Simulated(ended, watch.seen, bench.plant.stepping_s)


@dataclass
class _Watch:
    """Passes records on to the log, keeps all but the plant's for the summary, and tells how far the run is."""

    scenario: Scenario
    write: Emit
    tell: Callable[[Progress], None] | None
    onlooker: Onlooker | None = None
    seen: list[Record] = field(default_factory=list)
    look: Callable[[], Progress] | None = None
    told_s: float = -math.inf

    def __call__(self, record: Record) -> None:
        self.write(record)
        if not isinstance(record, PlantSample):
            self.seen.append(record)
            if self.onlooker is not None:
                self.onlooker.told(record)
        if self.tell is not None and self.look is not None and record.t_s >= self.told_s + 1.0:
            self.told_s = record.t_s
            self.tell(self.look())


@cache
def _versions() -> str:
    return " ".join(f"{name} {metadata.version(name)}" for name in LIBRARIES)


def _work(scenario: Scenario, site: Site, streams: Streams) -> Work | None:
    """What a task with a thing to work on gives its field site."""
    if site.thing is None:
        return None
    loss = scenario.onboard.request_loss if scenario.onboard is not None else 0.0
    return Work(scenario.robot, site.thing.ghosts, Onboard(loss, streams("onboard.loss")))


class _Bench:
    """Two sites and a link, wired to a clock."""

    def __init__(
        self,
        scenario: Scenario,
        seed: int,
        replicate: int,
        watch: _Watch,
        clock: Clock,
        memo: Fresh | None = None,
        eyes: FreshEyes | None = None,
        show: Show | None = None,
    ) -> None:
        self._scenario, self._watch, self._physics = scenario, watch, Fresh() if memo is None else memo
        self.env = simpy.Environment()
        toml = scenario_to_toml(scenario)
        watch(RunStarted(0.0, scenario.name, toml, seed, replicate, scenario.time_limit_s, _versions()))
        streams = partial(stream, seed, replicate)
        self._task = TASKS[scenario.task]
        machine, level = machine_of(scenario), autonomy_level(scenario)
        # The sites are tied together by nothing but this link.
        plan = link_plan(scenario, streams)
        self.link = wire(self.env, plan, streams, self._to_field, self._to_station, watch)
        self.up, self.down = self.link.up, self.link.down
        site, spec = self._task.site(scenario, streams), robot_spec(scenario)
        otherwise = drawn_disturbances(scenario, streams, site, spec.model)
        for told in figures(otherwise):
            watch(Disturbed(0.0, *told))
        body = self._physics.body(spec, site.scenery, otherwise)
        if show is not None:
            show(body.plant.scene(0.0, scenario.name, spec.camera_frame))
        robot = self._robot(seed, replicate, body, site, clock)
        waits = pacing(scenario.pacing)
        programs = self._task.programs(waits, scenario.robot)
        policy = operator_policy(scenario.operator)
        to_station, emit = sender(self.link.site, plan.down), rates_by_state(plan, self.link, watch)
        beat = scenario.link.heartbeat, scenario.link.heartbeat_s
        work = _work(scenario, site, streams)
        self.field = FieldSite(
            self.env, robot, machine, level, programs, waits.poll_s, beat, to_station, emit, policy.verifies, work
        )
        self.robot = robot
        tools = crew_tools(scenario, self._task.template, site.thing, plan.round_trip_s, eyes)
        in_reach = site.thing is not None and site.thing.ahead_m == 0.0
        self.station = Crew(
            self.env,
            Mirror(machine, level),
            sender(self.link.station, plan.up),
            operator_timing(scenario.operator),
            streams("operator"),
            watch,
            Briefing(plan.round_trip_s, plan.up.settings.rate_bps, beat[1], in_reach),
            policy,
            scenario.operator.team or 1,
            operator_human(scenario.operator),
            tools.givers,
            tools.templates,
            hands=tools.hands,
            criterion=operator_criterion(scenario.operator),
            eyes=eyes,
        )

    def _robot(self, seed: int, replicate: int, body: Body, site: Site, clock: Clock) -> RobotOnSite:
        self.plant = body.plant
        self.plant.stopwatch = clock
        score = site.score(self.plant.joint_names)
        return RobotOnSite(self.env, body, score, seed, replicate, self._watch, self._physics)

    def _to_field(self, payload: bytes) -> None:
        self.field.receive(payload)

    def _to_station(self, payload: bytes) -> None:
        self.station.receive(payload)
        if self._watch.onlooker is not None:
            self._watch.onlooker.arrived(payload, float(self.env.now))

    def progress(self) -> Progress:
        """Where the run stands."""
        executive = self.field.executive
        return Progress(
            float(self.env.now),
            self._scenario.time_limit_s,
            executive.state,
            executive.mode,
            self.up.utilisation(),
            self.down.utilisation(),
            f"waits for the operator ({executive.pending.kind})" if executive.pending else "",
        )

    def run(self) -> RunEnded:
        """Let the clock run to the machine's end or the time limit."""
        env, limit_s = self.env, self._scenario.time_limit_s
        env.process(self.station.run())
        done = env.process(self.field.run())
        reached = env.event()
        if self._task.ends_when_scored:
            reached = env.process(self.robot.until(self._task.last_checkpoint))
        env.run(until=done | reached | env.timeout(limit_s))
        self.field.close()
        self.link.close()
        ended = self._ended(done.value if done.triggered else None, reached.triggered)
        self._watch(ended)
        return ended

    def _ended(self, result: Result | None, reached: bool) -> RunEnded:
        now_s, checkpoint, last = float(self.env.now), self.robot.checkpoint, self._task.last_checkpoint
        if reached:
            outcome, cause = "completed", ""
        elif result is None:
            state = self.field.executive.state
            at = f"in {state}, checkpoint {checkpoint} of {last}"
            outcome, cause = "censored", f"time limit of {now_s:g} s reached {at}"
        elif result.outcome == "failed":
            outcome, cause = "failed", result.cause
        elif checkpoint < last:
            outcome, cause = "failed", f"the machine ended, but only checkpoint {checkpoint} of {last} was scored"
        else:
            outcome, cause = "completed", ""
        done_s = now_s if outcome == "completed" else math.nan
        trips = self.field.executive.round_trips
        return RunEnded(now_s, outcome, cause, done_s, trips, acts_sent(self._watch.seen))
