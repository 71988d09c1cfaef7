"""One person at the control station: sees only what arrived, acts only by sending.

Law: with the same generator, the time from the arrival of request n to its answer does not depend on the link, for one
person alone whom load does not slow. So every request has random draws of its own, keyed by its number, and everything
else gives way the moment it arrives.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import cast

import numpy as np
import simpy

from teleop_sim.channel.messages import (
    FootstepPlan,
    Image,
    LogLine,
    Message,
    Reject,
    Request,
    RequestKind,
    ResetWorld,
    encode_message,
)
from teleop_sim.core.records import Emit
from teleop_sim.machines.sync import Snapshot
from teleop_sim.operators.acts import Process, Purpose, Unanswered, Urgency, describe, trigger
from teleop_sim.operators.at_work import TOLD
from teleop_sim.operators.belief import VIEWS
from teleop_sim.operators.desk import Desk, Errand, Order, wanted
from teleop_sim.operators.handwork import Handworker
from teleop_sim.operators.human import Human, happens, misjudged
from teleop_sim.operators.roles import Role, role_of
from teleop_sim.operators.timing import OperatorTiming, words_in

SEEN = frozenset({*VIEWS, *TOLD})
"""What somebody may be waiting for."""


class Person(Handworker):
    """Serves one thing at a time, the most urgent first (``acts.Urgency``). See ``docs/operator.md``.

    Args:
        env: the clock.
        desk: what is shared.
        timing, human: how long this person takes, and what goes wrong.
        key: of the crew's random streams. seat: this person's place; the first has no number of its own.
        emit: to the log.
        roles: what this person answers for.

    """

    def __init__(
        self,
        env: simpy.Environment,
        desk: Desk,
        timing: OperatorTiming,
        human: Human,
        key: tuple[int, ...],
        seat: int,
        emit: Emit,
        roles: tuple[Role, ...],
    ) -> None:
        super().__init__(env, desk, timing, human, key, emit, roles)
        self._policy = desk.policy
        self._reading_rng = self._draws(Purpose.READ, *((seat,) if seat else ()))
        self._noticed: Snapshot | None = None
        self._policy_due_s = math.inf
        self._requests: list[Request] = []
        self._given: dict[int, tuple[Message, ...]] = {}
        self._serving = 0
        self._advised = 0
        self._orders: list[Order] = []
        self._errands: list[Errand] = []
        self._unanswered: dict[int, Unanswered] = {}
        self._tries: dict[int, int] = {}

    def notice(self, message: Message) -> None:
        """Something has arrived, and the displays have changed. What is for this person waits for attention."""
        shown = self.belief.mirror.snapshot
        # Most messages change nothing of what the mirror shows.
        changed = shown is not self._noticed or bool(self._orders or self._errands or self.talks)
        if changed:
            self._noticed = shown
            self._take_in(shown)
        kind = type(message)
        if kind in VIEWS or kind is FootstepPlan:
            self._try_again()
        if (type(message) is LogLine and "supervisor" in self.roles) or (
            type(message) is Image and "immersed" in self.roles
        ):
            self._unread.append(message)
            changed = True
        # To wake somebody for nothing takes longer than all the rest.
        if not self._news.triggered and (changed or kind in SEEN or self._minds()):
            self._news.succeed()

    def _minds(self) -> bool:
        """Does the policy want something else than it did when this person, if it is the supervisor, began to wait?"""
        if "supervisor" not in self.roles:
            return False
        return self._wake_s() != self._policy_due_s or bool(self._advice())

    def _wake_s(self) -> float:
        """When the policy wants to be asked again."""
        if "supervisor" not in self.roles:
            return math.inf
        return self._policy.wake_s(self.belief, float(self._env.now), self._desk.briefing)

    def _take_in(self, shown: Snapshot) -> None:
        """Open requests, and where the machine is, may have changed."""
        if not (shown.asked or self._asked or self._orders or self._errands or self.talks):
            return
        if self._asked or self._requests or self._orders or self._errands or self.talks:
            self._close()
        for asked in shown.asked:
            if asked.request not in self._asked:
                self._open(Request(asked.request, cast(RequestKind, asked.kind), asked.node, asked.edge))
        if self._asked or self._unanswered:
            self._weigh()

    def order(self, request: Request, messages: tuple[Message, ...]) -> None:
        """Somebody else asks this person to send something."""
        self._orders.append(Order(request, messages))
        self._call(Urgency.ORDER)
        trigger(self._news)

    def errand(self, errand: Errand) -> None:
        """Somebody, or this person himself, wants this person to have a look."""
        self._errands.append(errand)
        self._call(Urgency.ORDER)
        trigger(self._news)

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

    # What is asked -------------------------------------------------------------------------------------------------

    def _open(self, request: Request) -> None:
        """A request that the mirror shows, whether it came by itself or with the whole state."""
        if role_of(self.belief.machine, request) not in self.roles:
            return
        self._asked[request.request] = request
        new = request.request not in self._given and request.request != self._serving
        if new and not self._has_checked(request):
            self._prepare(request)
        self._call(Urgency.HELP if request.kind == "manual" else Urgency.ANSWER)

    def _prepare(self, request: Request) -> None:
        """Somebody says something to somebody before this person can answer, or nobody has to."""
        speaker, listener = self._talk_before(request)
        if speaker is listener:
            self._requests.append(request)
        else:
            said = self.belief.spoken(request)
            self._talk_of((speaker, listener), request, said, lambda: self._take(request))

    def _has_checked(self, request: Request) -> bool:
        """Have somebody look first, if anything should be looked at. Returns whether somebody will."""
        hands = self._desk.hands
        what = hands.check(self.belief, request) if hands is not None else ""
        if not what:
            return False
        errand = Errand(request, what, self)
        other = self._desk.seats["auxiliary" if what == "template" else "primary"]
        if other is self:
            self.errand(errand)
        else:
            self._talk_of((self, other), request, f"check {what}", lambda: other.errand(errand))
        return True

    def _try_again(self) -> None:
        """What could not be given for want of a view can perhaps be given now."""
        waiting = {self._serving, *(request.request for request in self._requests)}
        for number in [n for n in self._tries if n in self._asked and self._given.get(n) == () and n not in waiting]:
            del self._given[number]
            self._requests.append(self._asked[number])
            self._call(Urgency.ANSWER)

    def _talk_before(self, request: Request) -> tuple[Person, Person]:
        """Who says something to whom before this person can answer; nobody to himself.

        The supervisor asks the primary operator to act in lieu of a state, and the immersed one what he sees there.
        """
        if request.kind == "act":
            return self._desk.seats["supervisor"], self
        return self, self._desk.seats["immersed"] if request.kind == "decide" else self

    def _take(self, request: Request) -> None:
        """What had to be said before has been said."""
        if request.request in self._asked:
            self._requests.append(request)
            self._call(Urgency.ANSWER)
            trigger(self._news)

    def _close(self) -> None:
        """Forget the requests that the mirror shows no more."""
        shown = {asked.request for asked in self.belief.mirror.asked}
        self._asked = {n: r for n, r in self._asked.items() if n in shown}
        self._requests = [r for r in self._requests if r.request in self._asked]
        self._orders = [order for order in self._orders if order.request.request in (0, *shown)]
        self._errands = [errand for errand in self._errands if errand.request.request in shown]
        for talk in [talk for talk in self.talks if talk.request and talk.request not in shown]:
            talk.cancel()

    def _weigh(self) -> None:
        """Wait for the effect of the answers to those open requests at whose states the machine still is.

        If it is elsewhere they are over, even if no transition was seen; the whole state may tell that they are not.
        """
        standing = {n: r for n, r in self._asked.items() if self.belief.is_at(r)}
        self._unanswered = {n: u for n, u in self._unanswered.items() if n in standing}
        for number, request in standing.items():
            if self._given.get(number) and number not in self._unanswered and number != self._serving:
                self._expect(request, self._given[number])

    def _requests_help(self) -> bool:
        return any(request.kind == "manual" for request in self._requests)

    def _next_request(self) -> Request:
        first = min(self._requests, key=lambda r: (r.kind != "manual", r.request))
        self._requests.remove(first)
        return first

    def _overdue(self) -> Unanswered | None:
        late = [u for u in self._unanswered.values() if u.due_s <= self._env.now]
        return min(late, key=lambda u: u.due_s) if late else None

    def _advice(self) -> tuple[Message, ...]:
        """What the policy wants sent although nobody asked."""
        if "supervisor" not in self.roles:
            return ()
        return self._policy.advise(self.belief, float(self._env.now), self._desk.briefing)

    def _wait(self) -> Process:
        self._news = self._env.event()
        due_s = min((u.due_s for u in self._unanswered.values()), default=math.inf)
        self._policy_due_s = self._wake_s()
        due_s = min(due_s, self._policy_due_s)
        if due_s == math.inf:
            yield self._news
        else:
            yield self._news | self._env.timeout(due_s - self._env.now)

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
            self._note_laid(float(start_s), messages)
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
        self._acting = "auxiliary" if errand.what == "template" else "primary"
        rng = self._draws(Purpose.CHECK, request.request)
        well = yield from self._carry_out(
            request, self._desk.hands.checking(self.belief, request, errand.what, rng), rng
        )
        self._acting = None
        if asker is self:
            self._take(request)
        elif self._stands(request):
            said = f"{errand.what} {'fits' if well else 'was off'}"
            self._talk_of((self, asker), request, said, lambda: asker._take(request))

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

    def _expect(self, request: Request, messages: tuple[Message, ...]) -> None:
        bits = sum(8 * len(encode_message(m)[1]) for m in messages)
        briefing = self._desk.briefing
        wait_s = briefing.round_trip_s + bits / briefing.uplink_bps + self._timing.patience_s
        self._unanswered[request.request] = Unanswered(request, messages, wait_s, self._env.now + wait_s)


NOBODY = Request(0, "confirm", 0)
"""Stands for the request that is answered by what nobody asked for."""
