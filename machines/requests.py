"""What a running machine asks of the operator: numbered, told, and withdrawn when it is over."""

from __future__ import annotations

import simpy

from teleop_sim.core.records import Emit, Requested
from teleop_sim.machines.engine import Engine
from teleop_sim.machines.visits import Pending, Visit
from teleop_sim.machines.voice import Voice


class Requests:
    """The open requests of a running machine; a visit has at most one."""

    def __init__(self, env: simpy.Environment, engine: Engine, voice: Voice, emit: Emit) -> None:
        self._env, self._engine, self._voice, self._emit = env, engine, voice, emit
        self._count = 0
        self._data: dict[int, simpy.Event] = {}

    def ask(self, visit: Visit, kind: str, event: str, text: str) -> None:
        """Ask; what the visit asked before is over."""
        self.close(visit)
        self._count += 1
        now_s, number = float(self._env.now), self._count
        visit.pending = Pending(number, kind, visit.path, event, now_s)
        self._emit(Requested(now_s, number, kind, visit.path, event, text))
        edge = self._engine.machine.edge_index(visit.path, event) if event else -1
        self._voice.request(number, kind, visit.node, edge)

    def ask_data(self, visit: Visit, what: str) -> simpy.Event:
        """A program asks for data: the event has it when the operator has answered.

        Of a program that comes to rest nothing is asked, and the event never comes.
        """
        event = self._env.event()
        if visit.answer is None and not visit.over:
            self.ask(visit, "data", "", what)
            assert visit.pending is not None
            self._data[visit.pending.request] = event
        return event

    def give(self, visit: Visit, data: object) -> bool:
        """Hand the operator's data to the program that waits for it; False if the visit asks for none."""
        event = self._data.get(visit.pending.request) if visit.pending is not None else None
        if event is None:
            return False
        self.close(visit)
        event.succeed(data)
        return True

    def close(self, visit: Visit) -> None:
        """A request, if there is one, is over although its state is not left at this instant."""
        if visit.pending is not None:
            request, visit.pending = visit.pending.request, None
            self._data.pop(request, None)
            self._voice.withdrawn(request)
