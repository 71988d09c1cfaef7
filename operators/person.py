"""One person at the control station: sees only what arrived, acts only by sending.

Law: with the same generator, the time from the arrival of request n to its answer does not depend on the link, for one
person alone whom load does not slow. So every request has random draws of its own, keyed by its number, and everything
else gives way the moment it arrives.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from teleop_sim.channel.messages import (
    Image,
    LogLine,
    Message,
    Reject,
    Request,
    ResetWorld,
)
from teleop_sim.operators.acts import Process, Purpose, Unanswered, Urgency, describe, either
from teleop_sim.operators.desk import Errand, Order, wanted
from teleop_sim.operators.human import happens, misjudged
from teleop_sim.operators.inbox import Inbox
from teleop_sim.operators.timing import words_in


class Person(Inbox):
    """Serves one thing at a time, the most urgent first (``acts.Urgency``). See ``docs/operator.md``."""

    def run(self) -> Process:
        """Process: never ends."""
        while True:
            if self._requests and (self._requests_help() or not (self._orders or self.talks)):
                yield from self._answer(self._next_request())
            elif self._orders:
                yield from self._obey(self._orders.pop(0))
            elif self._errands:
                yield from self._run_errand(self._errands.pop(0))
            elif self.talks:
                yield from self._talk(self.talks[0])
            elif late := self._overdue():
                yield from self._repeat(late)
            elif advice := self._advice():
                yield from self._advise(advice)
            elif self._unread:
                yield from self._read(self._unread.popleft())
            else:
                yield from self._wait()

    def _wait(self) -> Process:
        self._news, self._rests = self._env.event(), True
        self._due_s = self._next_due_s()
        if self._due_s < math.inf:
            # One that rings too soon is cheaper than one more for each message that puts it off.
            if self._alarm.processed or self._due_s < self._alarm_s:
                self._alarm, self._alarm_s = self._env.timeout(self._due_s - self._env.now), self._due_s
            yield either(self._news, self._alarm)
        else:
            yield self._news
        self._rests = False

    # What is done --------------------------------------------------------------------------------------------------

    def _answer(self, request: Request) -> Process:
        self._serving = request.request
        rng = self._draws(Purpose.ANSWER, request.request)
        if self.belief.age_s(float(self._env.now)) > self._policy.stale_s(request):
            yield from self._look_again(request)
        if request.kind == "act":
            yield from self._move_and_wait(request) if self._desk.hands is None else self._by_hand(request)
        if request.kind == "data":
            yield from self._fetch(request, self._tries.get(request.request, 0))
        question = self.belief.question(request)
        start_s = self._env.now
        yield self._env.timeout(self._sample_s(self._thinking_s(request, question), rng))
        self._record(start_s, "decide", request.request, question)
        messages: tuple[Message, ...] = ()
        if request.request in self._asked:
            if self._policy.verifies:
                self._compare(request)
            messages = self._given[request.request] = self._decided(request)
        if request.kind == "manual" and messages:
            self.belief.note_help()
        if any(isinstance(message, Reject) for message in messages):
            self.belief.note_refusal(request)
        if not (messages and self._passed_on(request, messages)):
            yield from self._send_all(request, messages, rng)
            self._note_laid(float(start_s), request, messages)
        self._serving = 0
        if not messages and self._wanting(request):
            self._requests.append(request)
        self._weigh()

    def _wanting(self, request: Request) -> bool:
        """Is there something to ask for, so that this can be answered after all?"""
        return request.request in self._asked and wanted(self._desk.giver(request), self.belief) is not None

    def _thinking_s(self, request: Request, question: str) -> float:
        words, giver = words_in(question), self._desk.giver(request)
        if giver is not None:
            return self._timing.read_line_s(words) + giver.work_s(self.belief, request, self._timing)
        mean_s = self._timing.judge_s(words) if request.kind == "confirm" else self._timing.plan_s(words)
        compares = self._policy.verifies and self.belief.shown(request) is not None
        return mean_s + (self._timing.read_image_s() if compares else 0.0)

    def _decided(self, request: Request) -> tuple[Message, ...]:
        giver = self._desk.giver(request)
        if giver is not None:
            tries = self._tries[request.request] = self._tries.get(request.request, 0) + 1
            rng = self._draws(Purpose.GIVE, request.request, tries)
            return giver.give(self.belief, request, rng)
        messages = self._policy.answer(self.belief, request)
        rate = self._rate(self._human.misjudge_rate)
        if rate > 0.0 and happens(rate, self._draws(Purpose.MISJUDGE, request.request)):
            return misjudged(messages)
        return messages

    def _passed_on(self, request: Request, messages: tuple[Message, ...]) -> bool:
        """What was done by hand the supervisor tells the machine; is that somebody else?"""
        if request.kind != "act":
            return False
        self.belief.note_in_lieu(self.belief.path_of(request))
        other = self._desk.seats["supervisor"]
        if other is self:
            return False
        said = f"done {self.belief.spoken(request)}"
        self._talk_of((self, other), request, said, lambda: other.order(request, messages))
        return True

    def _obey(self, order: Order) -> Process:
        yield from self._send_all(order.request, order.messages, self._draws(Purpose.ORDER, order.request.request))

    def _run_errand(self, errand: Errand) -> Process:
        """Have a look, put right what is off, and tell who asked."""
        request, asker = errand.request, errand.asker
        if self._desk.hands is None or not self._stands(request):
            return
        self._acting = "primary" if errand.what == "hand" else "auxiliary"
        rng = self._draws(Purpose.CHECK, request.request)
        if errand.what == "world":
            deeds = self._resetting(request)
        else:
            deeds = self._desk.hands.checking(self.belief, request, errand.what, rng)
        well = yield from self._carry_out(request, deeds, rng)
        self._acting = None
        if asker is self:
            self.take(request)
        elif self._stands(request):
            self._talk_of((self, asker), request, errand.told(well), lambda: asker.take(request))

    def _move_and_wait(self, request: Request) -> Process:
        """Move a hand by eye: a small open-loop movement, then wait for what it has done, and so on (Ferrell 1965)."""
        rng, step = self._draws(Purpose.MOVE, request.request), 0
        while request.request in self._asked:
            start_s = self._env.now
            yield self._env.timeout(self._sample_s(self._timing.approach_s(), rng))
            move = self._policy.move(self.belief, request, step, rng)
            step += 1
            self._record(start_s, "decide", request.request, f"move {step}" if move is not None else "nothing to move")
            if move is None:
                return
            yield from self._send_all(request, (move,), rng)
            self.belief.note_move(request)
            yield from self._await_view(request)

    def _repeat(self, late: Unanswered) -> Process:
        rng = self._draws(Purpose.REPEAT, late.request.request, late.repeats)
        start_s = self._env.now
        duration_s = self._sample_s(self._timing.repeat_s(), rng)
        cut = yield from self._interruptible(duration_s, Urgency.REPEAT)
        if cut or late.request.request not in self._unanswered:
            self._record(start_s, "decide", late.request.request, "dropped: send again")
            return
        self._submit(start_s, late.request, late.messages[-1], "again: ")
        wait_s = late.wait_s * self._timing.patience_growth
        self._unanswered[late.request.request] = replace(
            late, wait_s=wait_s, due_s=self._env.now + wait_s, repeats=late.repeats + 1
        )

    def _advise(self, advice: tuple[Message, ...]) -> Process:
        """Do what nobody asked for, if it is still right when it has been thought about."""
        self._advised += 1
        rng, start_s = self._draws(Purpose.ADVISE, self._advised), self._env.now
        text = ", ".join(describe(message, "", self.belief.machine) for message in advice)
        cut = yield from self._interruptible(self._sample_s(self._timing.notice_s(), rng), Urgency.ADVISE)
        dropped = cut or self._advice() != advice
        self._record(start_s, "decide", 0, f"dropped: {text}" if dropped else text)
        if not dropped:
            yield from self._have_done(advice, rng)

    def _have_done(self, advice: tuple[Message, ...], rng: np.random.Generator) -> Process:
        """Do it, or ask whose part it is: the world model is the auxiliary operator's."""
        other = self._desk.seats["auxiliary"] if any(isinstance(m, ResetWorld) for m in advice) else self
        if other is self:
            yield from self._send_all(NOBODY, advice, rng)
            return
        self.belief.work.note_reset()
        said = ", ".join(describe(message, "", self.belief.machine) for message in advice)
        self._talk_of((self, other), NOBODY, said, lambda: other.order(NOBODY, advice))

    def _read(self, item: LogLine | Image) -> Process:
        is_line = isinstance(item, LogLine)
        text = item.text if isinstance(item, LogLine) else "picture"
        mean_s = self._timing.read_line_s(words_in(text)) if is_line else self._timing.read_image_s()
        start_s = self._env.now
        dropped = yield from self._interruptible(self._sample_s(mean_s, self._reading_rng), Urgency.READ)
        self._record(start_s, "read", 0, f"dropped: {text}" if dropped else text)


NOBODY = Request(0, "confirm", 0)
"""Stands for the request that is answered by what nobody asked for."""
