"""The field site: the field computer with its executive, and the robot with its task, on the clock.

Whatever reaches it came as bytes over the uplink; whatever leaves it goes as bytes over the downlink.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from contextlib import suppress
from typing import Any

import simpy

from teleop_sim.channel import messages as msg
from teleop_sim.core.records import Emit, EpisodeEnded, Record, Released, Waited
from teleop_sim.field_orders import Direct, Orders
from teleop_sim.field_pictures import Pictures, brief, points_of, tool_of
from teleop_sim.field_things import Things, Work
from teleop_sim.field_voice import Beat, SiteVoice
from teleop_sim.machines.declare import FELL, Machine
from teleop_sim.machines.executive import Executive, Result, Signal, Start
from teleop_sim.onsite import Interrupted, RobotOnSite
from teleop_sim.robot.commands import Command, Side, Vector
from teleop_sim.robot.gait import Gait
from teleop_sim.robot.perception.lidar import HandPoints
from teleop_sim.robot.programs.pacing import wait_for_poll_s
from teleop_sim.robot.programs.steps import (
    AskData,
    AskStatus,
    Claim,
    Memory,
    ProgramOf,
    Reply,
    Say,
    Show,
    Step,
    Stepped,
    Wait,
)

Send = Callable[[str, bytes, str], None]
Process = Generator[simpy.Event, Any, Any]


class FieldSite:
    """One field site. ``run()`` is its process; ``receive`` takes what the uplink delivered.

    Args:
        env: the clock.
        robot: the robot on its site.
        machine: what the executive runs, at ``level``. programs: by state. poll_s: how often a program looks whether
            a state is done; zero is at once. heartbeat: what the control station is told, and how often [s].
        send: to the downlink. emit: to the log.
        claims: does the operator compare claims with pictures? Then each of which he will be asked comes with one.
        work: with object templates, if the task has any.
    """

    def __init__(
        self,
        env: simpy.Environment,
        robot: RobotOnSite,
        machine: Machine,
        level: int,
        programs: Mapping[str, ProgramOf],
        poll_s: float,
        heartbeat: tuple[Beat, float],
        send: Send,
        emit: Emit,
        claims: bool = False,
        work: Work | None = None,
    ) -> None:
        self._env, self._robot, self._programs, self._poll_s = env, robot, programs, poll_s
        self._heartbeat, self._send, self._emit = heartbeat, send, emit
        self._memory = Memory()
        self._programs_at_work: dict[str, simpy.Process] = {}
        self._turns = simpy.Resource(env)
        self._mover: simpy.Process | None = None
        self._by_hand: simpy.Process | None = None
        self._under_way: Callable[[float], Record] | None = None
        self._hand_clouds = 0
        self._view_asked = False
        self._voice = SiteVoice(env, self.tell)
        self._pictures = Pictures(env, robot, self.tell, emit, claims)
        self.executive = Executive(env, machine, level, self._start_program, self._voice, emit)
        self._voice.listen_to(self.executive)
        self._things = None if work is None else Things(self, work, self._memory)
        things = None if self._things is None else self._things.receive
        self.receive = Orders(self.executive, self._voice.ledger, self, things).receive

    def run(self) -> Generator[simpy.Event, Any, Result]:
        """Process: run the machine to its end."""
        what, every_s = self._heartbeat
        self._env.process(self._voice.beat(every_s, what))
        if self._things is not None:
            self._env.process(self._templates_beat(self._things, every_s))
        return (yield from self.executive.run())

    def close(self) -> None:
        """Write the record of what is under way, if anything, as far as it has come."""
        if self._under_way is not None:
            record, self._under_way = self._under_way(float(self._env.now)), None
            self._emit(record)

    def _templates_beat(self, things: Things, every_s: float) -> Process:
        while True:
            yield self._env.timeout(every_s)
            things.heartbeat()

    # What has arrived ----------------------------------------------------------------------------------------------

    def stop(self, text: str) -> None:
        """Bring the robot to rest; the program goes on with what it then finds."""
        if self._mover is not None and self._robot.busy:
            self.note("stopped", text, "")
            self._mover.interrupt("stop")
        else:
            self.note("ignored", text, "the robot is at rest")

    def direct(self, text: str, command: Direct) -> None:
        """A movement that the operator commands himself; only while no program acts."""
        self.by_hand(text, lambda: self.act(command))

    def by_hand(self, text: str, work: Callable[[], Process]) -> bool:
        """Start what a person ordered; False, with a note, while the robot acts."""
        if any(_alive(p) for p in self._programs_at_work.values()) or _alive(self._by_hand):
            self.note("ignored", text, "the robot is acting")
            return False
        self.note("direct", text, "")
        self._by_hand = self._env.process(self._in_turn(work))
        return True

    def between(self, work: Callable[[], Process]) -> None:
        """Start something short that comes between two movements."""
        self._env.process(self._between(work))

    def _between(self, work: Callable[[], Process]) -> Process:
        if self._by_hand is not None and self._by_hand.is_alive:
            yield self._by_hand
        yield from self._in_turn(work)

    def _in_turn(self, work: Callable[[], Process]) -> Process:
        # Who is told to stop before it was its turn, or between two movements, has nothing to bring to rest.
        with self._turns.request() as turn, suppress(simpy.Interrupt):
            yield turn
            yield from work()

    def view(self) -> None:
        """The operator wants a picture: now, or when the movement under way has ended; one is enough."""
        if not self._view_asked:
            self._view_asked = True
            # Programs move step by step: the picture is taken between two of their movements.
            self.between(self._view)

    def _view(self) -> Process:
        yield from ()
        self._view_asked = False
        self._pictures.send()

    def note(self, effect: str, command: str, note: str) -> None:
        """Write down what became of a command."""
        self._emit(Released(float(self._env.now), 0, command, effect, note))

    def act(self, command: Command) -> Generator[simpy.Event, Any, Reply]:
        """Carry out one command of a person's."""
        reply: Reply = yield from self._act(command, self.executive.state)
        if reply.outcome == "fell":
            self.executive.fell(reply.cause)
        return reply

    def wait(self, seconds: float, why: str) -> Process:
        """Let time pass for what a person ordered."""
        yield from self._wait(seconds, why, self.executive.state)

    @property
    def gait(self) -> Gait:
        """How the robot walks."""
        return self._robot.gait

    def hand(self, side: Side) -> tuple[Vector, Vector]:
        """Tool of a hand: position [m] and rotation vector [rad], odometry frame."""
        return tool_of(self._robot, side)

    def hand_points(self, side: Side) -> HandPoints:
        """What the LIDAR's last half turn has on a hand, and what it should have."""
        self._hand_clouds += 1
        return points_of(self._robot, side, self._hand_clouds)

    def _let_hand_movement_end(self) -> Process:
        """Wait for a movement that the operator commanded; an interrupt of the program brings it to rest."""
        moving = self._by_hand
        if moving is None or not moving.is_alive:
            return
        try:
            yield moving
        except simpy.Interrupt:
            if moving.is_alive:
                moving.interrupt("stop")
                yield moving
            raise

    # What the machine asks for -------------------------------------------------------------------------------------

    def _start_program(self, start: Start) -> simpy.Process:
        made = self._programs_at_work[start.path] = self._env.process(self._program(start))
        return made

    def _program(self, start: Start) -> Process:
        """Drive the state's generator: do each step on the clock and hand it the answer."""
        try:
            yield from self._let_hand_movement_end()
            entered_s = float(self._env.now)
            visit = Memory(self._memory.facts, start.reads, start.parameters, path=start.path)
            program, answer, note = self._programs[start.program](visit), None, ""
            while True:
                try:
                    step = program.send(answer)
                except StopIteration as end:
                    event = str(end.value)
                    break
                answer = yield from self._take_step(step, start)
                if isinstance(answer, Reply):
                    note = answer.cause or note
            if event != FELL:
                yield from self._wait_for_poll(entered_s, start.path)
        except (Interrupted, simpy.Interrupt):
            return Signal(FELL, self._robot.fall_cause) if self._robot.fallen else Signal("", "interrupted")
        return Signal(event, note, visit.writes)

    def _take_step(self, step: Step, start: Start) -> Process:
        match step:
            case Wait(seconds=seconds, why=why):
                yield from self._wait(seconds, why, start.path)
            case AskStatus():
                return self._robot.status()
            case Say(text=text):
                self.tell(msg.LogLine(float(self._env.now), text), text)
            case Show(claim=claim):
                yield from self._show(claim, start)
            case AskData(what=what):
                if self._things is not None:
                    self._things.asked(what)
                return (yield start.ask(what))
            case Stepped():
                if self._things is not None:
                    self._things.stepped(step)
            case command:
                return (yield from self._move(command, start))
        return None

    def _move(self, command: Command, start: Start) -> Process:
        # States at work at once share one body: they move one after the other.
        with self._turns.request() as turn:
            yield turn
            return (yield from self._act(command, start.path))

    def _act(self, command: Any, state: str) -> Process:
        start_s = float(self._env.now)
        name, text = type(command).__name__.lower(), brief(command)

        def ended(now_s: float, outcome: str, cause: str, physics_s: float) -> EpisodeEnded:
            return EpisodeEnded(now_s, start_s, state, name, text, outcome, cause, physics_s)

        self._under_way = lambda now_s: ended(now_s, "unfinished", "the run ended", now_s - start_s)
        self._mover = self._env.active_process
        try:
            episode = yield from self._robot.do(command)
        except Interrupted as stop:
            now_s, self._under_way = float(self._env.now), None
            outcome, cause = ("fell", self._robot.fall_cause) if self._robot.fallen else ("interrupted", str(stop))
            self._emit(ended(now_s, outcome, cause, now_s - start_s))
            raise
        now_s, self._under_way = float(self._env.now), None
        self._emit(ended(now_s, episode.outcome, episode.cause, episode.physics_s))
        # Odometry: what the field computer knows of where its feet are.
        self._memory.facts["pose"] = self._robot.pose()
        return Reply(episode.outcome, episode.cause, episode.data, now_s - start_s)

    def _wait(self, seconds: float, why: str, state: str) -> Process:
        if seconds <= 0.0:
            return
        start_s = float(self._env.now)
        self._under_way = lambda now_s: Waited(now_s, start_s, state, "pacing", why)
        try:
            yield self._env.timeout(seconds)
        except simpy.Interrupt:
            self.close()
            raise
        self.close()

    def _wait_for_poll(self, entered_s: float, state: str) -> Process:
        """WPI's states look once a second whether they are done."""
        yield from self._wait(wait_for_poll_s(float(self._env.now) - entered_s, self._poll_s), "poll", state)

    def tell(self, message: msg.Message, text: str) -> None:
        """To the downlink."""
        topic, payload = msg.encode_message(message)
        self._send(topic, payload, text)

    def _show(self, claim: Claim | None, start: Start) -> Process:
        """Send a picture, and what belongs to a claim."""
        table = self.executive.machine
        edge = 0 if claim is None else table.edge_index(start.path, claim.event)
        passes = claim is not None and table.edge(start.path, claim.event).passes(self.executive.level)
        yield from self._pictures.show(claim, start.path, edge, passes, lambda look: self._move(look, start))


def _alive(process: simpy.Process | None) -> bool:
    return process is not None and bool(process.is_alive)
