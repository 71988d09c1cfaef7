"""Runs a machine on the clock: starts programs, guards outcomes, keeps counts, asks and obeys the operator.

It knows no robot and no link, takes no time of its own and polls nothing. What meets at one instant is settled by order
of arrival, but a fall wins over everything, and a forced event wins over an outcome of the program that the executive
has not yet taken up. Once an answer is accepted, later commands for the same visit are ignored.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any, Literal, cast

import simpy

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.core.records import Emit, ModeChanged, Released, Requested, TransitionTaken
from teleop_sim.machines.counts import Variables
from teleop_sim.machines.declare import FELL, Autonomy, Edge, Machine
from teleop_sim.machines.voice import Voice

How = Literal["autonomous", "confirmed", "forced"]
Wait = Generator[simpy.Event, Any, None]


@dataclass(frozen=True)
class Result:
    """How the machine ended: ``completed`` or ``failed``, why, and how many requests were answered."""

    outcome: Literal["completed", "failed"]
    cause: str
    round_trips: int


@dataclass(frozen=True)
class Pending:
    """A request that is open. ``event`` is empty for kind ``manual``."""

    request: int
    kind: Literal["confirm", "manual"]
    event: str
    since_s: float


@dataclass(frozen=True)
class _Answer:
    """What ends a wait: an operator's answer, a level that is high enough, or a fall."""

    kind: Literal["confirmed", "rejected", "forced", "autonomous", "fell"]
    event: str = ""
    note: str = ""


@dataclass(frozen=True)
class _Taken:
    """An outcome that is to be taken. ``signal`` is empty if a person forced it."""

    edge: Edge
    how: How
    signal: str
    note: str
    waited_s: float


