"""The processes of a running machine, one for each active state; what operators may do is in ``executive.py``."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import replace
from typing import Any, cast

import simpy

from teleop_sim.core.records import Emit, TransitionTaken
from teleop_sim.machines.counts import Variables
from teleop_sim.machines.declare import FELL, Edge, Machine
from teleop_sim.machines.elements import State
from teleop_sim.machines.ending import Ending, Result
from teleop_sim.machines.engine import Engine
from teleop_sim.machines.holds import Holds
from teleop_sim.machines.keys import Keys
from teleop_sim.machines.modes import Modes
from teleop_sim.machines.requests import Requests
from teleop_sim.machines.visits import Answer, Outcome, Pending, Signal, Start, Visit
from teleop_sim.machines.voice import Voice

__all__ = ["Result", "Running", "StartProgram"]

Wait = Generator[simpy.Event, Any, None]
WaitFor = Generator[simpy.Event, Any, Outcome | None]
StartProgram = Callable[[Start], simpy.Process]


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
        self._engine, self._keys, self._ending = Engine(machine, level), Keys(machine), Ending()
        self._visits: dict[str, Visit] = {}
        self._holds = Holds(self._engine, self._visits)
        self._requests = Requests(env, self._engine, voice, emit)
        self._ended = env.event()
        self._modes = Modes(env, self._visits, voice, emit)
        self.round_trips, self.running = 0, False

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
    def mode(self) -> str:
        """``normal``, ``auto``, ``manual`` or ``not_recoverable``."""
        return self._modes.mode

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
        if not self._ended.triggered:
            self._enter(self._engine.configuration.active)
        yield self._ended
        while at_work := [v.process for v in self._visits.values() if v.process is not None]:
            yield simpy.AllOf(self._env, at_work)
        self.running = False
        if self._ending.fallen is not None:
            self._modes.set("not_recoverable", self.state)
        return self._ending.result(self._engine, self.round_trips)

    # Visits

    def _enter(self, states: tuple[int, ...], raised: int = -1) -> None:
        """Begin the visits of states that were entered, or of a container that has ended inside."""
        engine = self._engine
        if engine.over():
            self._end()
            return
        self._keys.enter(states)
        for number in states:
            element = engine.net.nodes[number].element
            self._begin(number, element if isinstance(element, State) else None)
        if raised >= 0:
            self._begin(engine.net.source[raised], None, engine.net.edges[raised].event)
        self._modes.show()
        self._holds.suspend()

    def _begin(self, number: int, state: State | None, raised: str = "", forced: str = "") -> None:
        path = self._engine.net.nodes[number].path
        mode = "manual" if forced else self._engine.variables.mode(path)
        visit = Visit(number, path, state, raised, float(self._env.now), mode, self._env.event())
        self._visits[path] = visit
        outcome = visit.leaving = Outcome(path, forced, "forced") if forced else None
        visit.process = self._env.process(self._visit(visit) if outcome is None else self._take(visit, outcome))

    def _visit(self, visit: Visit) -> Wait:
        """Process: attempts until an outcome may be taken, and take it."""
        outcome: Outcome | None = None
        while outcome is None and not visit.over:
            outcome = yield from self._attempt(visit)
            outcome = yield from self._hold(visit, outcome)
        if outcome is not None:
            yield from self._take(visit, outcome)
        elif self._visits.get(visit.path) is visit:
            del self._visits[visit.path]

    def _attempt(self, visit: Visit) -> WaitFor:
        yield from self._holds.until_free(visit)
        if visit.answer is not None:
            return (yield from self._answered(visit, None))
        state, visit.mode, visit.waited_s = visit.state, self._engine.variables.mode(visit.path), 0.0
        self._modes.show()
        if state is None:
            return (yield from self._guard(visit, Outcome(visit.path, visit.raised, "autonomous")))
        if state.decides:
            return (yield from self._guard(visit, Outcome(visit.path, state.suggests, "autonomous")))
        if not state.program:
            return (yield from self._ask(visit, Outcome(visit.path, "", "forced"), *_by_hand(state)))
        return (yield from self._work(visit, state))

    def _work(self, visit: Visit, state: State) -> WaitFor:
        parameters = {name: self.machine.value(value) for name, value in state.parameters}

        def ask(what: str) -> simpy.Event:
            return self._requests.ask_data(visit, what)

        start = Start(visit.path, state.program, self._keys.read(visit.node), parameters, ask)
        program = visit.program = self._start_program(start)
        while visit.busy and visit.answer is None:
            yield program | visit.wait()
        self._requests.close(visit)
        interrupted = visit.busy
        if interrupted:
            assert visit.answer is not None
            program.interrupt(visit.answer.note or f"{visit.answer.kind} {visit.answer.event}".strip())
            yield program
        ended = Signal(*cast(tuple[Any, ...], program.value))
        if ended.signal == FELL:
            self._fall(ended.note or "the robot fell")
        # What has ended at the very instant of a pause has ended; it is not done twice.
        if visit.answer is not None and (interrupted or visit.answer.kind != "suspended"):
            return (yield from self._answered(visit, None))
        visit.answer = None
        self._keys.write(visit.node, ended.writes)
        edge = self._engine.net.edges[self._engine.trigger(visit.path, ended.signal)]
        return (yield from self._guard(visit, Outcome(visit.path, edge.event, "autonomous", ended.signal, ended.note)))

    # Outcomes

    def _guard(self, visit: Visit, outcome: Outcome) -> WaitFor:
        """Let the outcome pass, or ask."""
        if outcome.event and self._edge(outcome).passes(self.level):
            return outcome
        decides = visit.state is not None and visit.state.decides
        return (yield from self._ask(visit, outcome, "decide" if decides else "confirm", outcome.note))

    def _ask(self, visit: Visit, outcome: Outcome, kind: str, text: str) -> WaitFor:
        self._requests.ask(visit, kind, outcome.event, text)
        since_s = float(self._env.now)
        while visit.answer is None and not self._holds.passes(visit):
            yield visit.wait()
        visit.waited_s = float(self._env.now) - since_s
        if visit.answer is None:
            return replace(outcome, waited_s=visit.waited_s)
        return (yield from self._answered(visit, outcome))

    def _answered(self, visit: Visit, outcome: Outcome | None) -> WaitFor:
        """What an answer makes of the suggested outcome; None: try again, or the visit is over."""
        answer, waited_s = visit.answer, visit.waited_s
        assert answer is not None
        if answer.kind == "confirmed" and outcome is not None:
            visit.answer = None
            return replace(outcome, how="confirmed", waited_s=waited_s)
        if answer.kind == "forced":
            visit.answer = None
            self._modes.by_hand(visit)
            return Outcome(visit.path, answer.event, "forced", "", outcome.note if outcome else "", waited_s)
        self._requests.close(visit)
        if visit.over:
            return None
        visit.answer = None
        if answer.kind == "taken_over":
            self._modes.by_hand(visit)
            return (yield from self._ask(visit, Outcome(visit.path, "", "forced"), "act", "the operator acts instead"))
        if answer.kind == "rejected" and visit.state is None:
            self._again(visit)
        return None

    def _again(self, visit: Visit) -> None:
        """A container's outcome was refused: what is in it begins anew."""
        visit.over = True
        del self._visits[visit.path]
        move = self._engine.again(visit.node)
        self._keys.drop(visit.node)
        self._enter(move.entered)
        self._voice.snapshot()

    def _hold(self, visit: Visit, outcome: Outcome | None) -> WaitFor:
        """Wait while the state is locked or nothing may pass; then the guard decides anew."""
        while outcome is not None and not visit.over and self._holds.blocked(visit, outcome):
            self._requests.close(visit)
            visit.held = outcome
            while visit.answer is None and self._holds.blocked(visit, outcome):
                yield visit.wait()
            visit.held = None
            if visit.answer is not None:
                outcome = yield from self._answered(visit, outcome)
            elif outcome.how == "autonomous":
                outcome = yield from self._guard(visit, outcome)
        return outcome

    def _take(self, visit: Visit, outcome: Outcome) -> Wait:
        """Bring everything to rest that is left, then take the outcome. A pause meanwhile holds it."""
        visit.leaving, level = outcome, self.level
        while not visit.over:
            if others := self._holds.left_with(visit, outcome):
                self._requests.close(visit)
                for other in others:
                    other.wake(Answer("left", note=f"left with {outcome.path} {outcome.event}"))
                yield simpy.AllOf(self._env, [v.process for v in others if v.process is not None])
            elif self._holds.stopped(visit):
                self._requests.close(visit)
                yield visit.wait()
            else:
                break
        if visit.over:
            self._requests.close(visit)
        del self._visits[visit.path]
        if not visit.over:
            self._taken(visit, outcome, level)

    def _taken(self, visit: Visit, outcome: Outcome, level: int) -> None:
        engine, edge = self._engine, self._edge(outcome)
        number = self.machine.edge_index(edge.state, edge.event)
        before = engine.variables.failures.get(edge.state, 0)
        if visit.raised:
            self._keys.ended(visit.node)
        move = engine.take(number, outcome.signal)
        self._keys.drop(visit.node)
        self._keys.close(engine.configuration)
        retries = max(before, engine.variables.failures.get(edge.state, 0))
        self._emit(
            TransitionTaken(
                float(self._env.now), edge.state, edge.event, edge.next_state, visit.entered_s, outcome.how, visit.mode,
                retries, edge.threshold, level, outcome.waited_s, outcome.note,
            )
        )  # fmt: skip
        self._voice.transition(number)
        self._ending.taken(outcome, edge, engine)
        self._enter(move.entered, move.raised)
        self._holds.release()

    # Ends

    def _end(self) -> None:
        for visit in tuple(self._visits.values()):
            visit.wake(Answer("over", note="the machine has ended"))
        if not self._ended.triggered:
            self._ended.succeed()

    def _fall(self, cause: str) -> None:
        if self._ending.fallen is None:
            self._ending.fallen = cause
        self._end()

    # Helpers

    def _edge(self, outcome: Outcome) -> Edge:
        return self.machine.edge(outcome.path, outcome.event)


def _by_hand(state: State) -> tuple[str, str]:
    """What a state that waits for a person asks for: help, or to act from the start; and in words."""
    if ("request", "act") in state.parameters:
        return "act", "the operator acts"
    return "manual", "waits for the operator"
