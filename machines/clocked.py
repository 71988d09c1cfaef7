"""Runs a machine by the executive on a clock, with a robot and a crew that answer from tables."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any, cast

import simpy

from teleop_sim.core.records import Emit
from teleop_sim.machines.chances import CONFIRM, REJECT
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.executive import Executive, Result
from teleop_sim.machines.stub import Crew, Reply, Robot, starter


def on_clock(
    machine: Machine,
    level: int,
    robot: Robot,
    crew: Crew,
    emit: Emit,
    plan: Callable[[simpy.Environment, Executive], None] | None = None,
) -> tuple[Result, float]:
    """Run a machine to its end and return how it ended, and when [s].

    The crew sits beside the robot: no link is between them.

    Args:
        machine: what to run.
        level: autonomy level at the start, 0 to 3.
        robot, crew: who answers.
        emit: to the log.
        plan: is called once before the run; it may start processes that command the executive.

    Raises:
        BadInput: the level is none, or the robot answers what the machine does not know.
        RuntimeError: nobody answers what is asked (SimPy's: nothing is left to happen).

    """
    env = simpy.Environment()
    ears = _Ears(env, machine, crew)
    executive = ears.executive = Executive(env, machine, level, starter(env, robot), ears, emit)
    if plan is not None:
        plan(env, executive)
    result = cast(Result, env.run(env.process(executive.run())))
    return result, float(env.now)


class _Ears:
    """Hears requests and has the crew answer them; everything else is not listened to."""

    executive: Executive

    def __init__(self, env: simpy.Environment, machine: Machine, crew: Crew) -> None:
        self._env, self._machine, self._crew = env, machine, crew

    def request(self, request: int, kind: str, node: int, edge: int) -> None:
        path = self._machine.net.nodes[node].path
        reply = self._crew(kind, path, self._machine.table[edge].event if edge >= 0 else "")
        if reply is not None:
            self._env.process(self._answer(request, path, reply))

    def transition(self, edge: int) -> None: ...
    def mode(self, mode: str) -> None: ...
    def level(self, level: int) -> None: ...
    def withdrawn(self, request: int) -> None: ...
    def paused(self, paused: bool) -> None: ...
    def locked(self, node: int, locked: bool) -> None: ...
    def snapshot(self) -> None: ...
    def line(self, text: str) -> None: ...

    def _answer(self, request: int, path: str, reply: Reply) -> Generator[simpy.Event, Any, None]:
        yield self._env.timeout(reply.time_s)
        if all(p.request != request for p in self.executive.pendings):
            return
        if reply.what == CONFIRM:
            self.executive.confirm(request)
        elif reply.what == REJECT:
            self.executive.reject(request)
        else:
            self.executive.force(reply.what, path)
