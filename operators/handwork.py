"""Work that is more than an answer: asking for what is needed first, checking for somebody, doing a state by hand."""

from __future__ import annotations

from collections.abc import Callable, Generator

import numpy as np
import simpy

from teleop_sim.channel.messages import Message, Request, ResetWorld, TemplateInsert, TemplateMove, encode_message
from teleop_sim.core.records import Layer
from teleop_sim.operators.acts import Process, Purpose, either
from teleop_sim.operators.clouds import ask_s
from teleop_sim.operators.deeds import Awaited, Deed, Deeds, only
from teleop_sim.operators.desk import Wanting, wanted
from teleop_sim.operators.worker import Worker

Asking = Generator[simpy.Event, object, bool]
"""A process that tells whether it went well."""


class Handworker(Worker):
    """As ``Worker``, with work through templates."""

    def _fetch(self, request: Request, tries: int) -> Process:
        """Ask for what a giver needs, and wait for it; again, and longer each time, until it has come."""
        wait_s, rng = self._timing.patience_s, self._draws(Purpose.ASK, request.request, tries)
        while self._stands(request):
            message = wanted(self._desk.giver(request), self.belief)
            if message is None:
                return
            start_s = self._env.now
            yield self._env.timeout(self._sample_s(ask_s(self._timing), rng))
            self._submit(start_s, request, message, "")
            yield from self._until(self._arrival("cloud"), self._trip_s((message,)) + wait_s)
            wait_s *= self._timing.patience_growth

    def _stands(self, request: Request) -> bool:
        """Is the request open, whoever is to answer it?"""
        return any(asked.request == request.request for asked in self.belief.mirror.asked)

    def _by_hand(self, request: Request) -> Process:
        """Do what the state does."""
        assert self._desk.hands is not None
        rng = self._draws(Purpose.MOVE, request.request)
        deeds = self._desk.hands.doing(self.belief, request, rng)
        well = yield from self._carry_out(request, deeds, rng)
        self.belief.work.done[request.request] = well
        self.belief.work.last_by_hand = self.belief.path_of(request)

    def _resetting(self, request: Request) -> Deeds:
        """Have the world model forgotten, for whoever is to answer then."""
        yield Deed("", "the world model may be wrong", self._timing.command_s(), only(ResetWorld()))
        self.belief.work.checked[request.request] = "world"
        return False

    def _carry_out(self, request: Request, deeds: Deeds, rng: np.random.Generator) -> Asking:
        """One deed after the other, as long as the request is open. Returns whether the work succeeded."""
        came: bool | None = None
        while self._stands(request):
            try:
                deed = next(deeds) if came is None else deeds.send(came)
            except StopIteration as end:
                return bool(end.value)
            yield from self._do(request, deed, rng)
            came = True
            if deed.awaits:
                came = yield from self._await_deed(request, deed, rng)
        deeds.close()
        return False

    def _do(self, request: Request, deed: Deed, rng: np.random.Generator) -> Process:
        start_s = self._env.now
        yield self._env.timeout(self._sample_s(deed.work_s, rng))
        if deed.awaits:
            self._expected = self._arrival(deed.awaits)
        made = deed.make(float(self._env.now))
        for record in made.records:
            self._emit(record)
        if not made.messages:
            self._record(start_s, "decide", request.request, deed.text)
        for k, message in enumerate(made.messages):
            self._submit(self._env.now if k else start_s, request, message, f"{deed.text}: ")
        if made.messages:
            self.belief.note_move(request)
        if deed.layer:
            self._emit(Layer(float(self._env.now), float(start_s), deed.layer, deed.text))
        self._sent = made.messages

    def _await_deed(self, request: Request, deed: Deed, rng: np.random.Generator) -> Asking:
        due_s = self._env.now + self._trip_s(self._sent) + self._timing.patience_s + deed.patience_s
        arrived = self._expected
        for other in deed.meanwhile:
            if self._stands(request):
                yield from self._do(request, other, rng)
        yield from self._until(lambda: arrived() or not self._stands(request), due_s - self._env.now)
        return arrived()

    def _until(self, arrived: Callable[[], bool], wait_s: float) -> Process:
        """Wait until something has arrived, at most so long."""
        due_s = self._env.now + wait_s
        while not arrived() and self._env.now < due_s:
            self._news = self._env.event()
            yield either(self._news, self._env.timeout(due_s - self._env.now))

    def _arrival(self, what: Awaited) -> Callable[[], bool]:
        """Has something of this kind arrived since now?"""
        work = self.belief.work

        def count() -> float:
            if what == "cloud":
                return work.clouds
            return len(work.steps) if what == "step" else work.poses

        before = count()
        return lambda: count() > before

    def _trip_s(self, messages: tuple[Message, ...]) -> float:
        bits = sum(8 * len(encode_message(message)[1]) for message in messages)
        return self._desk.briefing.round_trip_s + bits / self._desk.briefing.uplink_bps

    def _note_laid(self, start_s: float, request: Request, messages: tuple[Message, ...]) -> None:
        """What a giver has laid, or tried to."""
        if not messages and isinstance(self._desk.giver(request), Wanting):
            self._emit(Layer(float(self._env.now), start_s, "alignment", "nothing fits"))
        if any(isinstance(message, TemplateInsert | TemplateMove) for message in messages):
            self.belief.work.note_laid(len(self.belief.visited))
            self._emit(Layer(float(self._env.now), start_s, "alignment", "lay the template"))
