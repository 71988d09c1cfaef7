"""What is asked of one person, and what has to happen before it can be answered: talk, a look, another view.

Requests come from the mirror, whatever has brought them there; those that it shows no more are forgotten.
"""

from __future__ import annotations

import math

import simpy

from teleop_sim.channel.messages import FootstepPlan, Image, LogLine, Message, Request, encode_message
from teleop_sim.core.records import Emit
from teleop_sim.machines.sync import Snapshot
from teleop_sim.operators.acts import Purpose, Unanswered, Urgency, trigger
from teleop_sim.operators.at_work import TOLD
from teleop_sim.operators.belief import VIEWS
from teleop_sim.operators.desk import Desk, Errand, Order
from teleop_sim.operators.guide import Check, world_first
from teleop_sim.operators.handwork import Handworker
from teleop_sim.operators.human import Human
from teleop_sim.operators.roles import Role
from teleop_sim.operators.speech import Talker
from teleop_sim.operators.timing import OperatorTiming

SEEN = frozenset({*VIEWS, *TOLD})
"""What somebody may be waiting for."""

_SHOWING = frozenset({*VIEWS, FootstepPlan})
"""What may make it possible to give what could not be given."""

_READ_BY: dict[type[Message], Role] = {LogLine: "supervisor", Image: "immersed"}
"""Who reads what, or looks at it, when nothing else is to be done."""


class Inbox(Handworker):
    """What waits for one person's attention; ``person.py`` says what is served when.

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
        self._requests: list[Request] = []
        self._given: dict[int, tuple[Message, ...]] = {}
        self._serving = 0
        self._advised = 0
        self._orders: list[Order] = []
        self._errands: list[Errand] = []
        self._unanswered: dict[int, Unanswered] = {}
        self._tries: dict[int, int] = {}
        self._leads = "supervisor" in roles
        self._reads = frozenset(kind for kind, role in _READ_BY.items() if role in roles)
        self._minds = SEEN | self._reads
        self._rests, self._due_s = False, math.inf
        self._alarm, self._alarm_s = env.timeout(0.0), 0.0

    def notice(self, message: Message) -> None:
        """Something has arrived, and the displays have changed. What is for this person waits for attention."""
        shown, kind = self.belief.mirror.snapshot, type(message)
        # Most messages change nothing of what the mirror shows.
        if shown is not self._noticed or self._orders or self._errands or self.talks:
            self._noticed = shown
            self._take_in(shown)
        elif kind not in self._minds:
            if self._leads and self._rests and self._finds_work():
                trigger(self._news)
            return
        if self._tries and kind in _SHOWING:
            self._try_again()
        if kind in self._reads and isinstance(message, LogLine | Image):
            self._unread.append(message)
        # To wake somebody for nothing takes longer than all the rest.
        if not self._rests or self._finds_work():
            trigger(self._news)

    def _finds_work(self) -> bool:
        """Is there something to do for a person at rest, or is the alarm to be set anew?"""
        if self._requests or self._orders or self._errands or self.talks or self._unread:
            return True
        if self._leads and self._advice():
            return True
        due_s = self._next_due_s()
        return (due_s < math.inf) != (self._due_s < math.inf) or due_s < self._alarm_s

    def _next_due_s(self) -> float:
        """When an answer is overdue, or the policy wants to be asked again."""
        due_s = min([late.due_s for late in self._unanswered.values()]) if self._unanswered else math.inf
        if not self._leads:
            return due_s
        return min(due_s, self._policy.wake_s(self.belief, float(self._env.now), self._desk.briefing))

    def _take_in(self, shown: Snapshot) -> None:
        """Open requests, and where the machine is, may have changed."""
        if not (shown.asked or self._asked or self._orders or self._errands or self.talks):
            return
        if self._asked or self._requests or self._orders or self._errands or self.talks:
            self._close()
        for asked in shown.asked:
            if asked.request not in self._asked:
                request, role = self._desk.opened(asked)
                if role in self.roles:
                    self._open(request)
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

    def _open(self, request: Request) -> None:
        """A request that the mirror shows, whether it came by itself or with the whole state."""
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
            self._talk_of((speaker, listener), request, said, lambda: self.take(request))

    def _has_checked(self, request: Request) -> bool:
        """Have somebody look first, if anything should be looked at. Returns whether somebody will."""
        what = self._check(request)
        if not what:
            return False
        errand = Errand(request, what, self)
        other = self._desk.seats["primary" if what == "hand" else "auxiliary"]
        if other is self:
            self.errand(errand)
        else:
            self._talk_of((self, other), request, errand.said, lambda: other.errand(errand))
        return True

    def _check(self, request: Request) -> Check:
        """What is to be seen to before an answer."""
        hands = self._desk.hands
        if hands is None:
            return ""
        return "world" if world_first(self.belief, request) else hands.check(self.belief, request)

    def _try_again(self) -> None:
        """What could not be given for want of a view can perhaps be given now."""
        waiting = {self._serving, *(request.request for request in self._requests)}
        for number in [n for n in self._tries if n in self._asked and self._given.get(n) == () and n not in waiting]:
            del self._given[number]
            self._requests.append(self._asked[number])
            self._call(Urgency.ANSWER)

    def _talk_before(self, request: Request) -> tuple[Talker, Talker]:
        """Who says something to whom before this person can answer; nobody to himself.

        The supervisor asks the primary operator to act in lieu of a state, and the immersed one what he sees there.
        """
        if request.kind == "act":
            return self._desk.seats["supervisor"], self
        return self, self._desk.seats["immersed"] if request.kind == "decide" else self

    def take(self, request: Request) -> None:
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
        if self._unanswered:
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
        if not self._leads:
            return ()
        return self._policy.advise(self.belief, float(self._env.now), self._desk.briefing)

    def _expect(self, request: Request, messages: tuple[Message, ...]) -> None:
        bits = sum(8 * len(encode_message(m)[1]) for m in messages)
        briefing = self._desk.briefing
        wait_s = briefing.round_trip_s + bits / briefing.uplink_bps + self._timing.patience_s
        self._unanswered[request.request] = Unanswered(request, messages, wait_s, self._env.now + wait_s)