class Executive:
    """One run of one machine. ``run()`` is its process; the other public methods are commands that have arrived.

    Args:
        env: the clock.
        machine: what to run.
        level: autonomy level, 0 to 3.
        start_program: starts the program of a state as a process whose value is ``(signal, note)``. When it is
            interrupted it must bring the robot to rest and end; of its value then only ``!fell`` is heeded.
        voice: to the operator.
        emit: to the log.

    Raises:
        BadInput: the level is not 0 to 3.

    """

    def __init__(
        self,
        env: simpy.Environment,
        machine: Machine,
        level: int,
        start_program: Callable[[str], simpy.Process],
        voice: Voice,
        emit: Emit,
    ) -> None:
        _check_level(level)
        self._env, self._start_program, self._voice, self._emit = env, start_program, voice, emit
        self.machine, self.level, self.state = machine, level, machine.start
        self.variables = Variables(machine)
        self.mode = "normal"
        self.round_trips = 0
        self.pending: Pending | None = None
        self.running = False
        self._requests = 0
        self._entered_s, self._waited_s = 0.0, 0.0
        self._answer: _Answer | None = None
        self._fallen: str | None = None
        self._gave_up = ""
        self._called = env.event()

    # Commands that have arrived

    def confirm(self, request: int) -> None:
        """Let the suggested event pass, if the request is the one that is open."""
        if self._open(request, "confirm"):
            self._accept(_Answer("confirmed"), request, "confirm", "answered")

    def reject(self, request: int) -> None:
        """Refuse the suggested event: the state's program is run again."""
        if self._open(request, "reject"):
            self._accept(_Answer("rejected"), request, "reject", "answered")

    def force(self, event: str) -> None:
        """Take an event that is declared for the present state, whatever its program does or suggests."""
        pending = self.pending
        if not self.running or not self.machine.has_edge(self.state, event):
            self._ignore(event, f"not declared for {self.state}" if self.running else "the machine is not running")
        elif pending is not None:
            self._accept(_Answer("forced", event), pending.request, event, "answered")
        else:
            self._accept(_Answer("forced", event), 0, event, "forced")

    def set_level(self, level: int) -> None:
        """Set the autonomy level. A suggested event that the new level lets pass, passes.

        Raises:
            BadInput: the level is not 0 to 3.

        """
        _check_level(level)
        self.level = level
        self._release(0, f"level {level}", "level", "")
        self._voice.level(level)
        pending = self.pending
        suggested = pending is not None and pending.kind == "confirm" and self._answer is None
        if pending and suggested and self.machine.edge(self.state, pending.event).passes(level):
            self._wake(_Answer("autonomous"))

    def fell(self, cause: str) -> None:
        """The robot is down, whoever noticed: the machine cannot recover."""
        self._fallen = cause
        self._wake(_Answer("fell", note=cause))

    # The process

    def run(self) -> Generator[simpy.Event, Any, Result]:
        """Process: visit states until an end is reached or the robot is down."""
        self.running = True
        taken: _Taken | None = None
        while self.state not in self.machine.ends and self._fallen is None:
            taken = yield from self._visit()
            if taken is not None:
                self._take(taken)
        self.running = False
        return self._result(taken)

    def _visit(self) -> Generator[simpy.Event, Any, _Taken | None]:
        """One visit to the present state: attempts until an outcome passes. None when the robot is down."""
        self._entered_s = float(self._env.now)
        self._set_mode(self.variables.mode(self.state))
        self._answer = None
        while self._fallen is None:
            taken = yield from self._attempt()
            # A fall in the same instant leaves nothing to take.
            if taken is not None and self._fallen is None:
                return taken
        return None

    def _attempt(self) -> Generator[simpy.Event, Any, _Taken | None]:
        if not self.machine.state(self.state).program:
            answer = yield from self._ask("manual", "", "waits for the operator")
            return self._answered(answer, None, "", "")
        process = self._start_program(self.state)
        yield from self._until(process)
        if self._answer is not None:
            yield from self._bring_to_rest(process)
            return self._answered(self._answer, None, "", "")
        signal, note = _value(process)
        if signal == FELL:
            self._fallen = note or "the robot fell"
            return None
        edge = self.variables.trigger(self.state, signal)
        if edge.passes(self.level):
            return _Taken(edge, "autonomous", signal, note, 0.0)
        answer = yield from self._ask("confirm", edge.event, note)
        return self._answered(answer, edge, signal, note)

    def _until(self, process: simpy.Process) -> Wait:
        """Wait for the program, or for a command that ends it."""
        if self._answer is None:
            self._called = self._env.event()
            yield process | self._called

    def _bring_to_rest(self, process: simpy.Process) -> Wait:
        assert self._answer is not None
        if process.is_alive:
            process.interrupt(f"forced {self._answer.event}" if self._answer.kind == "forced" else self._answer.note)
            yield process
        signal, note = _value(process)
        if signal == FELL and self._fallen is None:
            self._fallen = note or "the robot fell"

    def _ask(self, kind: Literal["confirm", "manual"], event: str, text: str) -> Generator[simpy.Event, Any, _Answer]:
        self._requests += 1
        self.pending = Pending(self._requests, kind, event, float(self._env.now))
        self._emit(Requested(float(self._env.now), self._requests, kind, self.state, event, text))
        self._voice.request(self._requests, kind, self.state, event)
        if self._answer is None:
            self._called = self._env.event()
            yield self._called
        self._waited_s = float(self._env.now) - self.pending.since_s
        self.pending = None
        assert self._answer is not None
        return self._answer

    def _answered(self, answer: _Answer, edge: Edge | None, signal: str, note: str) -> _Taken | None:
        """What an answer makes of the suggested outcome; None: try again, or the robot is down."""
        self._answer = None
        waited_s = self._waited_s if answer.kind != "fell" else 0.0
        self._waited_s = 0.0
        if answer.kind == "forced":
            self._set_mode("manual")
            return _Taken(self.machine.edge(self.state, answer.event), "forced", "", note, waited_s)
        if edge is None or answer.kind in ("rejected", "fell"):
            return None
        return _Taken(edge, "confirmed" if answer.kind == "confirmed" else "autonomous", signal, note, waited_s)

    def _take(self, taken: _Taken) -> None:
        edge, now_s = taken.edge, float(self._env.now)
        before = self.variables.failures.get(edge.state, 0)
        self.variables.update(edge, taken.signal)
        retries = max(before, self.variables.failures.get(edge.state, 0))
        self._emit(
            TransitionTaken(
                now_s, edge.state, edge.event, edge.next_state, self._entered_s, taken.how, self.mode, retries,
                edge.threshold, self.level, taken.waited_s, taken.note,
            )
        )  # fmt: skip
        self._voice.transition(self.machine.edge_index(edge.state, edge.event), edge.state, edge.event, edge.next_state)
        if edge.kind == "failed" and self.machine.state(edge.next_state).manual:
            self._gave_up = f" after {edge.state} {edge.event}" + f": {taken.note}" * bool(taken.note)
        self.state = edge.next_state

    def _result(self, last: _Taken | None) -> Result:
        if self._fallen is not None:
            self._set_mode("not_recoverable")
            return Result("failed", self._fallen, self.round_trips)
        if last is None or last.edge.kind != "command":
            return Result("completed", "", self.round_trips)
        return Result("failed", f"ended by the operator in {last.edge.state}{self._gave_up}", self.round_trips)

    # Helpers

    def _open(self, request: int, command: str) -> bool:
        """Is this the open request of a suggested event? If not, say so in the log."""
        pending = self.pending
        if pending is None or pending.request != request or self._answer is not None:
            self._ignore(f"{command} {request}", "no such request is open")
            return False
        if pending.kind != "confirm":
            self._ignore(f"{command} {request}", "nothing is suggested: an event is asked for")
            return False
        return True

    def _accept(self, answer: _Answer, request: int, command: str, effect: str) -> None:
        if self._answer is not None or self._fallen is not None:
            self._ignore(command, "already decided")
            return
        self.round_trips += effect == "answered"
        self._release(request, command, effect, self.state)
        self._wake(answer)

    def _wake(self, answer: _Answer) -> None:
        if self._answer is None:
            self._answer = answer
        if not self._called.triggered:
            self._called.succeed()

    def _ignore(self, command: str, note: str) -> None:
        self._release(0, command, "ignored", note)
        self._voice.line(f"ignored {command}: {note}")

    def _release(self, request: int, command: str, effect: str, note: str) -> None:
        self._emit(Released(float(self._env.now), request, command, effect, note))

    def _set_mode(self, mode: str) -> None:
        if mode != self.mode:
            self.mode = mode
            self._emit(ModeChanged(float(self._env.now), self.state, mode))
            self._voice.mode(mode)


def _value(process: simpy.Process) -> tuple[str, str]:
    signal, note = cast(tuple[str, str], process.value)
    return signal, note


def _check_level(level: int) -> None:
    if level not in tuple(Autonomy):
        raise BadInput((Problem("autonomy level", f"{level!r}", "Give 0 to 3 (off, low, high, full)."),))
