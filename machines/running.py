"""The processes of a running machine, one for each active state; what operators may do is in ``executive.py``."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from typing import Any, Literal, cast

import simpy

from teleop_sim.core.records import Emit, ModeChanged, Requested, TransitionTaken
from teleop_sim.machines.counts import Variables
from teleop_sim.machines.declare import FELL, Edge, Machine
from teleop_sim.machines.elements import State
from teleop_sim.machines.engine import MODES, Engine
from teleop_sim.machines.holds import Holds
from teleop_sim.machines.keys import Keys
from teleop_sim.machines.visits import Answer, Outcome, Pending, Signal, Start, Visit
from teleop_sim.machines.voice import Voice

Wait = Generator[simpy.Event, Any, None]
WaitFor = Generator[simpy.Event, Any, Outcome | None]
StartProgram = Callable[[Start], simpy.Process]


@dataclass(frozen=True)
class Result:
    """How the machine ended: ``completed`` or ``failed``, why, and how many requests were answered."""

    outcome: Literal["completed", "failed"]
    cause: str
    round_trips: int


class Running:
    """A machine on the clock. See ``Executive``, which is this with ears."""

    def __init__(
        self,
        env: simpy.Environment,
        machine: Machine,
        level: int,
        start_program: StartProgram,
        voice: Voice,
        emit: Emit,
    ) -> None:
        self._env, self._start_program, self._voice, self._emit = env, start_program, voice, emit
        self._engine, self._keys = Engine(machine, level), Keys(machine)
        self._visits: dict[str, Visit] = {}
        self._requests = 0
        self._data: dict[int, simpy.Event] = {}
        self._fallen: str | None = None
        self._preempted = ""
        self._last: Outcome | None = None
        self._gave_up = ""
        self._ended = env.event()
        self.mode, self.round_trips = "normal", 0
        self._holds = Holds(self._engine, self._visits)
        self.running = False

    @property
    def machine(self) -> Machine:
        """What runs."""
        return self._engine.machine

    @property
    def variables(self) -> Variables:
        """D, as it stands."""
        return self._engine.variables

    @property
    def level(self) -> int:
        """Autonomy level, 0 to 3."""
        return self._engine.level

    @property
    def state(self) -> str:
        """Paths of the active states, joined by `` + ``; of a machine that has ended: its end."""
        now = self._engine.configuration
        return " + ".join(self._engine.net.nodes[n].path for n in now.active) or now.outcome

    @property
    def pendings(self) -> tuple[Pending, ...]:
        """Open requests, by number."""
        found = (v.pending for v in self._visits.values() if v.pending is not None)
        return tuple(sorted(found, key=lambda p: p.request))

    @property
    def pending(self) -> Pending | None:
        """The oldest open request."""
        return next(iter(self.pendings), None)

    def run(self) -> Generator[simpy.Event, Any, Result]:
        """Process: visit states until the machine ends, the robot is down, or the operator preempts."""
        self.running = True
        self._enter(self._engine.configuration.active)
        yield self._ended
        at_work = [v.process for v in self._visits.values() if v.process is not None and v.process.is_alive]
        if at_work:
            yield simpy.AllOf(self._env, at_work)
        self.running = False
        return self._result()

    # Visits

    def _enter(self, states: tuple[int, ...]) -> None:
        """Begin the visits of states that were entered."""
        if self._engine.over():
            self._end()
            return
        self._keys.enter(states)
        for number in states:
            node = self._engine.net.nodes[number]
            self._begin(number, node.element if isinstance(node.element, State) else None)
        self._holds.suspend()

    def _begin(self, number: int, state: State | None, raised: str = "") -> None:
        path = self._engine.net.nodes[number].path
        mode = self._engine.variables.mode(path)
        visit = Visit(number, path, state, raised, float(self._env.now), mode, self._env.event())
        self._visits[path] = visit
        self._show_mode(path)
        visit.process = self._env.process(self._visit(visit))

    def _visit(self, visit: Visit) -> Wait:
        """Process: attempts until an outcome may be taken, and take it."""
        outcome: Outcome | None = None
        while outcome is None and not visit.over:
            outcome = yield from self._attempt(visit)
            if outcome is not None:
                outcome = yield from self._hold(visit, outcome)
        if outcome is not None and not visit.over:
            yield from self._take(visit, outcome)
        elif self._visits.get(visit.path) is visit:
            del self._visits[visit.path]

    def _attempt(self, visit: Visit) -> WaitFor:
        yield from self._holds.until_free(visit)
        state = visit.state
        if visit.over:
            return None
        visit.mode = self._engine.variables.mode(visit.path)
        self._show_mode(visit.path)
        if state is None:
            return (yield from self._guard(visit, Outcome(visit.path, visit.raised, "autonomous")))
        if state.decides:
            return (yield from self._guard(visit, Outcome(visit.path, state.suggests, "autonomous"), "decide"))
        if not state.program:
            return (yield from self._ask(visit, Outcome(visit.path, "", "forced"), "manual", "waits for the operator"))
        return (yield from self._work(visit, state))

    def _work(self, visit: Visit, state: State) -> WaitFor:
        parameters = {name: self.machine.value(value) for name, value in state.parameters}
        reads = self._keys.read(visit.node)

        def ask(what: str) -> simpy.Event:
            return self._ask_data(visit, what)

        visit.program = self._start_program(Start(visit.path, state.program, reads, parameters, ask))
        if visit.answer is None:
            visit.called = self._env.event()
            yield visit.program | visit.called
        if visit.answer is not None:
            yield from self._bring_to_rest(visit)
            return (yield from self._answered(visit, None))
        ended = _signal(visit.program)
        if ended.signal == FELL:
            self._fall(ended.note or "the robot fell")
            return None
        self._keys.write(visit.node, ended.writes)
        edge = self._engine.net.edges[self._engine.trigger(visit.path, ended.signal)]
        return (yield from self._guard(visit, Outcome(visit.path, edge.event, "autonomous", ended.signal, ended.note)))

    def _bring_to_rest(self, visit: Visit) -> Wait:
        assert visit.program is not None
        assert visit.answer is not None
        if visit.pending is not None:
            self._close(visit)
        if visit.program.is_alive:
            answer = visit.answer
            visit.program.interrupt(answer.note or f"{answer.kind} {answer.event}".strip())
            yield visit.program
        ended = _signal(visit.program)
        if ended.signal == FELL:
            self._fall(ended.note or "the robot fell")

    # Outcomes

    def _guard(self, visit: Visit, outcome: Outcome, kind: str = "confirm") -> WaitFor:
        """Let the outcome pass, or ask."""
        if outcome.event and self._edge(outcome).passes(self.level):
            return outcome
        return (yield from self._ask(visit, outcome, kind, outcome.note))

    def _ask(self, visit: Visit, outcome: Outcome, kind: str, text: str) -> WaitFor:
        self._request(visit, kind, outcome.event, text)
        if visit.answer is None:
            visit.called = self._env.event()
            yield visit.called
        assert visit.pending is not None
        visit.waited_s = float(self._env.now) - visit.pending.since_s
        return (yield from self._answered(visit, outcome))

    def _answered(self, visit: Visit, outcome: Outcome | None) -> WaitFor:
        """What an answer makes of the suggested outcome; None: try again, or the visit is over."""
        answer, waited_s = visit.answer, visit.waited_s
        visit.answer, visit.waited_s = (answer if visit.over else None), 0.0
        assert answer is not None
        if answer.kind in ("forced", "confirmed", "autonomous"):
            visit.pending = None
        elif visit.pending is not None and not visit.over:
            self._close(visit)
        if answer.kind == "forced":
            visit.mode = "manual"
            self._show_mode(visit.path)
            note = outcome.note if outcome is not None else ""
            return Outcome(visit.path, answer.event, "forced", "", note, waited_s)
        if answer.kind == "taken_over":
            visit.mode = "manual"
            self._show_mode(visit.path)
            return (yield from self._ask(visit, Outcome(visit.path, "", "forced"), "act", "the operator acts instead"))
        if answer.kind == "rejected" and visit.state is None:
            self._again(visit)
        if outcome is None or answer.kind not in ("confirmed", "autonomous"):
            return None
        return replace(outcome, how=answer.kind, waited_s=waited_s)

    def _again(self, visit: Visit) -> None:
        """A container's outcome was refused: what is in it begins anew."""
        visit.over = True
        move = self._engine.again(visit.node)
        del self._visits[visit.path]
        self._keys.close(self._engine.configuration)
        self._enter(move.entered)
        self._voice.snapshot()

    def _hold(self, visit: Visit, outcome: Outcome) -> WaitFor:
        """Wait while the state is locked or nothing may pass; then the guard decides anew."""
        while not visit.over and self._holds.blocked(visit, outcome):
            visit.held = outcome
            visit.called = self._env.event()
            yield visit.called
            visit.held, visit.answer = None, visit.answer if visit.over else None
            if outcome.how == "autonomous" and not visit.over and not self._holds.blocked(visit, outcome):
                found = yield from self._guard(visit, outcome, "decide" if _decides(visit) else "confirm")
                if found is None:
                    return None
                outcome = found
        return None if visit.over else outcome

    def _take(self, visit: Visit, outcome: Outcome) -> Wait:
        """Bring everything to rest that is left, then take the outcome."""
        while leaving := self._left_with(visit, outcome):
            for other in leaving:
                other.wake(Answer("left", note=f"left with {outcome.path} {outcome.event}"))
            yield simpy.AllOf(self._env, [v.process for v in leaving if v.process is not None])
            # A fall meanwhile, or something further out that is left, leaves nothing to take.
            if visit.over:
                break
        del self._visits[visit.path]
        if visit.over:
            return
        self._taken(visit, outcome)

    def _force_container(self, path: str, event: str) -> None:
        """Take a container's outcome while it is at work inside."""
        visit = Visit(self._engine.net.by_path[path], path, None, "", float(self._env.now), "manual", self._env.event())
        self._visits[path] = visit
        self._show_mode(path)
        visit.process = self._env.process(self._take(visit, Outcome(path, event, "forced")))

    def _left_with(self, visit: Visit, outcome: Outcome) -> list[Visit]:
        engine = self._engine
        left = engine.net.move(engine.configuration, self._number(outcome)).left
        return [v for v in self._visits.values() if v is not visit and v.node in left]

    def _taken(self, visit: Visit, outcome: Outcome) -> None:
        engine, number, now_s = self._engine, self._number(outcome), float(self._env.now)
        edge, mode = engine.net.edges[number], self.mode
        before = engine.variables.failures.get(edge.state, 0)
        if visit.raised:
            self._keys.ended(visit.node)
        move = engine.take(number, outcome.signal)
        self._keys.close(engine.configuration)
        retries = max(before, engine.variables.failures.get(edge.state, 0))
        self._emit(
            TransitionTaken(
                now_s, edge.state, edge.event, edge.next_state, visit.entered_s, outcome.how, mode, retries,
                edge.threshold, self.level, outcome.waited_s, outcome.note,
            )
        )  # fmt: skip
        self._voice.transition(number)
        self._last = outcome
        if edge.kind == "failed" and engine.variables.is_manual(edge.next_state):
            self._gave_up = f" after {edge.state} {edge.event}" + f": {outcome.note}" * bool(outcome.note)
        if move.raised >= 0:
            raised = engine.net.edges[move.raised]
            self._begin(engine.net.source[move.raised], None, raised.event)
        self._enter(move.entered)
        self._holds.release()

    # Requests

    def _request(self, visit: Visit, kind: str, event: str, text: str) -> None:
        self._requests += 1
        now_s, number = float(self._env.now), self._requests
        visit.pending = Pending(number, kind, visit.path, event, now_s)
        self._emit(Requested(now_s, number, kind, visit.path, event, text))
        edge = self.machine.edge_index(visit.path, event) if event else -1
        self._voice.request(number, kind, visit.node, edge)

    def _ask_data(self, visit: Visit, what: str) -> simpy.Event:
        """A program asks for data: the event has it when the operator has answered."""
        self._request(visit, "data", "", what)
        assert visit.pending is not None
        event = self._data[visit.pending.request] = self._env.event()
        return event

    def _close(self, visit: Visit) -> None:
        """A request is over although its state stays."""
        assert visit.pending is not None
        request, visit.pending = visit.pending.request, None
        self._data.pop(request, None)
        self._voice.withdrawn(request)

    # Ends

    def _end(self) -> None:
        for visit in tuple(self._visits.values()):
            visit.wake(Answer("over", note="the machine has ended"))
        if not self._ended.triggered:
            self._ended.succeed()

    def _fall(self, cause: str) -> None:
        if self._fallen is None:
            self._fallen = cause
        self._end()

    def _result(self) -> Result:
        if self._fallen is not None:
            self._set_mode("not_recoverable", self.state)
            return Result("failed", self._fallen, self.round_trips)
        if self._preempted:
            return Result("failed", self._preempted, self.round_trips)
        now, last = self._engine.configuration, self._last
        if now.outcome and now.outcome not in self.machine.goals:
            return Result("failed", f"ended with {now.outcome}{self._why(last)}", self.round_trips)
        if last is None or now.outcome or self._edge(last).kind != "command":
            return Result("completed", "", self.round_trips)
        return Result("failed", f"ended by the operator in {last.path}{self._gave_up}", self.round_trips)

    def _why(self, last: Outcome | None) -> str:
        return f" from {last.path} {last.event}" + f": {last.note}" * bool(last.note) if last is not None else ""

    # Helpers

    def _edge(self, outcome: Outcome) -> Edge:
        return self.machine.edge(outcome.path, outcome.event)

    def _number(self, outcome: Outcome) -> int:
        return self.machine.edge_index(outcome.path, outcome.event)

    def _show_mode(self, path: str) -> None:
        """The mode of the machine is the worst of its states'."""
        self._set_mode(max((v.mode for v in self._visits.values()), key=MODES.index, default="normal"), path)

    def _set_mode(self, mode: str, path: str) -> None:
        if mode != self.mode:
            self.mode = mode
            self._emit(ModeChanged(float(self._env.now), path, mode))
            self._voice.mode(mode)


def _decides(visit: Visit) -> bool:
    return visit.state is not None and visit.state.decides


def _signal(process: simpy.Process) -> Signal:
    return Signal(*cast(tuple[Any, ...], process.value))
